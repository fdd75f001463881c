# Rock around a gallery with a chamber, in millimetres: coordinates of a million. The gallery ends in the chamber, a ball.
# Volume 2e18 - 4/3 pi R^3 - (pi r^2 L - 2/3 pi (R^3 - (R^2 - r^2)^1.5)), R = 3e5, r = 1e5, L = 1e6.
algebraic3d

solid rock = orthobrick (1000000, 0, -500000; 3000000, 1000000, 500000);
solid gallery = cylinder (1000000, 500000, 0; 2000000, 500000, 0; 100000) and plane (2000000, 0, 0; 1, 0, 0);
solid chamber = sphere (2000000, 500000, 0; 300000);
solid part = rock and not gallery and not chamber;
tlo part -material=granite;
