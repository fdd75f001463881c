algebraic3d
# A frame with mitred corners: the path is closed and has no arcs. The profile is an L.
# Each point of the section goes around a rectangle that is the larger the farther out it is (x): volume 14 0.18 - 8 0.009 = 2.448.

curve3d path = (5;  0, 0, 0;  4, 0, 0;  4, 3, 0;  0, 3, 0;  0, 0, 0;  4;  2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 5);
curve2d section = (6;
    -0.3, -0.2;  -0.3, 0.2;  0.3, 0.2;  0.3, 0;  0, 0;  0, -0.2;
    6;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 5;  2, 5, 6;  2, 6, 1);
solid frame = extrusion (path; section; 0, 0, 1);
tlo frame -material=oak;
