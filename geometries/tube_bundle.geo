# A heat exchanger: seven tubes between two sheets in a shell; tubes with sheets, and the fluid around them, are two bodies.
# Volumes: fluid 6 pi (2.25 - 7 0.09), steel 7 0.05 pi 7 + 2 0.5 pi (2.25 - 7 0.09).
algebraic3d

solid length = plane (0, 0, -0.5; 0, 0, -1) and plane (0, 0, 6.5; 0, 0, 1);
solid inside = plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 6; 0, 0, 1);
solid shell = cylinder (0, 0, 0; 0, 0, 1; 1.5);
solid outer = cylinder (0, 0, 0; 0, 0, 1; 0.3) or multirotate (0, 0, 0; 0, 0, 1.0471975511965976; 6; cylinder (0.9, 0, 0; 0.9, 0, 1; 0.3));
solid inner = cylinder (0, 0, 0; 0, 0, 1; 0.2) or multirotate (0, 0, 0; 0, 0, 1.0471975511965976; 6; cylinder (0.9, 0, 0; 0.9, 0, 1; 0.2));

solid fluid = shell and inside and not outer;
solid steel = shell and length and not inner and not fluid;
tlo fluid -material=water;
tlo steel -material=steel;
