algebraic3d
# A square bar along an arc in a skew plane: its y stays as near to z as it can, so the bar turns about its
# path. Its ends are the planes across the path. Volume: area times length of the arc, since the path goes
# through the centre of the section.

curve3d path = (3;  0, 0, 0;  10, 0, 5;  10, 10, 10;  1;  3, 1, 2, 3);

curve2d square = (4;
    1, 1;  1, -1;  -1, -1;  -1, 1;
    4;
    2, 1, 2;  2, 2, 3;  2, 3, 4;  2, 4, 1);

solid bar = extrusion (path; square; 0, 0, 1);

tlo bar;
