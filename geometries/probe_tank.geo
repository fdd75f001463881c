# A tank of water with a ball in it and three measuring points, which are vertices of the mesh; sizes of a body and of a surface, names.
# Volumes 24 - 4/3 pi 0.216 and 4/3 pi 0.216.
algebraic3d

solid glass = orthobrick (0, 0, 0; 4, 3, 2) -bcname=glass -bc=3;
solid ball = sphere (1.5, 1.5, 1; 0.6) -bcname=ball -maxh=0.25;
solid water = glass and not ball;
tlo water -material=water -maxh=0.8;
tlo ball -material=steel;
point (3, 1.5, 1);
point (3, 1.5, 1.5);
point (1.5, 1.5, 1) -factor=1;
