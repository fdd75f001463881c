algebraic3d
# A round handle with two mitred corners. Volume 0.25 pi 10: the path goes through the centre of the section.

curve3d path = (4;  0, 0, 0;  0, 0, 3;  4, 0, 3;  4, 0, 0;  3;  2, 1, 2;  2, 2, 3;  2, 3, 4);
curve2d round = (8;
     0.5, 0;  0.5, -0.5;  0, -0.5;  -0.5, -0.5;  -0.5, 0;  -0.5, 0.5;  0, 0.5;  0.5, 0.5;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);
solid handle = extrusion (path; round; 0, 1, 0);
tlo handle;
