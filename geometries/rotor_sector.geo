# A sixth of a rotor: its two cuts, 60 degrees apart, are periodic by rotation about the axis. A bolt hole lies on each of
# them, half on this side and half on the next.
algebraic3d

solid first  = plane (0, 0, 0; 0, -1, 0) -bcname=first_cut;
solid second = plane (0, 0, 0; -0.86602540378443865, 0.5, 0) -bcname=second_cut;
solid shaft  = cylinder (0, 0, 0; 0, 0, 1; 0.4);
solid rim    = cylinder (0, 0, 0; 0, 0, 1; 1.5);
solid holes  = cylinder (1, 0, 0; 1, 0, 1; 0.15)
            or cylinder (0.5, 0.86602540378443865, 0; 0.5, 0.86602540378443865, 1; 0.15);

solid sector = first and second and rim and not shaft and not holes
           and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 0.3; 0, 0, 1);

tlo sector -material=steel;

identify periodic first second;
