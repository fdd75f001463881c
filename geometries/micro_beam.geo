# A beam of a micro-sensor with a hole, in metres: coordinates of a millionth. Volume (100 - pi) 1e-18, area (250 - 2 pi + 2 pi) 1e-12.
algebraic3d

solid beam = orthobrick (0, 0, 0; 20e-6, 5e-6, 1e-6);
solid hole = cylinder (15e-6, 2.5e-6, 0; 15e-6, 2.5e-6, 1; 1e-6);
solid part = beam and not hole;
tlo part -material=silicon;
