# A needle in its seat: two bodies with a cone and the rim of a cylinder in common; the needle ends in its tip inside the bore.
# Volume of the needle 0.64 pi 2 + 1/3 pi 0.64 1.6.
algebraic3d

solid stem = cylinder (0, 0, 0; 0, 0, 1; 0.8) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid tip = cone (0, 0, 0; 0.8; 0, 0, -0.8; 0.4) and plane (0, 0, 0; 0, 0, 1) and plane (0, 0, -1.6; 0, 0, -1);
solid needle = stem or tip;
solid seat = orthobrick (-1.5, -1.5, -1.2; 1.5, 1.5, 1) and not needle and not cylinder (0, 0, 0; 0, 0, 1; 0.4);
tlo needle -material=steel;
tlo seat -material=bronze;
