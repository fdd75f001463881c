algebraic3d
# A square moved along a circle: the path is closed, made of four arcs.
# Volume: 2^2 * 2 pi 10 = 80 pi.

curve3d path = (8;
      0,  0, 0;  10,  0, 0;  10, 10, 0;  10, 20, 0;
      0, 20, 0; -10, 20, 0; -10, 10, 0; -10,  0, 0;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);

curve2d square = (4;
    1, 1;  1, -1;  -1, -1;  -1, 1;
    4;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);

solid ring = extrusion (path; square; 0, 0, 1);

tlo ring;
