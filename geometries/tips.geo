# Cones with their tips: one in a skew position, an elliptic one, a sector whose edge runs through the tip, a pair of
# nappes. Volumes pi/3, 2 pi/3, pi/12 and 2 pi/3 in the order of the bodies.
algebraic3d

solid straight = cone (0, 0, 0; 1; 0, 0, 0.5; 0.5) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1);
solid skew = translate (-3, 0, 0; rotate (0.3, 0.5, 1.1; 0.4, 0.7, 1.1; straight));
solid elliptic = translate (3, 0, 0; ellipticcone (0, 0, 0; 2, 0, 0; 0, 1, 0; 0.5; 0.5)
             and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 1; 0, 0, 1));
solid sector = straight and plane (0, 0, 0; 1, 0, 0) and plane (0, 0, 0; 0, 1, 0);
solid pair = translate (0, 4, 0; cone (0, 0, 0; 1; 0, 0, 0.5; 0.5) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1));

tlo skew;
tlo elliptic;
tlo sector;
tlo pair;
