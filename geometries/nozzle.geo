# A converging-diverging nozzle: two cone frusta that meet in a cylindrical throat.
algebraic3d

solid inlet  = cone (0, 0, 0; 2.0; 3, 0, 0; 0.8) and plane (0, 0, 0; -1, 0, 0) and plane (3, 0, 0; 1, 0, 0);
solid throat = cylinder (0, 0, 0; 1, 0, 0; 0.8) and plane (2.5, 0, 0; -1, 0, 0) and plane (4, 0, 0; 1, 0, 0);
solid outlet = cone (4, 0, 0; 0.8; 8, 0, 0; 1.6) and plane (4, 0, 0; -1, 0, 0) and plane (8, 0, 0; 1, 0, 0);

solid flow = inlet or throat or outlet;

tlo flow -material=gas;
