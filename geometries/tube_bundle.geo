# A piece of a heat exchanger: seven tubes between two sheets; the tubes with the sheets, and the fluid around them, are two bodies.
# Volumes: fluid 2 pi (2.25 - 7 0.09), steel 7 (0.09 - 0.0324) pi 2 + 0.8 pi (2.25 - 7 0.0324).
algebraic3d

solid length = plane (0, 0, -0.4; 0, 0, -1) and plane (0, 0, 2.4; 0, 0, 1);
solid inside = plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid shell = cylinder (0, 0, 0; 0, 0, 1; 1.5);
solid outer = cylinder (0, 0, 0; 0, 0, 1; 0.3) or multirotate (0, 0, 0; 0, 0, 1.0471975511965976; 6; cylinder (0.9, 0, 0; 0.9, 0, 1; 0.3));
solid inner = cylinder (0, 0, 0; 0, 0, 1; 0.18) or multirotate (0, 0, 0; 0, 0, 1.0471975511965976; 6; cylinder (0.9, 0, 0; 0.9, 0, 1; 0.18));

solid fluid = shell and inside and not outer;
solid steel = shell and length and not inner and not fluid;
tlo fluid -material=water;
tlo steel -material=steel;
