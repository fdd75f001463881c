# A sheared unit cell with a pore: the period from front to back is not along their normal, the one from left to right is askew
# to the axes. Periodic in these two directions; bottom and top are free.
algebraic3d

solid left  = plane (0, 0, 0; -1, 0.3, 0);
solid right = plane (1.2, 0, 0; 1, -0.3, 0);
solid front = plane (0, 0, 0; 0, -1, 0);
solid back  = plane (0.3, 1, 0; 0, 1, 0);
solid pore  = sphere (0.75, 0.5, 0.4; 0.25);
solid pipe  = cylinder (0, 0.5, 0.4; 1, 0.5, 0.4; 0.12);

solid cell = left and right and front and back
         and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 0.8; 0, 0, 1)
         and not pore and not pipe;

tlo cell -material=rock;

identify periodic left right;
identify periodic front back;
