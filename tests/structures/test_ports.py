"""The ports of a struck patch are the same in space and in a half section: order of the rings, areas, impedances."""

import numpy as np
import pytest
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from seatfem.structures.model import Array, SecondOrderModel

STEEL = Material(200e9, 0.3, 7850.0)
AROUND, UP = 48, 8


def tube(top: float) -> tuple[skfem.MeshHex, skfem.MeshQuad]:
    """Return a thick tube 1 high, its bore from radius 1 to ``top``: in space, and its half section."""
    section = skfem.MeshQuad.init_tensor(np.array([0.0, 0.5, 1.0]), np.linspace(0, 1, UP + 1))
    bore = 1 + (top - 1) * section.p[1]
    flat = skfem.MeshQuad(np.stack([bore + section.p[0] * (3 - bore), section.p[1]]), section.t)
    inner = {"contact": section.facets_satisfying(lambda x: x[0] < 1e-9, boundaries_only=True)}
    inner["fixed"] = section.facets_satisfying(lambda x: x[0] > 1 - 1e-9, boundaries_only=True)
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    r, z = flat.p
    count = flat.p.shape[1]
    points = np.concatenate([np.stack([r * np.cos(a), r * np.sin(a), z]) for a in angles], axis=1)
    cells = [np.concatenate([flat.t + k * count, flat.t + (k + 1) % AROUND * count]) for k in range(AROUND)]
    order = [0, 1, 3, 4, 2, 5, 7, 6]  # scikit-fem's, from the two quadrilaterals one above the other
    solid = skfem.MeshHex(points, np.ascontiguousarray(np.concatenate(cells, axis=1)[order]))

    def radius(x: Array) -> Array:
        return np.hypot(x[0], x[1]) / np.cos(np.pi / AROUND)

    named = {"contact": lambda x: radius(x) < 1.02 * (1 + (top - 1) * x[2]), "fixed": lambda x: radius(x) > 2.98}
    return solid.with_boundaries(named), flat.with_boundaries(inner)


def heights(model: SecondOrderModel) -> list[float]:
    """Return the mean height of each ring."""
    means = []
    for port in model.ports.values():
        weight = np.linalg.norm(model.expand(port.vector), axis=0)
        means.append(float(weight @ model.dofs.points[2] / weight.sum()))
    return means


@pytest.mark.parametrize(("top", "up"), [(1.0, True), (1.5, True), (0.5, False)])
def test_rings_are_the_same_in_space_and_in_a_half_section(top: float, up: bool) -> None:
    """A cylinder is divided along its axis, from below; a cone by the radius, from the inner edge."""
    models = [
        make(mesh, STEEL, rings=3) for make, mesh in zip((assemble, assemble_axisymmetric), tube(top), strict=True)
    ]
    space, section = models
    assert space.port_names == section.port_names == ("contact_1", "contact_2", "contact_3")
    assert heights(space) == pytest.approx(heights(section), abs=0.02)
    assert (np.diff(heights(space)) > 0).all() if up else (np.diff(heights(space)) < 0).all()
    for one, other in zip(space.ports.values(), section.ports.values(), strict=True):
        assert one.area == pytest.approx(other.area, rel=0.01)  # 48 straight sides
        assert one.impedance == pytest.approx(other.impedance, rel=0.01)
