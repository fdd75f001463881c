# A block with a conical hole that ends in its tip, and the plug that fills it. Volumes 16 - pi/3 and pi/3.
algebraic3d

solid hole = cone (0, 0, 1; 1; 0, 0, 0.5; 0.5) and plane (0, 0, -0.5; 0, 0, -1);
solid plug = hole and plane (0, 0, 1; 0, 0, 1) and plane (0, 0, 0; 0, 0, -1);
solid block = orthobrick (-2, -2, 0; 2, 2, 1) and not hole;
tlo block;
tlo plug;
