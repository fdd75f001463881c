# Two rings with seven balls between them: nine bodies that do not touch.
algebraic3d

solid width = plane (0, 0, -1; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid outer = cylinder (0, 0, 0; 0, 0, 1; 6) and not cylinder (0, 0, 0; 0, 0, 1; 5) and width;
solid inner = cylinder (0, 0, 0; 0, 0, 1; 3) and not cylinder (0, 0, 0; 0, 0, 1; 2) and width;
solid balls = multirotate (0, 0, 0; 0, 0, 0.8975979010256552; 7; sphere (4, 0, 0; 0.8));

tlo outer -material=steel;
tlo inner -material=steel;
tlo balls -material=ceramic;
