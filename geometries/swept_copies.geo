algebraic3d
# One turned ring, and copies of it that are moved and rotated; and a bent bar beside them.
# Volume of a ring: 2 pi * 2 * area, where the area is that of a square of side 1 with one side bulging by a quarter circle.

curve2d profile = (5;
    -0.5, 1.5;  -0.5, 2.5;  0, 3;  0.5, 2.5;  0.5, 1.5;
    4;
    2, 1, 2;  3, 2, 3, 4;  2, 4, 5;  2, 5, 1);

solid ring = revolution (0, 0, 0; 0, 0, 1; profile);
solid tilted = translate (6, 0, 0; rotate (0, 0, 0; 0, 0.7, 0.4; ring));

curve3d path = (3;  0, 0, 0;  3, 0, 0;  3, 3, 0;  1;  3, 1, 2, 3);
curve2d bar = (4;  0.3, 0.2;  0.3, -0.2;  -0.3, -0.2;  -0.3, 0.2;  4;  2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);
solid bent = translate (-1, 4, 1; rotate (0, 0, 0; 0.3, 0.5, 0.2; extrusion (path; bar; 0, 0, 1)));

tlo ring;
tlo tilted;
tlo bent;
