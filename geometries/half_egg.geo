# Half of an ellipsoid of revolution, turned in space and moved. Volume 2/3 pi 1 1 2; the area is in the tests.
algebraic3d

solid half = ellipsoid (0, 0, 0; 1, 0, 0; 0, 1, 0; 0, 0, 2) and plane (0, 0, 0; 0, 0, -1);
solid egg = translate (10, -3, 2; rotate (0, 0, 0; 0.3, 0.8, 1.9; half));
tlo egg;
