# Three fibres in a matrix: four bodies, of two materials, with conforming interfaces.
algebraic3d

solid cell = orthobrick (0, 0, 0; 3, 2, 2);
solid fibre1 = cylinder (0, 0.6, 0.6; 1, 0.6, 0.6; 0.35) and cell -maxh=0.3;
solid fibre2 = cylinder (0, 1.4, 0.7; 1, 1.4, 0.7; 0.3) and cell -maxh=0.3;
solid fibre3 = cylinder (0, 1.0, 1.4; 1, 1.0, 1.4; 0.4) and cell -maxh=0.3;
solid matrix = cell and not fibre1 and not fibre2 and not fibre3;

tlo fibre1 -material=carbon -col=[0.1,0.1,0.1];
tlo fibre2 -material=carbon -col=[0.1,0.1,0.1];
tlo fibre3 -material=carbon -col=[0.1,0.1,0.1];
tlo matrix -material=epoxy -col=[0.9,0.8,0.4] -transparent;
