algebraic3d
# A pipe that goes straight, bends by a quarter, and goes straight again: an extrusion along
# lines and an arc. Volume: pi (0.5^2 - 0.4^2) (2 + 2 pi/2 + 1) = 0.09 pi (3 + pi).

curve3d path = (5;
    -2, 0, 0;
     0, 0, 0;
     2, 0, 0;
     2, 2, 0;
     2, 3, 0;
    3;
    2, 1, 2;
    3, 2, 3, 4;
    2, 4, 5);

curve2d outer = (8;
     0.5, 0;  0.5, -0.5;  0, -0.5;  -0.5, -0.5;  -0.5, 0;  -0.5, 0.5;  0, 0.5;  0.5, 0.5;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);

curve2d inner = (8;
     0.4, 0;  0.4, -0.4;  0, -0.4;  -0.4, -0.4;  -0.4, 0;  -0.4, 0.4;  0, 0.4;  0.4, 0.4;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);

solid pipe = extrusion (path; outer; 0, 0, 1) and not extrusion (path; inner; 0, 0, 1);

tlo pipe;
