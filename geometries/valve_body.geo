# A valve: a ball with two pipe ends and a neck, hollow alike. Its exact numbers are in the tests.
algebraic3d

solid ends = plane (-4, 0, 0; -1, 0, 0) and plane (4, 0, 0; 1, 0, 0);
solid neck = plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 3.5; 0, 0, 1);
solid outside = sphere (0, 0, 0; 2) or (cylinder (-1, 0, 0; 1, 0, 0; 1) and ends) or (cylinder (0, 0, 0; 0, 0, 1; 1.2) and neck);
solid inside = sphere (0, 0, 0; 1.6) or (cylinder (-1, 0, 0; 1, 0, 0; 0.7) and ends) or (cylinder (0, 0, 0; 0, 0, 1; 0.8) and neck);
solid valve = outside and not inside;
tlo valve -material=brass;
