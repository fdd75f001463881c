# A pipe flange: six bolt holes around a bore.
algebraic3d

solid disc = cylinder (0, 0, 0; 0, 0, 1; 5) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid neck = cylinder (0, 0, 0; 0, 0, 1; 2.6) and plane (0, 0, 0.5; 0, 0, -1) and plane (0, 0, 3; 0, 0, 1);
solid bore = cylinder (0, 0, 0; 0, 0, 1; 2);
solid bolts = multirotate (0, 0, 0; 0, 0, 1.0471975511965976; 6; cylinder (3.8, 0, 0; 3.8, 0, 1; 0.5));

solid flange = (disc or neck) and not bore and not bolts;

tlo flange;
