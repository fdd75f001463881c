# A rod that ends in balls of about its radius: the decimals make a gap at one end and a step at the other, both of 1e-9.
# Volume 10/3 pi.
algebraic3d

solid rod = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid capsule = rod or sphere (0, 0, 0; 1.000000001) or sphere (0, 0, 2; 0.9999999995);
tlo capsule;
