# One throw of a crankshaft: journals, two webs with rounded counterweights, a crank pin with an oil bore.
# Units: millimetres.
algebraic3d

solid journals = (cylinder (0, 0, 0; 1, 0, 0; 20)
               and plane (-70, 0, 0; -1, 0, 0)
               and plane (110, 0, 0; 1, 0, 0))
               and not (plane (10, 0, 0; -1, 0, 0) and plane (30, 0, 0; 1, 0, 0));

solid outline = orthobrick (-100, -16, -40; 200, 16, 38)
             or (cylinder (0, 0, -38; 1, 0, -38; 34) and plane (0, 0, -20; 0, 0, 1));

solid weba = outline and plane (-12, 0, 0; -1, 0, 0) and plane (8, 0, 0; 1, 0, 0);
solid webb = outline and plane (32, 0, 0; -1, 0, 0) and plane (52, 0, 0; 1, 0, 0);

solid pin = cylinder (0, 0, 24; 1, 0, 24; 12)
        and plane (-5, 0, 0; -1, 0, 0)
        and plane (45, 0, 0; 1, 0, 0);

solid bore = cylinder (0, 0, 24; 1, 0, 24; 3);

solid crankshaft = (journals or weba or webb or pin) and not bore;

tlo crankshaft -col=[0.6,0.6,0.65] -material=steel;
