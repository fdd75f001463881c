# A unit cube with edges and corners rounded by 0.2: planes, rods and balls are tangent along 48 lines and arcs, and in
# each of 24 points a plane, two rods and a ball touch. Volume 0.6^3 + 6 0.6^2 0.2 + 3 0.6 0.04 pi + 4/3 0.008 pi.
algebraic3d

solid x = orthobrick (0, 0.2, 0.2; 1, 0.8, 0.8);
solid y = orthobrick (0.2, 0, 0.2; 0.8, 1, 0.8);
solid z = orthobrick (0.2, 0.2, 0; 0.8, 0.8, 1);

solid alongx = (cylinder (0, 0.2, 0.2; 1, 0.2, 0.2; 0.2) or cylinder (0, 0.8, 0.2; 1, 0.8, 0.2; 0.2)
             or cylinder (0, 0.2, 0.8; 1, 0.2, 0.8; 0.2) or cylinder (0, 0.8, 0.8; 1, 0.8, 0.8; 0.2))
             and plane (0.2, 0, 0; -1, 0, 0) and plane (0.8, 0, 0; 1, 0, 0);
solid alongy = (cylinder (0.2, 0, 0.2; 0.2, 1, 0.2; 0.2) or cylinder (0.8, 0, 0.2; 0.8, 1, 0.2; 0.2)
             or cylinder (0.2, 0, 0.8; 0.2, 1, 0.8; 0.2) or cylinder (0.8, 0, 0.8; 0.8, 1, 0.8; 0.2))
             and plane (0, 0.2, 0; 0, -1, 0) and plane (0, 0.8, 0; 0, 1, 0);
solid alongz = (cylinder (0.2, 0.2, 0; 0.2, 0.2, 1; 0.2) or cylinder (0.8, 0.2, 0; 0.8, 0.2, 1; 0.2)
             or cylinder (0.2, 0.8, 0; 0.2, 0.8, 1; 0.2) or cylinder (0.8, 0.8, 0; 0.8, 0.8, 1; 0.2))
             and plane (0, 0, 0.2; 0, 0, -1) and plane (0, 0, 0.8; 0, 0, 1);
solid balls = sphere (0.2, 0.2, 0.2; 0.2) or sphere (0.8, 0.2, 0.2; 0.2)
           or sphere (0.2, 0.8, 0.2; 0.2) or sphere (0.8, 0.8, 0.2; 0.2)
           or sphere (0.2, 0.2, 0.8; 0.2) or sphere (0.8, 0.2, 0.8; 0.2)
           or sphere (0.2, 0.8, 0.8; 0.2) or sphere (0.8, 0.8, 0.8; 0.2);

solid block = x or y or z or alongx or alongy or alongz or balls;
tlo block;
