"""Beam sections: the constants of a cross-section, in closed form for the usual shapes.

A section lies in the y'z' plane of its element, x' runs along the beam. Its axes are principal axes through the
centroid: the integral of y z over the section vanishes, and the shear centre is taken to be the centroid. The height h
of a shape is measured along y', its width b along z', so  Iz = integral of y^2 dA  belongs to bending in the x'y' plane.

Shapes know the shear stress at their outline: of torque by Saint-Venant, in hollow ones by Bredt, of transverse forces
by the elementary theory, Q S / (I b), tangential to the outline.

Sources: S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. (1970), art. 109 (torsion of a rectangle) and
112 (thin open sections); S. P. Timoshenko, Strength of Materials I, 3rd ed. (1955), ch. IV (shear of transverse forces);
G. R. Cowper, J. Appl. Mech. 33 (1966) 335-340 (shear factors, here for nu = 0); W. C. Young, R. G. Budynas,
Roark's Formulas for Stress and Strain, 7th ed. (2002), section 8.10 (shear of I-beams; shear factors from the energy);
EN 10210-2:2006, annex A (torsion of rectangular hollow sections).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

Point = tuple[float, float]
Polygon = tuple[Point, ...]
Shears = tuple[tuple[Point, Point, Point], ...]

_AROUND = 16
_SERIES = np.arange(1, 200, 2)


@dataclass(frozen=True)
class Section:
    """The constants of a cross-section.

    A           : area [m^2]
    Iy, Iz      : second moments, integrals of z^2 and of y^2 over the area [m^4]
    J           : torsion constant of Saint-Venant [m^4]; at most Iy + Iz, reached by round sections
    ky, kz      : shear factors along y' and z' [1]; math.inf makes the beam rigid in shear (Euler-Bernoulli)
    offset      : (y, z) of the centroid from the line through the nodes, in element axes [m]
    mass_moments: the second moments (Iy, Iz) that carry mass [m^4]; (Iy, Iz) when not given, which is the inertia of
                  the whole section: rotary, polar and, of the undeformed body, its extent across the axis
    outline     : convex polygons (y, z) that are drawn [m], counter-clockwise from y' to z'; a rectangle of the same
                  second moments when not given
    shear       : for each polygon and corner (tau_xy, tau_xz) of unit Qy, of unit Qz [1/m^2] and of unit Mx [1/m^3]; empty
                  where it is not known

    Raises InputError for constants that no section has.

    >>> section = fp.Section("channel", A=4e-4, Iy=2e-8, Iz=6e-8, J=1e-9)
    """

    name: str
    A: float
    Iy: float
    Iz: float
    J: float
    ky: float = math.inf
    kz: float = math.inf
    offset: Point = (0.0, 0.0)
    mass_moments: Point | None = None
    outline: tuple[Polygon, ...] = ()
    shear: tuple[Shears, ...] = ()

    def __post_init__(self) -> None:
        _check_constants(self)
        if self.mass_moments is None:
            object.__setattr__(self, "mass_moments", (self.Iy, self.Iz))
        if not self.outline:
            sides = (math.sqrt(12 * self.Iz / self.A), math.sqrt(12 * self.Iy / self.A))
            object.__setattr__(self, "outline", (_corners(*sides),))
        if [len(polygon) for polygon in self.outline] != [len(of) for of in self.shear]:
            object.__setattr__(self, "shear", ())  # not of this outline
        _check_mass_moments(self)

    @property
    def is_round(self) -> bool:
        """Whether every direction across the axis is like every other, so that no orientation is needed."""
        moments = self.mass_moments or (self.Iy, self.Iz)
        equal = math.isclose(self.Iy, self.Iz, rel_tol=1e-12) and math.isclose(*moments, rel_tol=1e-12)
        return equal and self.ky == self.kz and self.offset == (0.0, 0.0)


# ---- shapes -------------------------------------------------------------------------------------------------------


def rectangle(b: float, h: float) -> Section:
    """Solid rectangle, width b along z', height h along y' [m]; torsion by the series of Timoshenko and Goodier.

    Raises InputError for a width or height that is not positive.

    >>> section = fp.rectangle(0.02, 0.04)
    """
    name = f"rectangle {b:g} x {h:g} m"
    _check_lengths(name, b=b, h=h)
    short, long = sorted((b, h))
    terms = np.tanh(_SERIES * np.pi * long / (2 * short)) / _SERIES**5.0
    J = float(long * short**3 / 3 * (1 - 192 / np.pi**5 * short / long * terms.sum()))
    most = 1.5 / (b * h)
    shear = _shears(across=most, along=most, twisted=_twisted(h, b) / J)
    return Section(name, b * h, h * b**3 / 12, b * h**3 / 12, J, 5 / 6, 5 / 6, outline=(_sides(h, b),), shear=(shear,))


def circle(d: float) -> Section:
    """Solid circle of diameter d [m].

    Raises InputError for a diameter that is not positive.

    >>> section = fp.circle(0.02)
    """
    name = f"circle {d:g} m"
    _check_lengths(name, d=d)
    second = math.pi * d**4 / 64
    A = math.pi * d**2 / 4
    ring, shear = _ring(d / 2), _ring_shears(d / 2, 4 / (3 * A), 2 * second)
    return Section(name, A, second, second, 2 * second, 6 / 7, 6 / 7, outline=(ring,), shear=(shear,))


def tube(d: float, t: float) -> Section:
    """Round tube of outer diameter d and wall t [m]; drawn as a solid bar.

    Raises InputError for a wall that leaves no bore.

    >>> section = fp.tube(0.04, 0.002)
    """
    name = f"tube {d:g} x {t:g} m"
    _check_lengths(name, d=d, t=t)
    if 2 * t >= d:
        raise InputError(f"section {name}: the wall leaves no bore; t must be below {d / 2:g} m, or use circle(d)")
    bore = d - 2 * t
    second = math.pi * (d**4 - bore**4) / 64
    ratio = (bore / d) ** 2
    k = 6 * (1 + ratio) ** 2 / (7 * (1 + ratio) ** 2 + 20 * ratio)
    A = math.pi * (d**2 - bore**2) / 4
    most = 4 / (3 * A) * (d**2 + d * bore + bore**2) / (d**2 + bore**2)
    ring, shear = _ring(d / 2), _ring_shears(d / 2, most, 2 * second)
    return Section(name, A, second, second, 2 * second, k, k, outline=(ring,), shear=(shear,))


def box(b: float, h: float, t: float) -> Section:
    """Rectangular hollow section, width b along z', height h along y', wall t all round [m], sharp corners.

    Torsion by Bredt's cell along the mid line and the walls as strips, as in EN 10210-2: with A' = (b - t) (h - t) and
    s = 2 (b + h - 2 t) it is 4 A'^2 t / s + s t^3 / 3; solids with sharp corners all round have up to 5 % more. Shear
    factors are those of the energy of Q S / (I b), which become Cowper's for thin walls, and 5/6 as the bore of a square
    closes. What the sharp inner corners concentrate is left out of the stress.

    Raises InputError for lengths that are not positive, and for walls that leave no bore.

    >>> section = fp.box(0.08, 0.12, 0.005)
    """
    name = f"box {b:g} x {h:g} x {t:g} m"
    _check_lengths(name, b=b, h=h, t=t)
    if 2 * t >= min(b, h):
        raise InputError(
            f"section {name}: the walls leave no bore; t must be below {min(b, h) / 2:g} m, or use rectangle(b, h)"
        )
    A = 2 * t * (b + h - 2 * t)
    Iy, Iz = (_of_box(side, other, t) for side, other in ((h, b), (b, h)))
    around, cell = 2 * (b + h - 2 * t), (b - t) * (h - t)
    J = 4 * cell**2 * t / around + around * t**3 / 3
    walls = _box_walls(b, h, t, (Iy, Iz), (2 * cell / around / J, t / J))
    return Section(
        name,
        A,
        Iy,
        Iz,
        J,
        Iz**2 / (A * _box_energy(b, h, t)),
        Iy**2 / (A * _box_energy(h, b, t)),
        outline=tuple(outline for outline, _ in walls),
        shear=tuple(shear for _, shear in walls),
    )


def i_section(h: float, b: float, web: float, flange: float) -> Section:
    """Doubly symmetric I of height h (along y'), width b (along z'), web and flange thickness [m], sharp corners.

    Torsion as thin strips, the sum of s t^3 / 3; shear along y' is carried by the web, along z' by the flanges. The shear
    stress that transverse forces cause along the flanges on their way to the web is left out.

    Raises InputError unless 2 flange < h and web < b.

    >>> section = fp.i_section(0.2, 0.1, 5.6e-3, 8.5e-3)
    """
    name = f"I {h:g} x {b:g} x {web:g} x {flange:g} m"
    _check_lengths(name, h=h, b=b, web=web, flange=flange)
    if 2 * flange >= h or web >= b:
        raise InputError(f"section {name}: the flanges need 2 flange < h and web < b; use rectangle(b, h) for a solid")
    inner = h - 2 * flange
    A = 2 * b * flange + inner * web
    Iz = (b * h**3 - (b - web) * inner**3) / 12
    Iy = (2 * flange * b**3 + inner * web**3) / 12
    J = (2 * b * flange**3 + (h - flange) * web**3) / 3
    flanges = tuple(_sides(flange, b, side * (h - flange) / 2) for side in (-1, 1))
    of_flange = _shears(across=0.0, along=1.5 / (2 * b * flange), twisted=_twisted(flange, b) / J)
    at_flange = b * flange * (h - flange) / 2 / (Iz * web)
    of_web = _shears(
        across=at_flange + inner**2 / (8 * Iz), along=0.0, twisted=_twisted(inner, web) / J, ends=at_flange
    )
    return Section(
        name,
        A,
        Iy,
        Iz,
        J,
        inner * web / A,
        5 / 6 * 2 * b * flange / A,
        outline=(*flanges, _sides(inner, web)),
        shear=(of_flange, of_flange, of_web),
    )


def general(
    name: str, *, A: float, Iy: float, Iz: float, J: float, ky: float = math.inf, kz: float = math.inf
) -> Section:
    """A section by its constants (see Section); without shear factors it is rigid in shear.

    A : area [m^2];  Iy, Iz : second moments [m^4];  J : torsion constant [m^4];  ky, kz : shear factors [1]

    Raises InputError for constants that are not positive, and for J beyond Iy + Iz.

    >>> section = fp.general("rail", A=7.7e-3, Iy=3.0e-5, Iz=5.1e-6, J=2.2e-6)
    """
    return Section(name, A, Iy, Iz, J, ky, kz)


# ---- changes ------------------------------------------------------------------------------------------------------


def shear_rigid(section: Section) -> Section:
    """The section of an Euler-Bernoulli beam: no shear deformation.

    >>> section = fp.shear_rigid(fp.rectangle(0.02, 0.04))
    """
    return replace(section, ky=math.inf, kz=math.inf)


def shifted(section: Section, y: float, z: float) -> Section:
    """The section with its centroid at (y, z) from the line through the nodes, in element axes [m].

    >>> section = fp.shifted(fp.rectangle(0.02, 0.04), 0.0, 0.02)
    """
    return replace(section, offset=(float(y), float(z)))


def with_mass_moments(section: Section, Iy: float, Iz: float) -> Section:
    """The section with other second moments of the mass; (x, 0) with a small x leaves bending without rotary inertia.

    Iy, Iz : integrals of z^2 and of y^2 over what carries mass, in the measure of the area [m^4]

    >>> section = fp.with_mass_moments(fp.circle(0.02), 1e-8, 1e-8)
    """
    return replace(section, mass_moments=(float(Iy), float(Iz)))


# ---- shear stress at the outline ----------------------------------------------------------------------------------


def outline_shear(section: Section) -> tuple[Shears, ...]:
    """For each polygon and corner (tau_xy, tau_xz) of unit Qy, of unit Qz [1/m^2] and of unit Mx [1/m^3].

    A section that does not know it has none but that of the torque where it is round, J = Iy + Iz.
    """
    if section.shear:
        return section.shear
    turns = 1 / section.J if math.isclose(section.J, section.Iy + section.Iz, rel_tol=1e-9) else 0.0
    return tuple(
        tuple(((0.0, 0.0), (0.0, 0.0), (-z * turns, y * turns)) for y, z in polygon) for polygon in section.outline
    )


def _shears(*, across: float, along: float, twisted: Array, ends: float = 0.0) -> Shears:
    """The shear stress at the points of `_sides`.

    across  : tau_xy of unit Qy in the middle of the height [1/m^2];  ends : the same at its ends
    along   : tau_xz of unit Qz in the middle of the width [1/m^2], none at its ends
    twisted : of unit torque in the middle of the sides along y' and of those along z' [1/m^3]; corners carry none
    """
    along_y, along_z = (float(tau) for tau in twisted)
    return tuple(
        (
            (ends if y else across, 0.0),
            (0.0, 0.0 if z else along),
            (0.0 if y else -z * along_y, 0.0 if z else y * along_z),
        )
        for y, z in _sides(2.0, 2.0)
    )


def _twisted(h: float, b: float) -> Array:
    """(2,) shear stress in the middle of a rectangle's sides along y' (h) and along z' (b), of unit G theta [m]."""
    short, long = sorted((h, b))
    waves = _SERIES * np.pi * long / (2 * short)
    signs = np.where(_SERIES % 4 == 1, 1.0, -1.0)
    of_long = short * (1 - 8 / np.pi**2 * (1 / (_SERIES**2 * np.cosh(np.minimum(waves, 300.0)))).sum())
    of_short = 8 * short / np.pi**2 * (signs * np.tanh(waves) / _SERIES**2).sum()
    return np.array([of_long, of_short] if h >= b else [of_short, of_long])


def _ring_shears(radius: float, most: float, J: float) -> Shears:
    """At the points of `_ring`; most : shear stress of a unit force at the ends of the diameter across it [1/m^2]."""
    return tuple(
        ((most * s * s, -most * s * c), (-most * s * c, most * c * c), (-radius * s / J, radius * c / J))
        for c, s in _ring(1.0)
    )


def _of_box(b: float, h: float, t: float) -> float:
    """The integral of y^2 over a box [m^4]."""
    return (b * h**3 - (b - 2 * t) * (h - 2 * t) ** 3) / 12


def _box_energy(b: float, h: float, t: float) -> float:
    """The integral of (tau Iz)^2 over a box, of the shear stress Q S / (I b) of unit Qy [m^6].

    Flanges carry tau_xy over all their width and, between the webs, tau_xz = -y z / Iz on its way to the webs.
    """
    edge, inner, between = h / 2, h / 2 - t, b / 2 - t
    at_flange = b * (h - t) / 4
    up_flanges = b / 2 * (edge**4 * t - 2 * edge**2 * (edge**3 - inner**3) / 3 + (edge**5 - inner**5) / 5)
    along_flanges = t * (h - t) ** 2 * between**3 / 3
    webs = 4 * t * (at_flange**2 * inner + 2 / 3 * at_flange * inner**3 + 2 / 15 * inner**5)
    return up_flanges + along_flanges + webs


def _box_walls(b: float, h: float, t: float, second: Point, twisted: Point) -> list[tuple[Polygon, Shears]]:
    """The four walls of a box, mitred, and the shear at their corners and middles.

    second  : Iy, Iz [m^4];  twisted : what unit torque has in the middle of a wall and adds outside it [1/m^3]
    """
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    walls, turned = [], np.eye(2)
    for k in range(4):
        sizes = (h, b) if k % 2 else (b, h)
        outline, shear = _box_wall(*sizes, t, second[::-1] if k % 2 else second, twisted)
        forces = np.eye(3)
        forces[:2, :2] = turned
        shear = np.einsum("ij,pjs,ts->pit", forces, shear, turned)
        corners = tuple(_pair(point) for point in outline @ turned.T)
        walls.append((corners, tuple((_pair(of_y), _pair(of_z), _pair(of_x)) for of_y, of_z, of_x in shear)))
        turned = turn @ turned
    return walls


def _box_wall(b: float, h: float, t: float, second: Point, twisted: Point) -> tuple[Array, Array]:
    """(6, 2) the wall of a box at z > 0, from the middle of its outside on, and (6, 3, 2) shear of Qy, Qz and Mx there.

    The free outer corners carry no shear; the inner ones what flows past them.
    """
    (Iy, Iz), inner = second, h / 2 - t
    outline = np.array(
        [(0, b / 2), (-h / 2, b / 2), (-inner, b / 2 - t), (0, b / 2 - t), (inner, b / 2 - t), (h / 2, b / 2)]
    )
    at_flange = b * (h - t) / 4
    middle, corner = (at_flange + inner**2 / 2) / Iz, at_flange / Iz
    as_flange = inner * (b - t) / (2 * Iy)
    outside, inside = -(twisted[0] + twisted[1]), -(twisted[0] - twisted[1])
    shear = np.zeros((6, 3, 2))
    shear[[0, 2, 3, 4], :, 0] = [
        (middle, 0.0, outside),
        (corner, as_flange, inside),
        (middle, 0.0, inside),
        (corner, -as_flange, inside),
    ]
    return outline, shear


# ---- outlines and guards ------------------------------------------------------------------------------------------


def _corners(h: float, b: float, y: float = 0.0) -> Polygon:
    """The rectangle of height h and width b about (y, 0)."""
    return ((y - h / 2, -b / 2), (y + h / 2, -b / 2), (y + h / 2, b / 2), (y - h / 2, b / 2))


def _sides(h: float, b: float, y: float = 0.0) -> Polygon:
    """The same with the middle of each side, from where on a fan of triangles has none without area."""
    corners = np.array(_corners(h, b, y))
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    points = np.stack([middles, np.roll(corners, -1, axis=0)], axis=1).reshape(-1, 2)
    return tuple(_pair(point) for point in points)


def _pair(of: Array) -> Point:
    """Two numbers, a zero without its sign."""
    return float(of[0]) + 0.0, float(of[1]) + 0.0


def _ring(radius: float) -> Polygon:
    angles = 2 * math.pi * np.arange(_AROUND) / _AROUND
    return tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles)


def _check_lengths(name: str, **lengths: float) -> None:
    for symbol, value in lengths.items():
        if not 0 < value < math.inf:
            raise InputError(f"section {name}: {symbol} is {value:g} m; it must be positive")


def _check_constants(section: Section) -> None:
    for symbol, unit in (("A", "m^2"), ("Iy", "m^4"), ("Iz", "m^4"), ("J", "m^4")):
        value = getattr(section, symbol)
        if not 0 < value < math.inf:
            raise InputError(f"section {section.name!r}: {symbol} is {value:g} {unit}; it must be positive")
    for symbol in ("ky", "kz"):
        if not getattr(section, symbol) > 0:
            raise InputError(
                f"section {section.name!r}: shear factor {symbol} is {getattr(section, symbol):g}; it must be positive, "
                "math.inf for no shear deformation"
            )
    most = (1 + 1e-9) * (section.Iy + section.Iz)
    if most < section.J:
        raise InputError(
            f"section {section.name!r}: J is {section.J:g} m^4, but no section has more than Iy + Iz = "
            f"{section.Iy + section.Iz:g} m^4; check the units of all three"
        )
    if np.shape(section.offset) != (2,) or not np.isfinite(section.offset).all():
        raise InputError(f"section {section.name!r}: offset is {section.offset}; it must be two finite lengths (y, z)")


def _check_mass_moments(section: Section) -> None:
    moments = np.asarray(section.mass_moments, float)
    if moments.shape != (2,) or not np.isfinite(moments).all() or moments.min() < 0 or moments.max() == 0:
        raise InputError(
            f"section {section.name!r}: mass moments are {section.mass_moments}; they must be two numbers of m^4, none "
            "negative and not both zero, as torsion needs inertia"
        )
