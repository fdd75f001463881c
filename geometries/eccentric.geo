# A shaft with a thinner one on it, flush with it along a line: the step between both ends in a cusp on either side of that line.
# Volume 5/4 pi, area 5 pi.
algebraic3d

solid shaft = cylinder (0, 0, 0; 0, 0, 1; 1) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid pin = cylinder (0.5, 0, 0; 0.5, 0, 1; 0.5) and plane (0, 0, 1; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid eccentric = shaft or pin;
tlo eccentric;
