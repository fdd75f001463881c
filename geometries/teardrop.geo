# A cam: two planes tangent to a cylinder, meeting in an edge. Area of the section pi - (acos 0.6 - 0.48) + 64/75, height 1.
algebraic3d

solid wedge = plane (0.6, 0.8, 0; 0.6, 0.8, 0) and plane (0.6, -0.8, 0; 0.6, -0.8, 0) and plane (0.6, 0, 0; -1, 0, 0);
solid cam = (wedge or cylinder (0, 0, 0; 0, 0, 1; 1)) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
tlo cam;
