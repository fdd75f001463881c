# An angle bracket with four bolt holes and a stiffening rib. Units: millimetres.
algebraic3d

solid base = orthobrick (0, 0, 0; 80, 60, 8);
solid wall = orthobrick (0, 0, 0; 8, 60, 70);
solid rib = orthobrick (4, 26, 4; 56, 34, 56)
        and plane (50, 30, 8; 1, 0, 1);

solid holes = cylinder (60, 15, 0; 60, 15, 1; 5)
           or cylinder (60, 45, 0; 60, 45, 1; 5)
           or cylinder (0, 15, 50; 1, 15, 50; 5)
           or cylinder (0, 45, 50; 1, 45, 50; 5);

solid bracket = (base or wall or rib) and not holes;

tlo bracket -material=aluminium;
