algebraic3d
# An elliptic tube that bends by a quarter: semi-axes 0.6 (in the plane of the bend) and 0.4, radius of the bend 2.
# Volume 0.24 pi^2, by Pappus.

curve3d path = (3;  0, 0, 0;  2, 0, 0;  2, 2, 0;  1;  3, 1, 2, 3);
curve2d ellipse = (8;
     0.6, 0;  0.6, -0.4;  0, -0.4;  -0.6, -0.4;  -0.6, 0;  -0.6, 0.4;  0, 0.4;  0.6, 0.4;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);
solid bend = extrusion (path; ellipse; 0, 0, 1);
tlo bend;
