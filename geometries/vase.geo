algebraic3d
# A vase: its outside and its inside are arcs, its foot is plane, and its bottom inside is a cap on the axis.

curve2d profile = (13;
    0, 0;
    0, 2;
    1, 5;
    5, 3.2;
    7.5, 1.6;
    9, 2.5;
    8.9, 2.3;
    7.5, 1.5;
    5.2, 2.7;
    2.5, 3.7;
    1.5, 2.2;
    0.5, 2.2;
    0.5, 0;
    7;
    2, 1, 2;
    3, 2, 3, 4;
    3, 4, 5, 6;
    2, 6, 7;
    3, 7, 8, 9;
    3, 9, 10, 11;
    3, 11, 12, 13);

solid vase = revolution (0, 0, 0; 0, 0, 1; profile);

tlo vase -maxh=1;
