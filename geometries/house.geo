# A polyhedron with faces of three and four points, some of them in one plane; numbers face by face, a name for the roof, a singular point at
# the top of a gable, and a constant that says how exact identifications are. Volume 2 3 2 + 3 = 15.
algebraic3d

define constant identprec = 1e-9;

solid walls = polyhedron (
        0, 0, 0;  2, 0, 0;  2, 3, 0;  0, 3, 0;  0, 0, 2;  2, 0, 2;  2, 3, 2;  0, 3, 2;  1, 0, 3;  1, 3, 3 ;;
        1, 4, 3, 2;  1, 2, 6, 5;  5, 6, 9;  2, 3, 7, 6;  3, 4, 8, 7;  7, 8, 10;  4, 1, 5, 8;  6, 7, 10, 9;  8, 5, 9, 10)
    -bc=[1, 2, 2, 3, 4, 4, 5, 6, 7];
solid ground = plane (0, 0, 0; 0, 0, -1);
solid left = plane (1, 0, 3; -1, 0, 1);
solid right = plane (1, 0, 3; 1, 0, 1);
solid gable = plane (0, 0, 0; 0, -1, 0);

tlo walls -layer=1 -material=brick;
boundaryconditionname ground walls floor;
boundarycondition left walls 9;
singular point left right gable -factor=2;
