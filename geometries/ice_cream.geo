# A ball on a cone frustum, tangent along the rim: cut by no plane but the frustum's. The radius is rounded to nine digits.
# Volume 7/6 pi + pi h^2 (R - h/3), R = 0.515388203, h = R - 0.125.
algebraic3d

solid horn = cone (0, 0, 0; 1; 0, 0, 2; 0.5) and plane (0, 0, 0; 0, 0, -1) and plane (0, 0, 2; 0, 0, 1);
solid ice = horn or sphere (0, 0, 1.875; 0.515388203);
tlo ice;
