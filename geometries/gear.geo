# A spur gear, nearly: a disc with twelve straight teeth, a bore and a keyway. Its exact numbers are in the tests.
algebraic3d

solid width = plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid tooth = orthobrick (2, -0.3, 0; 3.6, 0.3, 1);
solid teeth = multirotate (0, 0, 0; 0, 0, 0.52359877559829882; 12; tooth);
solid disc = cylinder (0, 0, 0; 0, 0, 1; 3) and width;
solid bore = cylinder (0, 0, 0; 0, 0, 1; 1) or orthobrick (-0.25, 0, -1; 0.25, 1.3, 2);
solid gear = (disc or teeth) and not bore;
tlo gear -material=steel;
