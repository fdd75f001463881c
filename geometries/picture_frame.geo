algebraic3d
# A frame with mitred corners: the path is closed and has no arcs. The profile is an L.
# Volume: by legs of the section, 2 (0.6 0.2) (4 + 3) + ... see the tests.

curve3d path = (5;  0, 0, 0;  4, 0, 0;  4, 3, 0;  0, 3, 0;  0, 0, 0;  4;  2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 5);
curve2d section = (6;
    -0.3, -0.2;  -0.3, 0.2;  0.3, 0.2;  0.3, 0;  0, 0;  0, -0.2;
    6;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 5;  2, 5, 6;  2, 6, 1);
solid frame = extrusion (path; section; 0, 0, 1);
tlo frame -material=oak;
