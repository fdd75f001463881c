# A plate with two heaters on its top: top-level objects with a surface make the parts of the top inside two cylinders
# patches of their own, with numbers, names and, one of them, a size. The edge where the plate is clamped is tagged as singular.
algebraic3d

solid top  = plane (0, 0, 0.2; 0, 0, 1) -bcname=top;
solid side = plane (0, 0, 0; -1, 0, 0) -bc=7 -bcname=clamped;
solid plate = side and plane (0, 0, 0; 0, -1, 0) and plane (0, 0, 0; 0, 0, -1)
          and top and plane (2, 1, 0; 1, 0, 0) and plane (2, 1, 0; 0, 1, 0);

solid round = top and plane (0, 0, 0; 0, 0, -1) and cylinder (0.5, 0.5, 0; 0.5, 0.5, 1; 0.25);
solid strip = top and plane (0, 0, 0; 0, 0, -1) and plane (1.2, 0, 0; -1, 0, 0) and plane (1.6, 0, 0; 1, 0, 0);

tlo plate -material=copper;
tlo round top -bc=11 -bcname=heater -maxh=0.08 -col=[1,0,0];
tlo strip top -bc=12 -bcname=strip -col=[1,0.5,0];

singular edge side top -factor=2 -maxh=0.1;
singular face plate top;
