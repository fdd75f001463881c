# Two cones with different tips, tangent along the line x = y = 0 from inside: below the ellipse that they have in common, too, one is the
# boundary, above it the other. Their angles are those of the triangles 5, 12, 13 and 7, 24, 25.
algebraic3d

solid wide = cone (0, 0, 3; 0; -0.6, 0, 1.56; 0.65);
solid slim = cone (0, 0, 4; 0; -1.344, 0, -0.608; 1.4);
solid cones = (wide or slim) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
tlo cones;
