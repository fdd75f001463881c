# A pyramid on a cube with a horizontal hole: four planes meet in one point. Volume 12 - 0.32 pi.
algebraic3d

solid cube = orthobrick (-1, -1, 0; 1, 1, 2);
solid tower = plane (0, 0, 5; 3, 0, 1) and plane (0, 0, 5; -3, 0, 1) and plane (0, 0, 5; 0, 3, 1) and plane (0, 0, 5; 0, -3, 1)
          and plane (0, 0, 2; 0, 0, -1);
solid hole = cylinder (0, 0, 1; 1, 0, 1; 0.4);
solid part = (cube or tower) and not hole;
tlo part;
