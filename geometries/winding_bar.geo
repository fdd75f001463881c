algebraic3d
# A square bar that climbs, turns into another climb and goes on straight: on its arc it turns about its path, so that its
# sides touch those of the straight parts along the joints. Volume: area times length of the path.

curve3d path = (5;
    -10, 0, -5;  0, 0, 0;  10, 0, 5;  10, 10, 10;  10, 20, 15;
    3;
    2, 1, 2;  3, 2, 3, 4;  2, 4, 5);

curve2d square = (4;
    1, 1;  1, -1;  -1, -1;  -1, 1;
    4;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);

solid bar = extrusion (path; square; 0, 0, 1);

tlo bar;
