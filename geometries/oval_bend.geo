algebraic3d
# A square bar and a round one, 0.4 wide, that bend along a quarter of an ellipse (semi-axes 2 and 1) between straight ends.
# The profile's y is across the plane of the bend on the first bar, and aslant on the other.
# Volume 0.16 l and 0.04 pi l, by Pappus, with l the length of the path.

curve3d path = (5;  -1, 0, 0;  0, 0, 0;  2, 0, 0;  2, 1, 0;  2, 2.5, 0;  3;  2, 1, 2;  3, 2, 3, 4;  2, 4, 5);
curve2d square = (4;  -0.2, -0.2;  0.2, -0.2;  0.2, 0.2;  -0.2, 0.2;  4;  2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);
curve2d circle = (8;
    0.2, 0;  0.2, 0.2;  0, 0.2;  -0.2, 0.2;  -0.2, 0;  -0.2, -0.2;  0, -0.2;  0.2, -0.2;
    4;
    3, 1, 2, 3;  3, 3, 4, 5;  3, 5, 6, 7;  3, 7, 8, 1);
solid bar = extrusion (path; square; 0, 0, 1);
solid rod = translate (0, 0, 2; extrusion (path; circle; 0.3, 0.2, 1));
tlo bar;
tlo rod;
