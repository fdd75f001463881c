# A boss on a plate with a fillet: the torus is tangent to the plate along one circle and to the boss along another. Its major
# radius and the plane of the fillet are written with an error of 3e-10.
# Volume 36 + 2 pi + 0.625 pi - (pi/8) (1.5 - 2/(3 pi)) pi.
algebraic3d

solid plate = orthobrick (-3, -3, -1; 3, 3, 0);
solid boss  = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, -0.5; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid ring  = cylinder (0, 0, 0; 0, 0, 1; 1.5) and plane (0, 0, -0.5; 0, 0, -1) and plane (0, 0, 0.5; 0, 0, 1);
solid fillet = ring and not torus (0, 0, 0.5; 0, 0, 1; 1.5000000003; 0.5);

solid part = plate or boss or fillet;
tlo part;
