algebraic3d
# A turned spindle: cylinders, cones, a plane shoulder, and a groove that is part of a torus.
# Its profile is closed by the axis.

curve2d profile = (14;
    0, 0;
    0, 1;
    0.2, 1.2;
    3, 1.2;
    3, 2;
    4, 2;
    5, 2;
    5, 1.5;
    5.5, 1;
    6, 1.5;
    8, 1;
    10, 1;
    10.3, 0.7;
    10.3, 0;
    12;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 5;  2, 5, 6;  2, 6, 7;  2, 7, 8;
    3, 8, 9, 10;
    2, 10, 11;  2, 11, 12;  2, 12, 13;  2, 13, 14);

solid spindle = revolution (0, 0, 0; 1, 0, 0; profile);

tlo spindle -maxh=0.8;
