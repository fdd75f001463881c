# A layered plate, each layer with a size of its own: the middle one is thin.
algebraic3d

solid bottom = orthobrick (0, 0, 0; 4, 4, 1) -bc=1;
solid middle = orthobrick (0, 0, 1; 4, 4, 1.2) -bc=2;
solid top    = orthobrick (0, 0, 1.2; 4, 4, 2.2) -bc=3;

tlo bottom -maxh=1.0 -material=substrate;
tlo middle -maxh=0.4 -material=film;
tlo top -maxh=0.7 -material=cover;
