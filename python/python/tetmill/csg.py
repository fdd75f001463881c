"""Solids by constructive solid geometry.

    from tetmill.csg import Brick, Cylinder

    hole = Cylinder((1, 1, 0), (1, 1, 1), 0.4).bc("hole")
    plate = (Brick((0, 0, 0), (4, 2, 0.5)) - hole).named("steel")
    geometry = plate.geometry()

A solid is a set of points: `a | b` is the union of two, `a & b` their intersection (also `a * b`),
`a - b` the difference and `~a` the complement. `a + b` is the union, too. Solids are values: each
operation and each method returns a new one. `geo_text` writes them in the language of .geo files,
so the geometry is that of the file.

Planes, cylinders and cones are infinite, as in .geo files; a body must be bounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._geometry import Geometry

#: Three coordinates.
Vector = Sequence[float]

__all__ = [
    "Brick",
    "Box",
    "Cone",
    "Cylinder",
    "Ellipsoid",
    "EllipticCylinder",
    "Plane",
    "Solid",
    "Sphere",
    "Torus",
    "geo_text",
]


def _number(value: float) -> str:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"coordinates and lengths must be finite, not {value}")
    # The shortest decimal that reads back as the same number.
    return repr(number)


def _vector(value: Vector) -> str:
    if len(value) != 3:
        raise ValueError(f"expected three coordinates, not {value!r}")
    return ", ".join(map(_number, value))


def _word(name: str) -> str:
    """A name that the language can hold."""
    if not name or not name[0].isalpha() or not all(c.isalnum() or c == "_" for c in name):
        raise ValueError(f"the name {name!r} must be letters, digits and _, beginning with a letter")
    return name


@dataclass(frozen=True, eq=False)
class Solid:
    """A solid. Make one by the functions of this module.

    Two uses of one object have the same surfaces, so bodies made of it fit together.
    """

    _text: str
    #: The solids that stand for the `{}` of the text.
    _parts: tuple[Solid, ...] = ()
    _name: str | None = None
    _bc: str | int | None = None
    _maxh: float | None = None

    def _operation(self, other: Solid, text: str) -> Solid:
        if not isinstance(other, Solid):
            return NotImplemented
        return Solid(text, (self, other))

    def __or__(self, other: Solid) -> Solid:
        return self._operation(other, "{} or {}")

    def __add__(self, other: Solid) -> Solid:
        return self._operation(other, "{} or {}")

    def __and__(self, other: Solid) -> Solid:
        return self._operation(other, "{} and {}")

    def __mul__(self, other: Solid) -> Solid:
        return self._operation(other, "{} and {}")

    def __sub__(self, other: Solid) -> Solid:
        return self._operation(other, "{} and not {}")

    def __invert__(self) -> Solid:
        return Solid("not {}", (self,))

    def named(self, name: str) -> Solid:
        """The same solid with a name: that of the body, if it is one."""
        return replace(self, _name=_word(name))

    def bc(self, boundary: str | int) -> Solid:
        """The same solid with a name or number for those of its surfaces that have none yet."""
        if isinstance(boundary, str):
            return replace(self, _bc=_word(boundary))
        if isinstance(boundary, bool) or not isinstance(boundary, int) or boundary < 1:
            raise ValueError(f"a boundary has a name or a positive number, not {boundary!r}")
        return replace(self, _bc=boundary)

    def maxh(self, size: float) -> Solid:
        """The same solid with a largest element size on its surfaces, and inside if it is a body."""
        if not size > 0:
            raise ValueError(f"maxh cannot be {size}: expected a positive number")
        return replace(self, _maxh=float(size))

    def move(self, by: Vector) -> Solid:
        """The solid, moved. Boundaries and sizes that were set before are lost: set them after."""
        return Solid(f"translate ({_vector(by)}; {{}})", (self,))

    def rotate(self, angles: Vector, center: Vector = (0, 0, 0)) -> Solid:
        """The solid, turned about a point by three angles in radians, clockwise about z, x and z.

        Boundaries and sizes that were set before are lost: set them after.
        """
        return Solid(f"rotate ({_vector(center)}; {_vector(angles)}; {{}})", (self,))

    def geometry(self) -> Geometry:
        """The geometry with this solid as its only body."""
        from ._geometry import Geometry

        return Geometry.from_solids(self)


def _primitive(text: str, bc: str | int | None, maxh: float | None) -> Solid:
    solid = Solid(text)
    if bc is not None:
        solid = solid.bc(bc)
    return solid if maxh is None else solid.maxh(maxh)


def Plane(point: Vector, normal: Vector, *, bc: str | int | None = None, maxh: float | None = None) -> Solid:
    """A half-space; the normal points out of it."""
    return _primitive(f"plane ({_vector(point)}; {_vector(normal)})", bc, maxh)


def Sphere(center: Vector, radius: float, *, bc: str | int | None = None, maxh: float | None = None) -> Solid:
    """A ball."""
    return _primitive(f"sphere ({_vector(center)}; {_number(radius)})", bc, maxh)


def Cylinder(
    a: Vector, b: Vector, radius: float, *, bc: str | int | None = None, maxh: float | None = None
) -> Solid:
    """An infinite circular cylinder; `a` and `b` are on its axis."""
    return _primitive(f"cylinder ({_vector(a)}; {_vector(b)}; {_number(radius)})", bc, maxh)


def EllipticCylinder(
    a: Vector, v: Vector, w: Vector, *, bc: str | int | None = None, maxh: float | None = None
) -> Solid:
    """An infinite elliptic cylinder: a point on its axis, and the semi-axes of its section."""
    return _primitive(f"ellipticcylinder ({_vector(a)}; {_vector(v)}; {_vector(w)})", bc, maxh)


def Cone(
    a: Vector, ra: float, b: Vector, rb: float, *, bc: str | int | None = None, maxh: float | None = None
) -> Solid:
    """An infinite double cone, with the radius `ra` at the point `a` of its axis and `rb` at `b`."""
    return _primitive(f"cone ({_vector(a)}; {_number(ra)}; {_vector(b)}; {_number(rb)})", bc, maxh)


def Ellipsoid(
    center: Vector,
    u: Vector,
    v: Vector,
    w: Vector,
    *,
    bc: str | int | None = None,
    maxh: float | None = None,
) -> Solid:
    """An ellipsoid with its three semi-axes, which are at right angles."""
    return _primitive(f"ellipsoid ({_vector(center)}; {_vector(u)}; {_vector(v)}; {_vector(w)})", bc, maxh)


def Brick(a: Vector, b: Vector, *, bc: str | int | None = None, maxh: float | None = None) -> Solid:
    """A box along the axes between two opposite corners."""
    least, most = [min(p) for p in zip(a, b)], [max(p) for p in zip(a, b)]
    return _primitive(f"orthobrick ({_vector(least)}; {_vector(most)})", bc, maxh)


#: The same as `Brick`.
Box = Brick


def Torus(
    center: Vector,
    axis: Vector,
    R: float,
    r: float,
    *,
    bc: str | int | None = None,
    maxh: float | None = None,
) -> Solid:
    """A torus: the radius of its centre line, and that of the tube."""
    return _primitive(f"torus ({_vector(center)}; {_vector(axis)}; {_number(R)}; {_number(r)})", bc, maxh)


class _Writer:
    """Writes each solid once, as a statement after those of its parts."""

    def __init__(self, reserved: set[str]) -> None:
        self.lines: list[str] = []
        self._names: dict[int, str] = {}
        self._taken = reserved

    def _free_name(self, wanted: str | None) -> str:
        base = wanted or "s"
        name, count = (base, 1) if wanted else ("s1", 1)
        while name in self._taken:
            count += 1
            name = f"{base}{count}" if not wanted else f"{base}_{count}"
        self._taken.add(name)
        return name

    def name_of(self, solid: Solid) -> str:
        """The name of a solid, which is written at its first use."""
        stack = [solid]
        while stack:
            top = stack[-1]
            open_parts = [part for part in top._parts if id(part) not in self._names]
            if open_parts:
                stack.extend(reversed(open_parts))
                continue
            stack.pop()
            if id(top) not in self._names:
                self._write(top)
        return self._names[id(solid)]

    def _write(self, solid: Solid) -> None:
        parts = [self._names[id(part)] for part in solid._parts]
        name = self._free_name(solid._name)
        flags = "" if solid._maxh is None else f" -maxh={_number(solid._maxh)}"
        if solid._bc is not None:
            flags += f" -bcname={solid._bc}" if isinstance(solid._bc, str) else f" -bc={solid._bc}"
        self.lines.append(f"solid {name} = {solid._text.format(*parts)}{flags};")
        self._names[id(solid)] = name


def geo_text(*solids: Solid, boundaries: Iterable[tuple[Solid, Solid, str | int]] = ()) -> str:
    """The text of a .geo file with each of the solids as a body.

    Each of `boundaries` gives a name or number to all surfaces of its first solid where they bound
    its second one, a body.
    """
    if not solids:
        raise ValueError("a geometry needs a solid")
    for solid in solids:
        if not isinstance(solid, Solid):
            raise TypeError(f"expected a Solid, not {solid!r}")
    # The words of the language, none of which can be a name.
    writer = _Writer(set(_WORDS))
    names = [writer.name_of(solid) for solid in solids]
    bodies = []
    for solid, name in zip(solids, names):
        size = "" if solid._maxh is None else f" -maxh={_number(solid._maxh)}"
        material = f" -material={solid._name}" if solid._name else ""
        bodies.append(f"tlo {name}{material}{size};")
    conditions = []
    for surface, body, boundary in boundaries:
        if all(body is not solid for solid in solids):
            raise ValueError(f"the boundary {boundary!r} is set for a solid that is no body")
        flagged = surface.bc(boundary)._bc
        statement = "boundaryconditionname" if isinstance(flagged, str) else "boundarycondition"
        conditions.append(f"{statement} {writer.name_of(surface)} {writer.name_of(body)} {flagged};")
    return "\n".join(["algebraic3d", *writer.lines, *bodies, *conditions, ""])


_WORDS = frozenset(
    "algebraic3d and boundarycondition boundaryconditionname boundingbox closesurfaces cone constant curve2d curve3d "
    "cylinder define edge ellipsoid ellipticcone ellipticcylinder extrusion face gencyl identify multirotate "
    "multitranslate not or orthobrick periodic plane point polyhedron revolution rotate singular solid sphere tlo "
    "torus translate tube".split()
)
