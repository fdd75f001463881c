# A unit cell of a composite: balls at the centre and, an eighth each, at the corners, so that all faces cut balls.
# Periodic in three directions: opposite faces get the same triangles, and all eight corners are one vertex.
algebraic3d

solid left   = plane (0, 0, 0; -1, 0, 0) -bcname=left;
solid right  = plane (1, 0, 0;  1, 0, 0) -bcname=right;
solid front  = plane (0, 0, 0; 0, -1, 0) -bcname=front;
solid back   = plane (0, 1, 0; 0,  1, 0) -bcname=back;
solid bottom = plane (0, 0, 0; 0, 0, -1) -bcname=bottom;
solid top    = plane (0, 0, 1; 0, 0,  1) -bcname=top;

solid cell = left and right and front and back and bottom and top;
solid ball = sphere (0, 0, 0; 0.35);
solid row  = multitranslate (1, 0, 0; 1; ball);
solid layer = multitranslate (0, 1, 0; 1; row);
solid corners = multitranslate (0, 0, 1; 1; layer);
solid balls = (corners or sphere (0.5, 0.5, 0.5; 0.35)) and cell;

tlo balls -material=fibre -col=[1,0,0];
solid matrix = cell and not balls;
tlo matrix -material=resin -transparent;

identify periodic left right;
identify periodic front back;
identify periodic bottom top;
