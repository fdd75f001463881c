# A thin plate with a hole and a slot with round ends. Volume 0.1 (96 - 0.25 pi - (2 + 0.25 pi)).
algebraic3d

solid plate = orthobrick (0, 0, 0; 12, 8, 0.1);
solid hole = cylinder (3, 4, 0; 3, 4, 1; 0.5);
solid slot = orthobrick (7, 3.5, -1; 9, 4.5, 1) or cylinder (7, 4, 0; 7, 4, 1; 0.5) or cylinder (9, 4, 0; 9, 4, 1; 0.5);
solid part = plate and not hole and not slot;
tlo part;
