# Two rings on each other with one torus through both: coincident planes, cylinders and tori of three bodies.
algebraic3d

solid band = cylinder (0, 0, 0; 0, 0, 1; 3) and not cylinder (0, 0, 0; 0, 0, 1; 1);
solid wire = torus (0, 0, 1; 0, 0, 1; 2; 0.4);
solid lower = band and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1) and not wire;
solid upper = band and plane (0, 0, 1; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1) and not wire;
tlo lower;
tlo upper;
tlo wire -material=copper;
