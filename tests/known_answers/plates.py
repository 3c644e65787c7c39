"""Thin plates as three-dimensional solids: NAFEMS FV12 and FV32, round and annular plates."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.model import Array, Material, SecondOrderModel
from seatfem.structures.reduction.modes import solve_modes
from seatfem.verify import Case

from .grids import Where, box, hold, plane, section
from .limits import converged, small_limit

_NAFEMS = "NAFEMS, Selected Benchmarks for Natural Frequency Analysis"
_LEISSA = "Leissa, Vibration of Plates, NASA SP-160 (Bessel determinant)"
_POISSON, _YOUNG, _DENSITY = 0.3, 200e9, 8000.0
_RITZ = 1e-4  # relative accuracy of the Ritz values of FV12
_SQUARE_MESH = {7.356: 9e-4}  # error of the mesh left: 5/4 of what 1.5 times the elements change; the others 3e-4
_ROUND_MESH = 2e-5  # what halved elements change
_MEMBRANE = 2e-4  # relative accuracy of the finite element values of FV32

# symmetry about the two middle lines, rigid modes of that class: frequencies [Hz]
_FV12 = {("A", "A", 0): (1.62165,), ("S", "S", 1): (2.3595, 2.92228, 7.6682), ("S", "A", 1): (4.19024, 7.356)}
_WIDE = {1: 6, 2: 8, 4: 12, 8: 16}  # elements from the middle to the edge rows, by 0.8 m/h
_FV32 = (44.6172, 130.01, 162.689, 245.9865, 379.7177, 391.4048)
# outer edge, inner edge, radius of the hole: lambda^2 of the lowest modes with n = 0, 1, 2, 3 nodal diameters
_ROUND: dict[tuple[str, str, float], tuple[tuple[float, ...], ...]] = {
    ("C", "", 0.0): (
        (10.215826, 39.771148, 89.104144),
        (21.260398, 60.828672, 120.079237),
        (34.877035, 84.58265, 153.815085),
        (51.030035, 111.021412, 190.30378),
    ),
    ("S", "", 0.0): (
        (4.935149, 29.720005, 74.156055),
        (13.898165, 48.478928, 102.773346),
        (25.613297, 70.117038, 134.297824),
        (39.957314, 94.548978, 168.674917),
    ),
    ("F", "F", 0.5): ((9.313481, 92.307936), (17.198225, 96.265991), (4.271114, 31.114801), (11.42544, 47.462186)),
    ("C", "C", 0.5): ((89.250751, 246.342764), (90.230269, 247.739589), (93.3212, 251.972639), (98.927991, 259.162907)),
    ("S", "F", 0.5): ((5.076871, 65.841772), (11.607321, 69.89052), (22.356569, 81.100353), (35.635714, 97.64851)),
}
_EDGES = {"C": "clamped", "S": "simply supported", "F": "free"}


def plate_cases() -> tuple[Case, ...]:
    """Thin plates as three-dimensional solids: NAFEMS FV12 and FV32, round and annular plates.

    Kirchhoff's frequencies as limits for small thickness; a membrane in plane stress.
    """
    squares = tuple(case for key in _FV12 for case in _square(*key))
    rounds = tuple(case for edges in _ROUND for n in range(4) for case in _round(*edges, n))
    return (*squares, *_membrane(), *rounds)


def _square(about_x: str, about_y: str, rigid: int) -> tuple[Case, ...]:
    """Return the cases of FV12: a quarter of the free square plate, above its middle plane, on which bending moves
    nothing in plane.

    The frequencies are those of h = 0.05 m if f ~ h: Kirchhoff's plate is the limit of f 0.05 m/h for h to 0. The
    error is a series in h, as free edges twist like a body over a distance h; so the mesh has two narrow rows there.
    """
    exact = _FV12[about_x, about_y, rigid]

    def solve(n: int, young: float) -> Sequence[float]:
        thickness = 0.8 / n
        wide = np.linspace(0.0, 5.0 - 1.5 * thickness, _WIDE[n] + 1)
        x = np.concatenate([wide, [5.0 - 0.5 * thickness, 5.0]])
        mesh = box(x, x, np.array([0.0, thickness / 2]))
        symmetric = [f"{axis}0" for axis, kind in (("x", about_x), ("y", about_y)) if kind == "S"]
        material = Material(_YOUNG * young, _POISSON, _DENSITY)
        whole = assemble(mesh, material, fixed=(), sliding=symmetric, ports={}, order=2)
        held: list[tuple[tuple[int, ...], Where]] = [((0, 1), plane(2, 0.0))]
        held += [((1, 2), plane(0, 0.0))] if about_x == "A" else []
        held += [((0, 2), plane(1, 0.0))] if about_y == "A" else []
        scale = thickness / 0.05
        modes = solve_modes(hold(whole, *held), rigid + len(exact), shift_hz=2.0 * scale)
        return tuple(modes.frequencies_hz[rigid:] / scale)

    limit = small_limit(solve)
    kind = {"A": "antisymmetric", "S": "symmetric"}
    name = f"free square plate (FV12), {kind[about_x]} about x, {kind[about_y]} about y, thin"
    rtol = [_RITZ + _SQUARE_MESH.get(value, 3e-4) for value in exact]
    return tuple(Case(name, f"f = {value:g} Hz", value, rtol[i], _NAFEMS, limit(i)) for i, value in enumerate(exact))


def _membrane() -> tuple[Case, ...]:
    """Return the cases of FV32: half the thickness, one layer; the root is free across the plate: plane stress.

    At the root's corners (78.7 degrees, clamped and free) the stress is singular like r^-0.17: modes that load them
    converge with the order 1.7, the others with up to 4. The limit is taken with order 2, which brackets it.
    """

    def solve(n: int, young: float) -> Sequence[float]:
        flat = skfem.MeshHex.init_tensor(np.linspace(0, 10, 2 * n + 1), np.linspace(-1, 1, n + 1), np.array([0, 0.025]))
        points = flat.p * np.stack([np.ones_like(flat.p[0]), 2.5 - 0.2 * flat.p[0], np.ones_like(flat.p[0])])
        mesh = skfem.MeshHex(points, flat.t).with_boundaries({"middle": plane(2, 0.0)})
        material = Material(_YOUNG * young, _POISSON, _DENSITY)
        whole = assemble(mesh, material, fixed=(), sliding="middle", ports={}, order=2)
        model = hold(whole, ((0, 1), plane(0, 0.0)))
        return tuple(solve_modes(model, 6, shift_hz=50.0).frequencies_hz)

    limit = converged(solve, 3, 2)
    name = "tapered membrane (FV32), plane stress"
    return tuple(Case(name, f"f_{i + 1} [Hz]", f, _MEMBRANE, _NAFEMS, limit(i)) for i, f in enumerate(_FV32))


def _round(outer: str, inner: str, hole: float, harmonic: int) -> tuple[Case, ...]:
    """Return the cases of lambda^2 = w a^2 (rho h/D)^(1/2), a = E = rho = 1: the limit for h to 0."""
    exact = _ROUND[outer, inner, hole][harmonic]
    thickest = 0.02 if outer == inner == "C" else 0.04  # the narrow ring is stiff: shear and edges count more

    def solve(n: int, young: float) -> Sequence[float]:
        h = thickest / n
        model = _bending(outer, inner, hole, h, harmonic, young)
        unit = h / math.sqrt(12 * (1 - _POISSON**2))  # w/lambda^2
        modes = solve_modes(model, len(exact) + 2, shift_hz=unit * 100.0 / (2 * math.pi))
        values = modes.omega / unit
        return tuple(values[values > 1.0][: len(exact)])

    limit = small_limit(solve)
    edges = (
        f"{_EDGES[outer]} plate"
        if not inner
        else f"ring, b/a = {hole:g}, {_EDGES[outer]} outside, {_EDGES[inner]} inside"
    )
    name = f"round {edges}, thin"
    quantity = "lambda^2, {} nodal diameters, mode {}".format
    return tuple(
        Case(name, quantity(harmonic, s + 1), value, _ROUND_MESH, _LEISSA, limit(s)) for s, value in enumerate(exact)
    )


def _bending(outer: str, inner: str, hole: float, h: float, harmonic: int, young: float) -> SecondOrderModel:
    """Return the model of the upper half; at an edge S the displacement along it and across the plate is held."""
    model = assemble_axisymmetric(
        section(_radii(hole, h), np.array([0.0, h / 2])), Material(young, _POISSON, 1.0), harmonic=harmonic, fixed=(),
        ports={}, order=2,
    )  # fmt: skip
    held: list[tuple[tuple[int, ...], Where]] = [((0, 1), plane(2, 0.0))]
    components = {"C": (0, 1, 2), "S": (1, 2)}
    edges = ((outer, 1.0), (inner, hole))
    held += [(components[kind], plane(0, radius)) for kind, radius in edges if kind in components]
    return hold(model, *held)


def _radii(hole: float, h: float) -> Array:
    """Return the radii of elements of width h, narrower where the edges disturb the plate's stresses."""
    near = h * np.array([0.12, 0.4, 1.0])
    middle = np.linspace(hole + (h if hole else 0.0), 1.0 - h, max(2, round(0.96 * (1 - hole) / h)))
    inside = [hole, *(hole + near[:2])] if hole else []
    return np.array([*inside, *middle, *(1.0 - near[1::-1]), 1.0])
