"""A rigid ball on blocks of PEEK: Hertz's law beside one patch, against a contact that the mesh resolves.

The reference knows no law: the ball's round face meets twelve rings of the patch, each rigidly once its own gap
r^2/(2 R) is closed. Twelve rings leave 0.1 to 0.2 % of the force, of those with sixteen on a finer mesh.
"""

import math

import numpy as np
import pytest

import impact
import seatfem
from impact import Body, Contact, ContactProblem, HertzOnPatch, measures
from impact.exact.contact_stress import hertz_impact
from impact.exact.half_space import disk_compliance
from seatfem.structures.rings import ring_borders
from tests.solids import Material, MeshSpec, Stopper, assemble_axisymmetric, make_meridian

PEEK = {"young": 3.6e9, "poisson": 0.38}
RADIUS, SPEED, RINGS = 2.5e-3, 1.0, 12
MASS = 7850 * 4 / 3 * math.pi * RADIUS**3
STIFFNESS = 4 / 3 * PEEK["young"] / (1 - PEEK["poisson"] ** 2) * math.sqrt(RADIUS)
HERTZ = hertz_impact(stiffness=STIFFNESS, mass=MASS, speed=SPEED)
CONTACT = math.sqrt(RADIUS * (HERTZ.force / STIFFNESS) ** (2 / 3))
BALL = impact.rigid_mass(mass=MASS, velocity=-SPEED)
DURATION = 1.5 * HERTZ.duration


def block(size: tuple[float, float], patch: float, rings: int = 1) -> impact.GreensFunction:
    """Return a disc of this radius and thickness, clamped below, struck on a patch in rings [m]."""
    elements = MeshSpec(size=size[1] / 6, contact_size=patch / (30 if rings > 1 else 12), rings=rings)
    mesh = make_meridian(Stopper(radius=size[0], thickness=size[1], contact_radius=patch), elements)
    model = assemble_axisymmetric(mesh, Material(**PEEK, density=1300.0), ports={"contact": "contact"}, rings=rings)
    return seatfem.greens_function(model, bandwidth=2e5, duration=DURATION, tolerance=2e-3, damping_ratio=0.01)


def resolved(size: tuple[float, float]) -> float:
    """Return the largest force [N] of the ball's face on the rings."""
    patch, seat = 1.3 * CONTACT, Body(block(size, 1.3 * CONTACT, RINGS))
    borders = ring_borders(RINGS)
    heights = patch**2 * (borders[1:] + borders[:-1]) / (4 * RADIUS)
    contacts = [Contact(seat, port=k, gap=float(height - heights[0])) for k, height in enumerate(heights)]
    result = impact.solve(ContactProblem(BALL, contacts=contacts), dt=DURATION / 4000, duration=DURATION)
    assert np.count_nonzero(result.force.max(axis=0)) < RINGS - 2  # the contact ends within the patch
    return float(result.force.sum(axis=1).max())


def by_law(seat: impact.GreensFunction, law: impact.Law) -> float:
    result = impact.solve(ContactProblem(BALL, Body(seat), law=law), dt=DURATION / 4000, duration=DURATION)
    return measures.peak_force(result)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "above_hertz", "within"),
    [((20, 20), 0.02, 0.003), ((5, 5), 0.0925, 0.008), ((12, 3), 0.196, 0.025)],
    ids=["bulky", "short", "thin"],
)
def test_one_patch_has_the_force_of_the_resolved_contact(
    size: tuple[float, float], above_hertz: float, within: float
) -> None:
    """Blocks sized in contact radii have the resolved force: short and thin ones are firmer than a half-space by up to
    20 %; under a patch of two contact radii, two thirds of the thickness, 2 % of it is the patch's."""
    metres = (size[0] * CONTACT, size[1] * CONTACT)
    exact = resolved(metres)
    assert exact / HERTZ.force - 1 == pytest.approx(above_hertz, abs=0.005)
    for patch, share in ((1.3, 0.003), (2.0, within)):
        seat = block(metres, patch * CONTACT)
        local = disk_compliance(**PEEK, radius=patch * CONTACT)
        assert by_law(seat, HertzOnPatch(STIFFNESS, local)) == pytest.approx(exact, rel=share)
        if patch == 1.3:
            assert by_law(seat, HertzOnPatch(STIFFNESS, 1.03 * local)) > (1 + 2 * share) * exact
        assert by_law(seat, impact.Hertz(STIFFNESS)) < 0.82 * exact
