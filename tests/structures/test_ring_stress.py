"""Stress of bodies struck in arcs: harmonics against one axisymmetric model and a solid one, rotation, many ports."""

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
import skfem

from impact.greens.base import Array
from impact.life.multiaxial import deviators
from seatfem.structures.fields import recovery
from seatfem.structures.fields.peaks import largest, mises_range, principal, von_mises
from seatfem.structures.fields.recovery import Response, at_time, histories, recover
from seatfem.structures.fields.sites import at_points
from seatfem.structures.fields.solids import Harmonic, RingField, elements_of, felt, solid_stress
from seatfem.structures.reduction.harmonics import RingPatch, mixing_of
from tests.ring_mesh import EDGE, HEIGHT, INNER, OUTER, around, meridian
from tests.solids import Material, assemble, assemble_axisymmetric

STEEL = Material(200e9, 0.3, 7850.0)
BAND, ZETA, STEP = 100e3, 0.02, 0.1e-6
TIME = STEP * np.arange(251)
PULSE = np.where(TIME < 20e-6, np.sin(np.pi * TIME / 20e-6) ** 2, 0.0)


def ring(patches: Sequence[RingPatch], points: Array, angles: Array, numbers: Sequence[int]) -> RingField:
    """Return the stress at points (G, 2) of the section by harmonics."""
    by_port, parts = {str(k): patch for k, patch in enumerate(patches)}, []
    elements = elements_of(meridian(), 2)
    for n in numbers:
        model = assemble_axisymmetric(meridian(), STEEL, harmonic=n, order=2)
        functional = solid_stress(elements, STEEL, model, at_points(elements, points), harmonic=n)
        field = recover(model, functional, points, bandwidth=BAND, dt=STEP, damping_ratio=ZETA, vectors=30)
        parts.append(Harmonic(n, field, mixing_of(by_port, ["contact"], n)))
    return RingField(points, np.broadcast_to(angles, (len(points), len(angles))), tuple(parts))


def arcs(count: int) -> list[RingPatch]:
    return [RingPatch(2 * math.pi * (k + 0.5) / count, 2 * math.pi / count) for k in range(count)]


POINTS = np.array([(INNER, 0.4 * HEIGHT), (5.5e-3, 0.5 * HEIGHT), (OUTER, 0.5 * HEIGHT), (5e-3, 1e-3)])


@pytest.mark.slow
def test_one_force_on_all_arcs_is_that_of_the_axisymmetric_body() -> None:
    angles = np.array([0.1, 2.0])
    field = ring(arcs(6), POINTS, angles, range(5))
    model = assemble_axisymmetric(meridian(), STEEL, order=2)
    elements = elements_of(meridian(), 2)
    functional = solid_stress(elements, STEEL, model, at_points(elements, POINTS))
    one = recover(model, functional, POINTS, bandwidth=BAND, dt=STEP, damping_ratio=ZETA, vectors=30)
    whole = histories(one, PULSE, STEP)
    stress = histories(field, np.repeat(PULSE[:, None] / 6, 6, axis=1), STEP).reshape(len(POINTS), 2, 6, -1)
    np.testing.assert_allclose(stress, np.broadcast_to(whole[:, None], stress.shape), atol=1e-9 * np.abs(whole).max())
    assert felt({str(k): patch for k, patch in enumerate(arcs(6))}, np.ones((3, 6)), 40) == [0]


ARC = RingPatch(math.pi / 8, math.pi / 4)  # an eighth from the x axis on


@cache
def solid_mesh(slices: int) -> skfem.MeshHex2:
    """Return the same section in slices, the arc struck."""

    def struck(x: Array) -> Array:
        on_lip = np.isclose(x[2], HEIGHT) & (np.hypot(x[0], x[1]) < EDGE)
        return on_lip & (np.mod(np.arctan2(x[1], x[0]), 2 * math.pi) < math.pi / 4)

    return around(meridian(), slices).with_boundaries({"contact": struck, "fixed": lambda x: np.isclose(x[2], 0.0)})


@pytest.mark.slow
def test_one_arc_makes_the_stress_of_a_solid_mesh() -> None:
    """The stress of harmonics is that of slices with the same quadratic functions in the section. Slices err by (2 pi
    n/slices)^2/12 of a harmonic n: 5 % of n = 4 with 32, a fifth of the whole there, and all of n = 8 with 16, so that
    the error falls a bit slower than with their square."""
    angles = math.pi / 8 * np.array([2.0, 4.0, 9.0])
    field = ring([ARC], POINTS, angles, range(15))
    turns = np.tile(angles, len(POINTS))
    flat = np.repeat(POINTS, len(angles), axis=0)
    places = np.column_stack([flat[:, 0] * np.cos(turns), flat[:, 0] * np.sin(turns), flat[:, 1]])
    np.testing.assert_allclose(field.points, places)
    stress = np.moveaxis(histories(field, PULSE, STEP), 1, 2)
    errors = []
    for slices in (16, 32):
        model, elements = assemble(solid_mesh(slices), STEEL), elements_of(solid_mesh(slices))
        functional = solid_stress(elements, STEEL, model, at_points(elements, places))
        body = recover(model, functional, places, bandwidth=BAND, dt=STEP, damping_ratio=ZETA, vectors=60)
        exact = np.moveaxis(histories(body, PULSE, STEP), 1, 2)
        size = np.linalg.norm(exact, axis=(1, 2)).reshape(len(POINTS), -1).max(axis=1)
        tz = np.cos(turns)[:, None] * exact[..., 3] - np.sin(turns)[:, None] * exact[..., 4]  # of yz and xz
        off = [stress[..., 3] - tz, principal(stress) - principal(exact)]
        errors.append([float((np.linalg.norm(o.reshape(len(o), -1), axis=1) / size.repeat(3)).max()) for o in off])
        assert np.linalg.norm(tz) > 0.04 * np.linalg.norm(exact)
    coarse, fine = np.array(errors)
    assert (fine < 0.02).all(), errors
    assert (coarse > 1.8 * fine).all(), errors


@pytest.mark.slow
def test_the_largest_and_the_range_of_a_ring_are_those_of_its_histories() -> None:
    """The largest stresses and, by a box around the deviators, the range agree with the histories."""
    angles = 2 * math.pi * (np.arange(8) + 0.5) / 8
    field = ring(arcs(8), POINTS, angles, range(6))
    force = PULSE[:, None] * np.array([1.0, 0.4, 0, 0, 0, 0, 0, 0.2])
    peaks, at_once = largest(field, force, STEP).after_contact, np.moveaxis(histories(field, force, STEP), 1, 2)
    np.testing.assert_allclose(peaks.von_mises, von_mises(at_once).max(axis=1), rtol=5e-3)
    np.testing.assert_allclose(peaks.principal, principal(at_once)[..., 2].max(axis=1), atol=5e-3 * at_once.max())
    worst = int(peaks.von_mises.argmax())
    some = field.at(np.array([worst]))
    np.testing.assert_allclose(some.points, field.points[[worst]])
    then = at_time(some, force, STEP, round(peaks.von_mises_time[worst] / STEP))
    assert von_mises(then)[0] == pytest.approx(peaks.von_mises[worst], rel=5e-3)
    exact = [math.sqrt(3) * np.linalg.norm(np.ptp(deviators(course), axis=0)) for course in at_once]
    np.testing.assert_allclose(mises_range(field, force, STEP), exact, rtol=5e-3)


def test_many_ports_answer_by_modes_as_few_by_krylov_vectors(monkeypatch: pytest.MonkeyPatch) -> None:
    """One port, by a Krylov space and by all modes up to six times the pulse's band: what modes leave out of the
    dynamics is (w/w_k)^2 of each, 3 % at most of little. All of them are closer than three quarters."""
    model, elements = assemble_axisymmetric(meridian(), STEEL, order=2), elements_of(meridian(), 2)
    functional = solid_stress(elements, STEEL, model, at_points(elements, POINTS))
    courses = []
    for most in (8, 0):
        monkeypatch.setattr(recovery, "MOST_PORTS", most)
        answers = Response.from_model(model, bandwidth=2 * BAND, damping_ratio=ZETA)
        courses += [
            histories(answers.stress(functional, POINTS).field(STEP, fewer=k), PULSE, STEP) for k in (False, True)
        ]
    krylov, _, modes, fewer = courses
    assert 3 < answers.vectors.shape[1] < 40
    off, more = (np.abs(each - krylov).max() / np.abs(krylov).max() for each in (modes, fewer))
    assert off < 0.01
    assert off < more
