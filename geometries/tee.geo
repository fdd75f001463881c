# A pipe tee: the branch is thinner than the run, so that the saddle curves are clean. The wall and the
# fluid are two bodies with a conforming interface.
algebraic3d

solid outside = (cylinder (0, 0, 0; 1, 0, 0; 1.2) and plane (-4, 0, 0; -1, 0, 0) and plane (4, 0, 0; 1, 0, 0))
             or (cylinder (0, 0, 0; 0, 0, 1; 0.8) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 3.5; 0, 0, 1));
solid inside  = (cylinder (0, 0, 0; 1, 0, 0; 1.0) and plane (-4, 0, 0; -1, 0, 0) and plane (4, 0, 0; 1, 0, 0))
             or (cylinder (0, 0, 0; 0, 0, 1; 0.6) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 3.5; 0, 0, 1));

solid wall = outside and not inside;

tlo wall -material=steel -col=[0.5,0.5,0.5];
tlo inside -material=water -col=[0.2,0.4,1.0] -transparent;
