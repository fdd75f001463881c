# An angle bracket: a fillet in its inner corner, a rounded outer edge, two bolt holes. All arcs are tangent to the planes beside them.
# Section: 5 0.5 + 3.5 0.5 + 0.25 (1 - pi/4) - 0.5625 (1 - pi/4), width 2.
algebraic3d

solid width = plane (0, 0, 0; 0, -1, 0) and plane (0, 2, 0; 0, 1, 0);
solid legs = orthobrick (0, 0, 0; 5, 2, 0.5) or orthobrick (0, 0, 0; 0.5, 2, 4);
solid fillet = orthobrick (0.25, 0, 0.25; 1, 2, 1) and not cylinder (1, 0, 1; 1, 1, 1; 0.5);
solid rim = orthobrick (-1, -1, -1; 0.75, 3, 0.75) and not cylinder (0.75, 0, 0.75; 0.75, 1, 0.75; 0.75);
solid holes = cylinder (4, 1, 0; 4, 1, 1; 0.4) or cylinder (0, 1, 3; 1, 1, 3; 0.4);
solid bracket = (legs or fillet) and not (rim and plane (0.75, 0, 0; 1, 0, 0) and plane (0, 0, 0.75; 0, 0, 1)) and not holes and width;
tlo bracket -material=steel;
