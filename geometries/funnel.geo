# An elliptic funnel: an elliptic cone cut off at both ends, on an elliptic pipe.
algebraic3d

solid funnel = ellipticcone (0, 0, 0; 2, 0, 0; 0, 1.2, 0; 3; 0.5)
           and plane (0, 0, 0; 0, 0, -1)
           and plane (0, 0, 3; 0, 0, 1);
solid pipe = ellipticcylinder (0, 0, 0; 0.8, 0, 0; 0, 0.5, 0)
         and plane (0, 0, 2.5; 0, 0, -1)
         and plane (0, 0, 5; 0, 0, 1);
solid all = funnel or pipe;

tlo all;
