# A block with one edge rounded, of size 1 and a thousand kilometres from the origin. Volume 6 - 0.09 (1 - pi/4).
algebraic3d

solid block = orthobrick (1000000, -500000, 0; 1000003, -499998, 1);
solid corner = orthobrick (999999, -500001, -1; 1000000.3, -499999.7, 2)
           and not cylinder (1000000.3, -499999.7, 0; 1000000.3, -499999.7, 1; 0.3);
solid part = block and not corner;
tlo part;
