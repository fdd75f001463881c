algebraic3d
# An I-beam with rounded inner corners, cut at an angle at one end by a plane of its own.
# The area of the profile: 2 * 4 * 0.5 + 4 * 0.4 + 4 * (1 - pi/4) * 0.3^2.

curve3d path = (2;  0, 0, 0;  12, 0, 0;  1;  2, 1, 2);

curve2d profile = (20;
    -2, -2.5;  -2, -2;
    -0.5, -2;  -0.2, -2;  -0.2, -1.7;
    -0.2, 1.7;  -0.2, 2;  -0.5, 2;
    -2, 2;  -2, 2.5;
    2, 2.5;  2, 2;
    0.5, 2;  0.2, 2;  0.2, 1.7;
    0.2, -1.7;  0.2, -2;  0.5, -2;
    2, -2;  2, -2.5;
    16;
    2, 1, 2;    2, 2, 3;    3, 3, 4, 5;    2, 5, 6;    3, 6, 7, 8;    2, 8, 9;    2, 9, 10;    2, 10, 11;
    2, 11, 12;  2, 12, 13;  3, 13, 14, 15; 2, 15, 16;  3, 16, 17, 18; 2, 18, 19;  2, 19, 20;   2, 20, 1);

solid beam = extrusion (path; profile; 0, 0, 1);
solid cut = beam and plane (10, 0, 0; 1, 0, 0.2);

tlo cut -maxh=1;
