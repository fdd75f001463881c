# An S of two bends of one bore, a straight end and a ball at the other end: cylinder, tori and ball are tangent
# along whole circles. Volume (pi + 1) 0.09 pi + 2/3 0.027 pi.
algebraic3d

solid up   = torus (1, 0, 0; 0, 1, 0; 1; 0.3) and plane (0, 0, 0; 0, 0, -1) and plane (1, 0, 0; 1, 0, 0);
solid down = torus (-1, 0, 0; 0, 1, 0; 1; 0.3) and plane (0, 0, 0; 0, 0, 1) and plane (-1, 0, 0; -1, 0, 0);
solid end  = cylinder (1, 0, 1; 2, 0, 1; 0.3) and plane (1, 0, 0; -1, 0, 0) and plane (2, 0, 0; 1, 0, 0);
solid s = up or down or end or sphere (-1, 0, -1; 0.3);
tlo s;
