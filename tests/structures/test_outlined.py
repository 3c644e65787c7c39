"""Sheets of any outline: what is clamped of them, their frequencies, and outlines that are none."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

from seatfem.structures.mesh.plane_meshes import mesh_sheet
from seatfem.structures.shapes import GeometryError, HeldDisc, Outlined, decode, encode
from seatfem.structures.shapes.loops import whole
from tests.solids import Material, Sheet, plate_modes

STEEL = Material(206e9, 0.3, 7800.0)
SQUARE = ((0.0, -5e-3), (10e-3, -5e-3), (10e-3, 5e-3), (0.0, 5e-3))
ROOT = ((0.0, -5e-3), (0.0, 5e-3))
PLATE = Outlined(SQUARE, 0.05e-3, (8e-3, 0.0), segment=ROOT)
ELL = ((0.0, 0.0), (20e-3, 0.0), (20e-3, 10e-3), (16e-3, 10e-3), (16e-3, 4e-3), (0.0, 4e-3))
HOOK = Outlined(ELL, 0.2e-3, (18e-3, 8e-3), side=(-1.0, 0.0, -2e-3))
YOUNG = (3.4917, 8.5246, 21.429, 27.331, 31.111)
"""lambda = w a^2 sqrt(rho h/D) of the square cantilever plate, nu = 0.3, by Ritz's method with beam functions, which is
up to 0.7 % high: D. Young, J. Appl. Mech. 17 (1950) 448."""


def frequencies(shape: Outlined, count: int = 5) -> np.ndarray:
    band = 8e3 * shape.thickness / 0.05e-3
    return plate_modes(Sheet(shape, STEEL, band)).modes.frequencies_hz[:count]


def turned(places: tuple[tuple[float, float], ...], angle: float) -> tuple[tuple[float, float], ...]:
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return tuple((float(x), float(y)) for x, y in np.array(places) @ turn + (3e-3, -7e-3))


def test_the_square_cantilever_plate() -> None:
    rigidity = STEEL.young * PLATE.thickness**3 / (12 * (1 - STEEL.poisson**2))
    scale = 2 * np.pi * 1e-4 * math.sqrt(STEEL.density * PLATE.thickness / rigidity)
    scaled = frequencies(PLATE) * scale
    assert (scaled < YOUNG).all()
    assert scaled == pytest.approx(YOUNG, rel=8e-3)


def test_it_may_lie_anywhere_and_run_either_way() -> None:
    angle = 0.7
    segment = turned(ROOT, angle)
    away = Outlined(turned(SQUARE[::-1], angle), 0.05e-3, turned(((8e-3, 0.0),), angle)[0], (segment[0], segment[1]))
    assert away.area == pytest.approx(PLATE.area)
    assert away.room == pytest.approx(PLATE.room)
    assert frequencies(away) == pytest.approx(frequencies(PLATE), rel=1e-3)
    assert decode(encode(away)) == away


@pytest.mark.slow
def test_beyond_a_line_all_is_clamped() -> None:
    """A sheet cut by the clamping line is the same as one whose edge lies on it."""
    longer = ((-4e-3, -5e-3), *SQUARE[1:3], (-4e-3, 5e-3))
    for outline in (SQUARE, longer):
        cut = Outlined(outline, 0.05e-3, (8e-3, 0.0), side=(-2.0, 0.0, 0.0))
        assert cut.area == pytest.approx(PLATE.area)
        assert frequencies(cut) == pytest.approx(frequencies(PLATE), rel=1e-6)
    assert HOOK.area == pytest.approx((18 * 4 + 4 * 6) * 1e-6)
    assert HOOK.narrowest == pytest.approx(4e-3)


SLOT = ((4e-3, -1e-3), (6e-3, -1e-3, 1.0), (6e-3, 1e-3), (4e-3, 1e-3, 1.0))  # round ends
DISC = ((10e-3, 0.0, 1.0), (-10e-3, 0.0, 1.0))


def test_a_line_cuts_arcs_exactly() -> None:
    """A disc cut at x = -r/2 has pi r^2 less the segment of 120 degrees; the hole beyond the cut is gone."""
    slots = tuple(tuple((x + off, *rest) for x, *rest in SLOT) for off in (-12.5e-3, -2e-3))
    cut = Outlined(DISC, 0.1e-3, (7e-3, 0.0), side=(-1.0, 0.0, 5e-3), holes=slots)
    lost = 1e-4 / 2 * (2 * math.pi / 3 - math.sin(2 * math.pi / 3))
    slot = 4e-6 + math.pi * 1e-6
    assert cut.area == pytest.approx(math.pi * 1e-4 - lost - slot, rel=1e-9)
    assert cut.room == pytest.approx((0.0, min(3e-3, 2e-3)))
    assert cut.narrowest == pytest.approx(5e-3, rel=1e-2)  # from the slot to the rim
    mesh = plate_modes(Sheet(cut, STEEL, 1e3)).mesh
    assert mesh.area == pytest.approx(cut.area, rel=2e-3)


@pytest.mark.parametrize(
    ("change", "mirrored"),
    [
        ({}, True),
        ({"holes": (SLOT,)}, True),
        ({"holes": (tuple((x, y + 1e-5, *rest) for x, y, *rest in SLOT),)}, False),
        ({"outline": (*SQUARE[:2], (10e-3, 5.00001e-3), SQUARE[3])}, False),
        ({"outline": (*SQUARE[:1], (10e-3, -5e-3, 0.1), *SQUARE[2:])}, True),
        ({"outline": ((0.0, -5e-3, 0.1), *SQUARE[1:])}, False),
        ({"segment": ((0.0, -5e-3), (0.0, 4e-3))}, False),
        ({"segment": ((0.0, -4e-3), (0.0, 4e-3))}, True),
    ],
)
def test_mirrored_sheets_have_mirrored_meshes(change: dict[str, object], mirrored: bool) -> None:
    """One half is meshed, the other is its image: every node has its own."""
    shape = replace(PLATE, **change)  # type: ignore[arg-type]
    assert shape.is_mirrored is mirrored
    points = mesh_sheet(shape, 0.7e-3).points
    order, image = (points[np.lexsort(each.round(9).T)] for each in (points, points * (1, -1)))
    assert np.array_equal(order, image * (1, -1)) is mirrored


BOW = ((0.0, 0.0), (10e-3, 10e-3), (10e-3, 0.0), (0.0, 10e-3))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"outline": SQUARE[:2]}, r"Outlined.outline = 2 points: 3.*1000 finite"),
        ({"outline": (*SQUARE, SQUARE[0])}, r"Outlined.outline = 5 points:.*5"),
        ({"outline": BOW}, r"Outlined.outline = 4 points:.*1.*3 meet"),
        ({"outline": ((0.0, 0.0), (9e-3, 0.0), (5e-3, 0.0), (5e-3, 5e-3))}, r"Outlined.outline = 4 .*:.*edges 1.*2"),
        ({"segment": None}, r"Outlined.clamped = None:"),
        ({"segment": ((1e-3, 0.0), (0.0, 5e-3))}, r"Outlined.clamped = \(0.001, 0\)"),
        ({"segment": ((0.0, 0.0), (10e-3, 0.0))}, r"Outlined.clamped =.*straight"),
        ({"segment": None, "side": (-1.0, 0.0, 1e-3)}, r"Outlined.clamped = .*:.*sheet"),
        ({"touched": (11e-3, 0.0)}, r"Outlined.contact_at = \(0.011, 0\)"),
        ({"holes": (((1e-3, 0.0), (2e-3, 0.0), (2e-3, 9e-3)),)}, r"Outlined.holes =.*1:.*outline"),
        ({"holes": (SLOT, SLOT[:3])}, r"Outlined.holes =.*2:.*(lies in|meets)"),
        ({"segment": None, "side": (-1.0, 0.0, -5e-3), "holes": (SLOT,)}, r"Outlined.holes =.*1:.*clamped.*50 %"),
        ({"thickness": 10e-3}, r"Outlined.thickness = 10 mm:.*< 10 mm \(its"),
    ],
)
def test_what_is_no_sheet_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        replace(PLATE, **change)  # type: ignore[arg-type]


def test_a_line_that_leaves_two_pieces_is_refused() -> None:
    legs = 4e-3 * np.array([(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)])
    with pytest.raises(GeometryError, match="leave one piece"):
        Outlined(tuple((float(x), float(y)) for x, y in legs), 0.1e-3, (2e-3, 7e-3), side=(0.0, -1.0, -6e-3))


WASHER = tuple((x, y, bulge) for x, y, bulge in whole((0.0, 0.0), 2.5e-3).tolist())
UMBRELLA = Outlined(DISC, 0.04e-3, (0.0, 0.0), holes=(WASHER,), hole=(0.0, 0.0))
"""Held at the edge of its hole of a quarter of its radius, free outside: an umbrella valve."""


def held_inside(k: float, n: int, ratio: float) -> float:
    """Return 0 where J, Y, I, K_n(k r/a) have a sum at rest and level at r = ratio a, and free at r = a.

    Source: Leissa, Vibration of Plates, NASA SP-160, section 2.2, w = (A J_n + B Y_n + C I_n + D K_n) cos n th.
    """
    nu, inner = STEEL.poisson, k * ratio
    rows = np.zeros((4, 4))
    for column, (value, slope, sign) in enumerate(((jv, jvp, -1), (yv, yvp, -1), (iv, ivp, 1), (kv, kvp, 1))):
        f, df = value(n, k), k * slope(n, k)
        rows[:2, column] = value(n, inner), k * slope(n, inner)
        rows[2, column] = sign * k**2 * f - (1 - nu) * (df - n**2 * f)
        rows[3, column] = sign * k**2 * df - (1 - nu) * n**2 * (df - f)
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    return float(np.linalg.det(rows / np.abs(rows).max(axis=0)))


@pytest.mark.slow
def test_a_disc_held_at_its_middle_converges_to_the_bessel_determinant() -> None:
    """The frequencies of n = 0, 1, 2 converge with order 2; at h/a = 0.004 shear takes 2e-4 at most."""
    rigidity = STEEL.young * UMBRELLA.thickness**3 / (12 * (1 - STEEL.poisson**2))
    scale = 2 * np.pi * 10e-3**2 * math.sqrt(STEEL.density * UMBRELLA.thickness / rigidity)
    exact = [brentq(lambda k, n=n: held_inside(k, n, 0.25), 1.2, 3.2) ** 2 for n in (1, 0, 2)]
    lowest = np.array(
        [plate_modes(Sheet(UMBRELLA, STEEL, 1e3, size)).modes.frequencies_hz[:5] for size in (2e-3, 1e-3, 0.5e-3)]
    )
    tilting, breathing, folded = (scale * lowest[:, k] for k in ([0, 1], [2], [3, 4]))
    for modes, root in zip((tilting, breathing, folded), exact, strict=True):
        assert modes[-1] == pytest.approx(root, rel=3e-4)
    coarse, middle, fine = breathing[:, 0]
    assert math.log2((coarse - middle) / (middle - fine)) == pytest.approx(2.0, abs=0.3)
    assert fine + (middle - fine) / -3 == pytest.approx(exact[1], rel=2e-4)


def test_a_drawn_disc_held_in_its_middle_is_that_of_its_outline() -> None:
    """The family and the same circles as corners have meshes of as many nodes, and the frequencies of these meshes."""
    family = HeldDisc(20e-3, 5e-3, UMBRELLA.thickness)
    drawn, outlined = mesh_sheet(family, 2e-3), mesh_sheet(UMBRELLA, 2e-3)
    assert len(drawn.lines["clamped"]) == len(outlined.lines["clamped"]) >= 16
    own, other = (plate_modes(Sheet(shape, STEEL, 1e3, 2e-3)).modes.frequencies_hz for shape in (family, UMBRELLA))
    assert own == pytest.approx(other, rel=2e-3)  # elements begin at other angles: pairs differ by 7e-4


def test_the_nodes_of_a_clamped_hole_are_those_of_its_edge() -> None:
    """A hole around the point, round or not, is clamped along its edge; the other one stays free."""
    square = ((5e-3, -1e-3), (7e-3, -1e-3), (7e-3, 1e-3), (5e-3, 1e-3))
    for point, held in (((1e-3, 1e-3), WASHER), ((2.5e-3, 0.0), WASHER), ((6.5e-3, 0.5e-3), square)):
        shape = replace(UMBRELLA, holes=(WASHER, square), hole=point)
        assert decode(encode(shape)) == shape
        mesh = mesh_sheet(shape, 1e-3)
        nodes = mesh.points[mesh.lines["clamped"]]
        away = np.hypot(*nodes.T) - 2.5e-3 if held is WASHER else np.abs(nodes - (6e-3, 0.0)).max(axis=1) - 1e-3
        assert np.abs(away).max() < 1e-8
        assert len(nodes) >= 16
    assert shape.is_mirrored
    assert not replace(shape, holes=(WASHER, square, ((0.0, 5e-3), (1e-3, 5e-3), (1e-3, 6e-3)))).is_mirrored
    with pytest.raises(GeometryError, match=r"Outlined.clamped = hole \(0, 0.004\) m: .*one of its holes"):
        replace(UMBRELLA, hole=(0.0, 4e-3))
    with pytest.raises(GeometryError, match="give one of segment, hole"):
        replace(PLATE, holes=(SLOT,), hole=(5e-3, 0.0))
