# A block with two crossing bores of one radius and a blind one with a conical end. Its exact numbers are in the tests.
algebraic3d

solid block = orthobrick (-2, -2, -1.5; 2, 2, 1.5);
solid bores = cylinder (0, 0, 0; 1, 0, 0; 0.5) or cylinder (0, 0, 0; 0, 1, 0; 0.5);
solid drill = (cylinder (1.3, 1.3, 0; 1.3, 1.3, 1; 0.4) and plane (0, 0, 0; 0, 0, -1))
           or (cone (1.3, 1.3, 0; 0.4; 1.3, 1.3, -0.2; 0.2) and plane (0, 0, -0.4; 0, 0, -1) and plane (0, 0, 0; 0, 0, 1));
solid part = block and not bores and not drill;
tlo part -material=aluminium;
