# A biconvex lens: the part that two spheres share, with a ground cylindrical rim.
algebraic3d

solid lens = sphere (0, 0, -4; 5)
         and sphere (0, 0, 4; 5)
         and cylinder (0, 0, 0; 0, 0, 1; 2.8);

tlo lens -material=glass;
