"""Lips in arcs: their patches on a plate, how their ports are called, and a half-space under them."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from impact.exact.half_space import disk_compliance
from seatfem.structures.inspection.mesh_file import land_of_mesh
from seatfem.structures.lands import FaceLip, Land, land_of
from seatfem.structures.patch import arc_compliance, divide_in_arcs
from seatfem.structures.rings import (
    MOST_PORTS,
    Division,
    divided_less,
    find_fewer_arcs,
    join_all_parts,
    parts_joined,
    ring_shares,
)
from tests.solids import CadPart, inspect_geometry
from tests.steps import GreensFunctionError, Lip, ModalGreens, ModelError, Residual

LIP = Lip(5.5e-3, 1e-3, arcs=12)
E, NU = 200e9, 0.3


def mean(patch, of):
    x, y = patch.points.T
    return float(patch.weights @ of(x, y) / patch.weights.sum())


def division_greens(division: Division) -> ModalGreens:
    """Return ports of a division that answer each in its own way."""
    count = len(division.names)
    root = np.random.default_rng(count).normal(size=(count, count))
    rest = Residual.spring(root @ root.T)
    return ModalGreens(np.array([3.0]), np.array([0.1]), root[:1], rest, division.names)


@pytest.mark.parametrize(
    "lip", [LIP, Lip(5.5e-3, 1e-3, 5, 3), Lip(2e-3, 4e-3, 6), Lip.disc(3e-3), Lip(4e-3, 1e-3, 256)]
)
def test_the_parts_of_a_lip_have_its_area(lip: Lip) -> None:
    """The rule is exact for rings: round-off alone."""
    patches = lip.patches((20e-3, 1e-3))
    assert tuple(patches) == lip.division.names
    areas = np.array([patch.weights.sum() for patch in patches.values()])
    np.testing.assert_allclose(areas, lip.area * lip.division.shares, rtol=1e-12)
    assert lip.area == pytest.approx(math.pi * (lip.outer**2 - lip.inner**2), rel=1e-12)
    assert min(patch.weights.min() for patch in patches.values()) > 0


def test_means_over_arcs_have_their_closed_forms() -> None:
    """Means over an arc of half angle a about t are M (1 + s cos 2t)/2 for x^2, M s sin(2t)/2 for x y and N sin(a)/a
    cos t for x, s = sin(2 a)/(2 a), M and N the means of r^2 and r; 8 midpoints an arc of 30 degrees leave (a/8)^2/6,
    2e-4."""
    second = (LIP.outer**2 + LIP.inner**2) / 2
    first = 2 / 3 * (LIP.outer**3 - LIP.inner**3) / (LIP.outer**2 - LIP.inner**2)
    a = math.pi / LIP.arcs
    s = math.sin(2 * a) / (2 * a)
    patches = LIP.patches((0.0, 0.0)).values()
    for t, patch in zip(LIP.angles, patches, strict=True):
        close = {"abs": 1e-3 * second}
        assert mean(patch, lambda x, y: x * x) == pytest.approx(second * (1 + s * math.cos(2 * t)) / 2, **close)
        assert mean(patch, lambda x, y: x * y) == pytest.approx(second * s * math.sin(2 * t) / 2, **close)
        assert mean(patch, lambda x, y: x) == pytest.approx(first * math.sin(a) / a * math.cos(t), abs=1e-3 * first)
    assert LIP.angles[0] == pytest.approx(a, rel=1e-14)  # the first one begins on the axis


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((5e-3, 0.0), "0 mm.*positive.*10 mm"),
        ((5e-3, 10.1e-3), "10.1 mm.*positive"),
        ((math.nan, 1e-3), "mean radius nan mm"),
        ((5e-3, 1e-3, 0), "0 segments.*1.*1"),
        ((5e-3, 1e-3, MOST_PORTS // 2 + 1, 2), "2049 segments.*2 rings: .*fewer contact.ports"),
        ((5e-3, 1e-3, -4, -4), "-4 segments by -4 rings"),
    ],
)
def test_lips_that_cannot_be(given: tuple[float, ...], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        Lip(*given)  # type: ignore[arg-type]


@pytest.mark.parametrize(("arcs", "rings"), [(1, 1), (1, 4), (3, 2), (256, 1)])
def test_ports_tell_the_division(arcs: int, rings: int) -> None:
    division = Division(arcs, rings)
    assert len(set(division.names)) == len(division.names) == arcs * rings
    assert Division.from_greens(division_greens(division)) == division
    assert division.shares.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    "names", [("left", "right"), ("arc_1", "arc_3"), ("arc_2",), ("contact_1",), ("arc_x", "arc_2")]
)
def test_other_ports_are_no_division(names: tuple[str, ...]) -> None:
    greens = ModalGreens(
        np.zeros(0), np.zeros(0), np.zeros((0, len(names))), Residual.spring(np.eye(len(names))), names
    )
    assert Division.from_greens(greens) == Division()


def test_fewer_parts_are_means_of_more() -> None:
    """Fewer parts are the means by hand of more, in one step or in two, also behind another port."""
    there = Division(12, 2)
    greens = division_greens(there)
    static = greens.static_compliance()
    pairs = divided_less(greens, Division(6, 2)).static_compliance()
    by_hand = static.reshape(6, 2, 2, 6, 2, 2).mean(axis=(1, 4)).reshape(12, 12)
    np.testing.assert_allclose(pairs, by_hand, rtol=1e-12, atol=1e-12 * np.abs(static).max())
    shares = there.shares
    assert join_all_parts(greens).static_compliance()[0, 0] == pytest.approx(shares @ static @ shares, rel=1e-12)
    steps = divided_less(divided_less(greens, Division(6, 2)), Division(3, 1)).static_compliance()
    np.testing.assert_allclose(divided_less(greens, Division(3)).static_compliance(), steps, rtol=1e-10)
    np.testing.assert_allclose(ring_shares(2), 0.5, rtol=1e-15)
    with pytest.raises(GreensFunctionError, match=r"contact\.ports = 5: .*12.*divisor"):
        divided_less(greens, Division(5, 2))

    less = Division(6, 2)
    own = ModalGreens(greens.omega, greens.zeta, greens.shapes, greens.residual, ("contact", *there.names[1:]))
    assert parts_joined(own, there, less) is own  # its ports are other ones
    before = greens.combined(np.eye(24)[:, [5, *range(24)]], ("contact", *there.names))
    joined = parts_joined(before, there, less)
    assert joined.ports == ("contact", *Division(6, 2).names)
    np.testing.assert_allclose(joined.static_compliance()[1:, 1:], by_hand, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        joined.static_compliance()[0, 1:], static[5].reshape(6, 2, 2).mean(axis=1).ravel(), rtol=1e-12
    )


@pytest.mark.parametrize("arcs", [3, 8])
def test_a_whole_disc_on_a_half_space(arcs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The mean of the compliances of its arcs is 16 (1 - nu^2)/(3 pi^2 E a), with ever more cells: at least order one,
    for the largest cell, the innermost, is never square."""
    exact = disk_compliance(young=E, poisson=NU, radius=3e-3)
    errors = []
    for cells in (2, 4, 8, 16):
        monkeypatch.setattr("seatfem.structures.patch.CELLS", cells)
        errors.append(abs(arc_compliance(Lip(1.5e-3, 3e-3, arcs), E, NU).mean() / exact - 1))
    assert all(fine < coarse / 2 for coarse, fine in itertools.pairwise(errors))
    assert errors[-1] < 2e-3


def test_a_known_body_keeps_its_own_answer_in_arcs() -> None:
    """The body as a whole moves as before; each part begins with 1/(rho c_p A_i), alone."""
    whole = ModalGreens(
        np.array([1e5, 3e5]), np.array([0.01, 0.02]), np.array([[4.0], [7.0]]),
        Residual.exponential(np.array([[1e-10]]), np.array([[1 / 1500.0]])), ("contact",),
    )  # fmt: skip
    lip, impedance = Lip(5.5e-3, 1e-3, 8, 2), 1500.0
    greens = divide_in_arcs(whole, lip, E, NU, impedance)
    t = np.linspace(0, 2e-4, 60)
    np.testing.assert_allclose(
        join_all_parts(greens).filtered(t, 1e-5), whole.filtered(t, 1e-5), rtol=1e-9, atol=1e-9 * 1e-3
    )
    shares = lip.division.shares
    assert join_all_parts(greens).static_compliance()[0, 0] == pytest.approx(whole.static_compliance()[0, 0], rel=1e-9)
    local = greens.static_compliance() - whole.static_compliance()
    np.testing.assert_allclose(local @ shares, 0.0, atol=1e-9 * np.abs(local).max())
    half = arc_compliance(lip, E, NU)
    apart = np.zeros(16)
    apart[0], apart[8] = 1.0, -1.0  # what is pushed here and pulled there does not move the whole
    assert apart @ local @ apart == pytest.approx(apart @ half @ apart, rel=1e-9)
    np.testing.assert_allclose(greens.initial_value(), np.diag(1 / (shares * impedance)), atol=1e-9 / impedance)


MESHES = Path(__file__).parents[2] / "meshes"
CORNERS = 720
STRAIGHT, ROUND, WIDTH = 5e-3, 3e-3, 1e-3  # of a racetrack: straight sides, radius of its centre line, width


def closed(points: np.ndarray) -> np.ndarray:
    """Return (e, 2, 3) edges of a polygon (c, 2) or (c, 3)."""
    raised = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    return np.stack([raised, np.roll(raised, -1, axis=0)], axis=1)


def circle(radius: float, x: float = 0.0, corners: int = CORNERS) -> np.ndarray:
    turns = 2 * np.pi * (np.arange(corners) + 0.3) / corners
    return np.column_stack([x + radius * np.cos(turns), radius * np.sin(turns)])


def racetrack(radius: float, corners: int = CORNERS) -> np.ndarray:
    turns = np.pi * (np.linspace(0, 1, corners // 2) - 0.5)
    end = np.column_stack([STRAIGHT / 2 + radius * np.cos(turns), radius * np.sin(turns)])
    return np.concatenate([end, -end])


def face(inner: np.ndarray, outer: np.ndarray, normal: tuple[float, float, float] = (0, 0, 1)) -> Land:
    edges = np.concatenate([closed(outer)[::-1], closed(inner)])
    return land_of(np.random.default_rng(1).permutation(edges), normal)  # in any order


ROUND_FACE = face(circle(5e-3), circle(6e-3))
SLOT = face(racetrack(ROUND - WIDTH / 2), racetrack(ROUND + WIDTH / 2))


@pytest.mark.parametrize(("arcs", "rings"), [(1, 1), (12, 1), (5, 3)])
def test_a_circle_is_a_lip(arcs: int, rings: int) -> None:
    """A circular face has the ports, angles, patches and lengths of a lip; 720 corners leave 1.3e-5 of the area."""
    lip, reference = FaceLip(ROUND_FACE, arcs, rings), Lip(5.5e-3, 1e-3, arcs, rings)
    assert lip.division == reference.division
    np.testing.assert_allclose(lip.edges, reference.edges, atol=1e-6)
    np.testing.assert_allclose(lip.lengths, reference.lengths, rtol=2e-5)
    assert (lip.inner, lip.outer) == pytest.approx((reference.inner, reference.outer), rel=2e-5)
    mine, right = lip.patches((1e-3, 2e-3)), reference.patches((1e-3, 2e-3))
    for name, patch in right.items():
        np.testing.assert_allclose(mine[name].points, patch.points, atol=2e-5 * reference.outer)
        np.testing.assert_allclose(mine[name].weights, patch.weights, rtol=3e-4)  # over a width of a fifth of r


@pytest.mark.parametrize(("arcs", "rings"), [(1, 3), (8, 1), (48, 3)])
def test_a_racetrack_has_equal_arcs_along_its_centre_line(arcs: int, rings: int) -> None:
    """A band of even width has as area its width times its length, in every arc but for where rays cut it aslant across
    the joint of its straight sides and round ends."""
    lip = FaceLip(SLOT, arcs, rings)
    length = 2 * STRAIGHT + 2 * math.pi * ROUND
    assert lip.area == pytest.approx(WIDTH * length, rel=2e-5)
    assert lip.length == pytest.approx(length, rel=2e-3)  # half way along rays is not half way across
    np.testing.assert_allclose(lip.lengths, length / arcs, rtol=0.02)
    areas = np.array([patch.weights.sum() for patch in lip.patches((0.0, 0.0)).values()])
    np.testing.assert_allclose(areas, lip.area * lip.division.shares, rtol=1e-12)
    middle = sum(patch.weights @ patch.points for patch in lip.patches((3e-3, -1e-3)).values()) / lip.area
    np.testing.assert_allclose(middle, (3e-3, -1e-3), atol=1e-9)


def test_an_eccentric_ring_is_seen_from_its_centroid() -> None:
    """The centroid between circles R and r, the inner one off by e, is at -e r^2/(R^2 - r^2); arcs of equal areas are
    long where it is narrow."""
    off = 0.2e-3
    lip = FaceLip(face(circle(5e-3, off), circle(6e-3)), 16)
    assert lip.face.centre == pytest.approx((-off * 25 / 11, 0, 0), abs=1e-9)
    assert lip.area == pytest.approx(math.pi * 11e-6, rel=2e-5)
    longest, shortest = lip.lengths.max(), lip.lengths.min()
    assert longest / shortest == pytest.approx(1.2 / 0.8, rel=0.05)  # as the widths on either side, at a distance
    assert int(np.argmax(lip.lengths)) in (0, 15)
    weights = np.array([patch.weights.sum() for patch in lip.patches((0.0, 0.0)).values()])
    np.testing.assert_allclose(weights, lip.area / 16, rtol=1e-12)


def test_places_are_shares_of_the_area() -> None:
    """Places on a ring are its angle and, across, (r^2 - a^2)/(b^2 - a^2); cuts lead back to them."""
    lip, turns, radii = FaceLip(ROUND_FACE, 8), np.array([0.1, 2.0, 5.9]), np.array([5.1e-3, 5.5e-3, 5.9e-3])
    points = np.column_stack([radii * np.cos(turns), radii * np.sin(turns), np.zeros(3)])
    around, across, _ = lip.places(points)
    np.testing.assert_allclose(around, turns / (2 * np.pi), atol=1e-6)
    np.testing.assert_allclose(across, (radii**2 - 25e-6) / 11e-6, atol=2e-4)
    left, right = lip.cuts(shares := np.linspace(0.01, 0.99, 7))
    middles = lip.places(np.column_stack([(left + right) / 2, np.zeros(7)]))[0]
    np.testing.assert_allclose(middles, shares, atol=1e-9)


@pytest.mark.parametrize(
    ("normal", "x", "y"),
    [
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -2), (1, 0, 0), (0, -1, 0)),
        ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ],
)
def test_angles_count_anticlockwise_about_the_normal(normal: tuple, x: tuple, y: tuple) -> None:
    """Angles count from the body's x axis, or from its y axis if x is the normal."""
    at = np.array([1e-3, 2e-3, 3e-3])
    edges = np.concatenate([closed(circle(radius) @ np.array([x, y]) + at) for radius in (2e-3, 3e-3)])
    land = land_of(edges, normal)
    np.testing.assert_allclose((land.x, land.y), (x, y), atol=1e-12)
    np.testing.assert_allclose(land.centre, at, atol=1e-9)


def test_a_half_space_under_a_face_is_that_under_a_lip() -> None:
    """A circular face has the lip's compliance; a racetrack's arc has that of a ring as long, 3.4 % less where rays cut
    it aslant by 40 degrees; as a whole it is a little softer than the ring, whose parts lie farther apart."""
    for arcs, rings in ((16, 1), (6, 2)):
        mine = arc_compliance(FaceLip(ROUND_FACE, arcs, rings), 200e9, 0.3)
        right = arc_compliance(Lip(5.5e-3, 1e-3, arcs, rings), 200e9, 0.3)
        np.testing.assert_allclose(mine, right, rtol=1e-3)
    slot = arc_compliance(FaceLip(SLOT, 32), 200e9, 0.3)
    ring = arc_compliance(Lip(SLOT_LENGTH / (2 * math.pi), WIDTH, 32), 200e9, 0.3)
    assert np.diag(slot).max() == pytest.approx(ring[0, 0], rel=2e-3)
    np.testing.assert_allclose(np.diag(slot), ring[0, 0], rtol=0.04)
    assert 1.0 < slot.mean() / ring.mean() < 1.05
    np.testing.assert_allclose(slot, slot[::-1, ::-1], rtol=1e-6)  # summed in single precision


SLOT_LENGTH = 2 * STRAIGHT + 2 * math.pi * ROUND


@pytest.mark.slow
def test_the_face_of_a_drawing_and_of_a_mesh() -> None:
    """Chords of 1/96 and of elements, about sixteen around the inner edge, take away from the circles."""
    from seatfem.structures.formats.mesh_files import read_mesh

    slot = FaceLip(inspect_geometry(CadPart(MESHES / "slot_seat.step")).land("contact"), 8)
    assert slot.area == pytest.approx(WIDTH * SLOT_LENGTH, rel=1e-3)
    assert slot.face.centre == pytest.approx((0, 0, 7e-3), abs=1e-8)
    assert slot.face.y == pytest.approx((0, 1, 0), abs=1e-12)
    drawn = FaceLip(inspect_geometry(CadPart(MESHES / "annular_seat.step")).land("contact"), 8)
    assert (drawn.inner, drawn.outer) == pytest.approx((4.1e-3, 4.9e-3), rel=6e-4)
    meshed = FaceLip(land_of_mesh(read_mesh(MESHES / "annular_seat.msh"), "contact"), 8)
    np.testing.assert_allclose(meshed.edges, drawn.edges, atol=0.01)
    assert meshed.length == pytest.approx(drawn.length, rel=0.01)


def bent() -> np.ndarray:
    """Return an outline that crosses itself."""
    turns = 2 * np.pi * np.arange(CORNERS) / CORNERS
    winding = turns + 0.9 * np.sin(4 * turns) * (np.abs(turns - np.pi) < 2)
    return 4e-3 * np.column_stack([np.cos(winding), np.sin(winding)]) * (1 + 0.2 * np.cos(8 * turns))[:, None]


@pytest.mark.slow(only=("edges5", "edges6"))
@pytest.mark.parametrize(
    ("edges", "words"),
    [
        (closed(circle(3e-3)), "1.3 times.*at least 2"),
        (np.concatenate([closed(circle(r, 0.0)) for r in (1e-3, 2e-3, 3e-3)]), "hole is only 1.3 times as long"),
        (np.concatenate([closed(circle(1e-3, 9e-3)), closed(circle(3e-3))]), "hole is only 1.3 times as long"),
        (np.concatenate([closed(circle(2.5e-3, 0.7e-3)), closed(circle(3e-3))]), "cross each other"),
        (
            np.concatenate([closed(circle(2e-3)), closed(np.column_stack([circle(3e-3), circle(1e-5)[:, 0]]))]),
            "edges.*0.02 mm",
        ),
        (np.concatenate([closed(circle(3e-3)), closed(circle(3e-3, 4e-3))]), "cross.*overlap"),
        (np.concatenate([closed(circle(r, x)) for r, x in ((6e-3, 0), (1e-3, 3e-3), (1e-3, -3e-3))]), "has 2 holes"),
        (closed(circle(2e-3))[:-1], "closed.*touch"),
        (np.concatenate([closed(bent())[::-1], closed(circle(1e-3))]), "cross.*narrower"),
    ],
)
def test_faces_that_are_no_lips(edges: np.ndarray, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        _narrow_land_of(edges)


def _narrow_land_of(edges: np.ndarray) -> Land:
    """Return the land of these edges, as a seat's is checked."""
    land = land_of(edges, (0, 0, 1))
    for strip in land.strips:
        strip.check_narrow()
    return land


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_a_square_is_divided_from_side_to_side(turn: float) -> None:
    """As a stopper may be broad: its segments are rectangles of one width, in the order of their places."""
    corners = 4e-3 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    spin = np.array([(math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))])
    lip = FaceLip(land_of(closed(corners @ spin), (0, 0, 1)), 8)
    assert lip.area == pytest.approx(64e-6, rel=1e-12)
    along = np.sort(np.abs(lip.line().mean(axis=1) @ spin.T), axis=1)
    np.testing.assert_allclose(along[:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(along[:, 1], 1e-3 * np.array([3.5, 2.5, 1.5, 0.5, 0.5, 1.5, 2.5, 3.5]), rtol=1e-9)


# Lips that are no rings about their middles

BEND, HALF, BORE = 6e-3, 1.3, 1.2e-3  # of a kidney port: radius and half angle of its middle line, half its width


def kidney(radius: float, bend: float = BEND, half: float = HALF, corners: int = 400) -> np.ndarray:
    """Return the outline of all points at a distance from an arc about the origin."""
    along, ends = np.linspace(-half, half, corners), np.linspace(0, np.pi, corners // 4)[1:-1]
    tips = [bend * np.exp(1j * half) + radius * np.exp(1j * (half + ends))]
    tips.append(bend * np.exp(-1j * half) + radius * np.exp(1j * (np.pi - half + ends)))
    outer, inner = (bend + radius) * np.exp(1j * along), (bend - radius) * np.exp(1j * along[::-1])
    points = np.concatenate([outer, tips[0], inner, tips[1]])
    return np.column_stack([points.real, points.imag])


KIDNEY = face(kidney(BORE), kidney(BORE + WIDTH))
KIDNEY_LENGTH = 4 * HALF * BEND + 2 * math.pi * (BORE + WIDTH / 2)


@pytest.mark.parametrize(("arcs", "rings"), [(1, 1), (24, 1), (9, 3)])
def test_a_kidney_port_has_equal_arcs(arcs: int, rings: int) -> None:
    """Rays from its centroid, which lies off it, cross it twice: cuts across do not care. Width times length is exact
    of a band of even width; 100 corners on its ends leave 5e-5."""
    lip = FaceLip(KIDNEY, arcs, rings)
    assert lip.area == pytest.approx(WIDTH * KIDNEY_LENGTH, rel=6e-5)
    np.testing.assert_allclose(lip.lengths, KIDNEY_LENGTH / arcs, rtol=5e-3)
    assert lip.length == pytest.approx(KIDNEY_LENGTH, rel=6e-5)
    assert not len(lip.edges)
    patches = lip.patches((0.0, 0.0))
    areas = np.array([patch.weights.sum() for patch in patches.values()])
    np.testing.assert_allclose(areas, lip.area * lip.division.shares, rtol=1e-9)
    middle = sum(patch.weights @ patch.points for patch in patches.values()) / lip.area
    np.testing.assert_allclose(middle, 0.0, atol=2e-6)
    left, right = lip.cuts(np.linspace(0, 1, 200))
    np.testing.assert_allclose(np.linalg.norm(right - left, axis=1), WIDTH, rtol=1e-3)
    np.testing.assert_allclose(left[0], right[0] - (WIDTH, 0), atol=1e-6)  # begins on the x axis


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_straight_strip_is_a_rectangle(turn: float) -> None:
    """Divided along it and across by Chebyshev's borders, begun at its end at the lesser x."""
    length, width = 12e-3, 1.5e-3
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (length / 2, width / 2)
    spin = np.array([(math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))])
    lip = FaceLip(land_of(closed(corners @ spin), (0, 0, 1)), 8, 2)
    assert lip.pieces == ((8, False),)
    np.testing.assert_allclose(lip.lengths, length / 8, rtol=1e-9)
    along = (lip.line().mean(axis=1) @ spin.T)[:, 0] * np.sign(math.cos(turn))
    np.testing.assert_allclose(along, length * ((np.arange(8) + 0.5) / 8 - 0.5), atol=1e-9)
    points = np.array([patch.points.mean(axis=0) for patch in lip.patches((0.0, 0.0)).values()])
    across = (points @ spin.T)[:, 1] * np.sign(math.cos(turn))
    np.testing.assert_allclose(np.abs(across), width / 4, rtol=1e-9)
    assert np.all(across[::2] > 0)  # from the left side on


@pytest.mark.slow
def test_two_faces_are_numbered_through() -> None:
    """Faces follow by the x of their centroids, closed each from its own x axis; arcs are in proportion to area."""
    edges = np.concatenate([closed(circle(r, 5e-3)) for r in (1e-3, 2e-3)])
    other = [closed(circle(radius, -5e-3)) for radius in (2e-3, 2e-3 * math.sqrt(1 + 3 / 2))]
    land = land_of(np.concatenate([edges, *other]), (0, 0, 1))
    lip = FaceLip(land, 12)
    assert lip.pieces == ((8, True), (4, True))
    assert lip.whole(12) == 12
    assert lip.whole(13) == 15
    np.testing.assert_allclose(land.centre, (-5e-3 / 3, 0, 0), atol=1e-8)
    middles = lip.line().mean(axis=1)[:, 0] + land.centre[0]
    assert np.all(middles[:8] < 0)
    assert np.all(middles[8:] > 0)
    points = np.column_stack([(5e-3, -5e-3), (1.5e-3, -2.5e-3), (0, 0)])
    np.testing.assert_allclose(lip.places(points)[0], (3 / 4, 1 / 2), atol=1e-3)


def test_fewer_arcs_are_joined_of_whole_ones() -> None:
    """33 arcs of three equal lands are compared with 11."""
    assert [find_fewer_arcs(Division(arcs, 2)).arcs for arcs in (32, 33, 35, 37)] == [16, 11, 7, 1]
    assert find_fewer_arcs(Division(33, 2)).rings == 2
