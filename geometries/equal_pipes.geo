# Two pipes of one radius that cross: the curves of their intersection cross in two points. One radius is off by 2e-10.
# Volume 12 pi - 16/3.
algebraic3d

solid one = cylinder (-5, 0, 0; 5, 0, 0; 1.0000000002) and plane (-3, 0, 0; -1, 0, 0) and plane (3, 0, 0; 1, 0, 0);
solid other = cylinder (0, -5, 0; 0, 5, 0; 1) and plane (0, -3, 0; 0, -1, 0) and plane (0, 3, 0; 0, 1, 0);
solid cross = one or other;
tlo cross;
