# Half of a hollow ellipsoid.
algebraic3d

solid dome = ellipsoid (0, 0, 0; 3, 0, 0; 0, 2, 0; 0, 0, 1.5)
         and not ellipsoid (0, 0, 0; 2.4, 0, 0; 0, 1.4, 0; 0, 0, 1.0)
         and plane (0, 0, 0; 0, 0, -1);

tlo dome -material=concrete;
