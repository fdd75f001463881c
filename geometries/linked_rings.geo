# Two tori, one through the other. Volume pi^2 each.
algebraic3d

solid one = torus (0, 0, 0; 0, 0, 1; 2; 0.5);
solid other = torus (2, 0, 0; 0, 1, 0; 2; 0.5);
tlo one;
tlo other;
