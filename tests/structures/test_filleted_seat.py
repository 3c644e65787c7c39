"""Stress in the fillet at the foot of an annular seat's lip: it converges, where a sharp corner has none."""

import math

import numpy as np
import pytest

from impact.greens.base import Array
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.fields.recovery import von_mises
from seatfem.structures.fields.sites import on_surface
from seatfem.structures.fields.solids import elements_of, solid_stress
from seatfem.structures.materials import Material
from seatfem.structures.mesh.plane_meshes import MeridianMesh, make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.shapes import AnnularSeat

STEEL = Material(200e9, 0.3, 7850.0, "steel")
RADIUS, FOOT = 0.4e-3, (5e-3, 5e-3)
SEAT = AnnularSeat(
    lip_height=1e-3, lip_edge_radius=0.2e-3, lip_fillet=RADIUS, outer_radius=8e-3, thickness=5e-3
)  # fmt: skip


def drawn(finer: float) -> MeridianMesh:
    return make_meridian(SEAT, MeshSpec(0.8e-3 / finer, 0.2e-3 / finer, fillets=finer))


def on_the_fillet(points: Array) -> Array:
    centre = np.array(FOOT) + RADIUS
    return np.asarray(np.abs(np.linalg.norm(points - centre, axis=1) - RADIUS) < 1e-6 * RADIUS)


def largest(mesh: MeridianMesh) -> float:
    """Return the von Mises stress in the fillet under one newton at rest [Pa]."""
    model, elements = assemble_axisymmetric(mesh, STEEL), elements_of(mesh)
    sites = on_surface(elements)
    push = factorize(model.K).solve(model.port_matrix)
    stress = von_mises((solid_stress(elements, STEEL, model, sites) @ push).reshape(-1, 6))
    return float(stress[on_the_fillet(sites.points)].max())


@pytest.mark.slow
def test_the_largest_stress_in_the_fillet_converges() -> None:
    """The largest stress converges by more than order 1.4, and the elements of a run have it to 1 %."""
    exact = largest(drawn(5.0))
    errors = [abs(largest(drawn(finer)) / exact - 1) for finer in (0.25, 1.0)]
    assert errors[1] < 0.01
    assert math.log(errors[0] / errors[1], 4.0) > 1.4
