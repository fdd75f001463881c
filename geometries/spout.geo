# A cone that runs into a rod: a line of the cone is a line of the rod, and beside it both are tangent. Where they bend alike, at a third of
# the height, they change places along an ellipse. The corner of the cone's axis is 7, 24, 25.
algebraic3d

solid rod = cylinder (0, 0, 0; 0, 0, 1; 1);
solid horn = cone (1, 0, 5; 0; -0.344, 0, 0.392; 1.4);
solid spout = (rod or horn) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 3; 0, 0, 1);
tlo spout;
