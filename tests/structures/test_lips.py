"""Lips in arcs: their patches on a plate, how their ports are called, and a half-space under them."""

import itertools
import math

import numpy as np
import pytest

from impact.exact.half_space import disk_compliance
from impact.greens.base import GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.errors import ModelError
from seatfem.structures.lip import Lip
from seatfem.structures.patch import arc_compliance, in_arcs
from seatfem.structures.rings import (
    MOST_PORTS,
    Division,
    as_a_whole,
    divided_less,
    parts_joined,
    ring_shares,
)

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
    assert as_a_whole(greens).static_compliance()[0, 0] == pytest.approx(shares @ static @ shares, rel=1e-12)
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
    greens = in_arcs(whole, lip, E, NU, impedance)
    t = np.linspace(0, 2e-4, 60)
    np.testing.assert_allclose(
        as_a_whole(greens).filtered(t, 1e-5), whole.filtered(t, 1e-5), rtol=1e-9, atol=1e-9 * 1e-3
    )
    shares = lip.division.shares
    assert as_a_whole(greens).static_compliance()[0, 0] == pytest.approx(whole.static_compliance()[0, 0], rel=1e-9)
    local = greens.static_compliance() - whole.static_compliance()
    np.testing.assert_allclose(local @ shares, 0.0, atol=1e-9 * np.abs(local).max())
    half = arc_compliance(lip, E, NU)
    apart = np.zeros(16)
    apart[0], apart[8] = 1.0, -1.0  # what is pushed here and pulled there does not move the whole
    assert apart @ local @ apart == pytest.approx(apart @ half @ apart, rel=1e-9)
    np.testing.assert_allclose(greens.initial_value(), np.diag(1 / (shares * impedance)), atol=1e-9 / impedance)
