algebraic3d
# A square bar that turns about its path while it bends along a quarter of an ellipse, since its y is aslant to the plane of the bend.
# Volume 0.16 l, with l the length of the path.

curve3d path = (5;  -1, 0, 0;  0, 0, 0;  2, 0, 0;  2, 1, 0;  2, 2.5, 0;  3;  2, 1, 2;  3, 2, 3, 4;  2, 4, 5);
curve2d square = (4;  -0.2, -0.2;  0.2, -0.2;  0.2, 0.2;  -0.2, 0.2;  4;  2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);
solid bar = extrusion (path; square; 0.3, 0.2, 1);
tlo bar;
