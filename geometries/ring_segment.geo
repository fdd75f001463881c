# A bent pipe: a segment of a torus, hollow.
algebraic3d

solid bend = torus (0, 0, 0; 0, 0, 1; 3; 1)
         and not torus (0, 0, 0; 0, 0, 1; 3; 0.6)
         and plane (0, 0, 0; 0, -1, 0)
         and plane (0, 0, 0; -1, 0, 0);

tlo bend;
