# A disk whose upper rim is rounded by a torus without help of a plane or cylinder through the seams.
# Volume 4 pi - 0.333 pi + 0.045 (1.7 + 0.4/pi) pi^2.
algebraic3d

solid disk = cylinder (0, 0, 0; 0, 0, 1; 2) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid corner = cylinder (0, 0, 0; 0, 0, 1; 3) and not cylinder (0, 0, 0; 0, 0, 1; 1.7) and plane (0, 0, 0.7; 0, 0, -1);
solid rim = disk and not corner or torus (0, 0, 0.7; 0, 0, 1; 1.7; 0.3);
tlo rim;
