"""Ports, isotropic and orthotropic materials, and the messages of bad input to assembly."""

import numpy as np
import pytest
import skfem

from tests.solids import Material, ModelError, Orthotropic, Port, SecondOrderModel, assemble

STEEL = Material(200e9, 0.3, 7850.0, "steel")
SIDES = {"contact": lambda x: x[2] > 1 - 1e-9, "fixed": lambda x: x[2] < 1e-9, "side": lambda x: x[0] < 1e-9}


def block(order, bend=0.0, n=3):
    """Return a unit cube of Kuhn tetrahedra; ``bend`` curves its upper part."""
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, 1, n + 1) for _ in range(3))).with_boundaries(SIDES)
    if order == 1:
        return mesh
    boundaries = mesh.boundaries
    mesh = skfem.MeshTet2.from_mesh(mesh)
    points = np.array(mesh.doflocs)
    points[1] += bend * points[0] * np.sin(3 * points[2])
    return skfem.MeshTet2(points, mesh.t).with_boundaries(boundaries)


def test_port_averages_the_normal_displacement_and_pushes_with_one_newton():
    model = assemble(block(2), STEEL)
    port = model.ports["contact"]
    heights = np.zeros_like(model.dofs.points.T)
    heights[:, 2] = model.dofs.points[2]
    assert port.vector @ heights.ravel()[model.dofs.free] == pytest.approx(1.0, rel=1e-12)
    assert port.area == pytest.approx(1.0, rel=1e-12)
    assert port.impedance == pytest.approx(7850.0 * np.sqrt(200e9 * 0.7 / (1.3 * 0.4) / 7850.0), rel=1e-12)
    assert port.vector.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((-1.0, 0.3, 7850.0), "young = -1.0 Pa"),
        ((2e11, 0.5, 7850.0), "poisson = 0.5"),
        ((2e11, 0.3, np.nan), "density = nan"),
    ],
)
def test_bad_materials(values, message):
    with pytest.raises(ModelError, match=message):
        Material(*values)


def test_area_of_strongly_curved_facets():
    """Facets as wide as the bore's radius, whose map Newton's method does not invert.

    Each quarter of a circle becomes a parabola: the triangle, and 2/3 of its chord times its rise.
    """
    grid = (np.array([3e-3, 5e-3]), np.arange(5.0), np.array([0, 1e-3]))
    ring = skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(*grid))
    radius, angle, height = np.array(ring.doflocs) * np.array([[1], [np.pi / 2], [1]])
    keep = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
    top = {
        "contact": ring.facets_satisfying(lambda x: x[2] > 0.99e-3),
        "fixed": ring.facets_satisfying(lambda x: x[2] < 1e-5),
    }
    quarter = 1 / 2 + 2 / 3 * np.sqrt(2) * (1 - np.sqrt(0.5))
    model = assemble(skfem.MeshHex2(keep, ring.t).with_boundaries(top), STEEL)
    assert model.ports["contact"].area == pytest.approx(4 * quarter * (25e-6 - 9e-6), rel=1e-6)


WOOD = {"young": (12e9, 0.9e9, 0.5e9), "poisson": (0.4, 0.45, 0.5), "shear": (0.8e9, 0.7e9, 0.06e9), "density": 450.0}
TURN = ((0.8, 0.6, 0.0), (-0.36, 0.48, 0.8), (0.48, -0.64, 0.6))


def test_an_orthotropic_solid_with_isotropic_constants_is_isotropic_in_any_axes():
    shear = 200e9 / 2.6
    same = Orthotropic((200e9,) * 3, (0.3,) * 3, (shear,) * 3, 7850.0, axes=TURN)
    assert np.allclose(same.elasticity, STEEL.elasticity, rtol=1e-12, atol=1.0)
    assert same.c_p_along([[1.0, 2.0, 3.0]]) == pytest.approx([STEEL.c_p], rel=1e-12)
    assert same.c_s == pytest.approx(STEEL.c_s, rel=1e-9)


def test_orthotropic_compliance_has_the_engineering_constants():
    compliance = np.linalg.inv(Orthotropic(**WOOD).elasticity)
    assert 1 / np.diag(compliance)[:3] == pytest.approx(WOOD["young"], rel=1e-9)
    assert 1 / np.diag(compliance)[3:] == pytest.approx(WOOD["shear"][::-1], rel=1e-9)
    assert -compliance[0, 1] * 12e9 == pytest.approx(0.4, rel=1e-9)
    assert -compliance[1, 2] * 0.9e9 == pytest.approx(0.5, rel=1e-9)


def solid(**named):
    """Return the cube's mesh with other boundaries."""
    return block(1).with_boundaries({name: np.asarray(facets, dtype=np.int64) for name, facets in named.items()})


def bent():
    mesh = block(1)
    points = mesh.p + 0.05 * np.stack([np.sin(3 * mesh.p[2]), *np.zeros((2, mesh.p.shape[1]))])
    return skfem.MeshTet(points, mesh.t).with_boundaries(mesh.boundaries)


INNER = np.setdiff1d(np.arange(block(1).nfacets), block(1).boundary_facets())
EYE, B = np.eye(3), {"p": np.ones(3)}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: assemble(block(1), STEEL, fixed="bottom"), "boundary 'bottom'"),
        (lambda: assemble(block(1), STEEL, ports={"a": "lip"}), "port:.*'lip'"),
        (lambda: assemble(block(1), STEEL, ports={"a": "fixed"}), "also fixed"),
        (lambda: assemble(block(1), STEEL, order=3), "order 3"),
        (lambda: assemble(solid(contact=[]), STEEL), r"'contact' is empty \(area 0\)"),
        (lambda: assemble(solid(contact=INNER[:2]), STEEL), r"2 facets.*'contact'"),
        (lambda: assemble(bent(), STEEL, sliding="side"), r"sliding:.*'side'"),
        (lambda: assemble(block(1), {"young": 2e11}), "give poisson, density too"),
        (lambda: assemble(block(1), {"young": "200 GPa", "poisson": 0.3, "density": 7850}), r"young = '200 GPa'.*SI"),
        (lambda: SecondOrderModel(EYE, None, np.diag([1.0, np.nan, np.inf]), B), r"K.*2 values"),
        (lambda: SecondOrderModel(EYE + 0.5 * np.eye(3, k=1), None, EYE, B), r"M must be symmetric: .* = 5.0e-01"),
        (lambda: SecondOrderModel(np.diag([1.0, 0.0, 1.0]), None, EYE, B), "M has a diagonal value 0"),
        (lambda: SecondOrderModel(EYE, None, -EYE, B), r"K .*-1"),
        (lambda: SecondOrderModel(EYE, np.eye(2), EYE, B), "C is 2 x 2, must be 3 x 3 as M"),
        (lambda: SecondOrderModel(EYE, None, np.ones((3, 2)), B), "K is 3 x 2: it must be square"),
        (lambda: SecondOrderModel(EYE, None, EYE, {"p": np.ones(2)}), r"port 'p' has shape \(2,\)"),
        (lambda: SecondOrderModel(EYE, None, EYE, {"p": np.zeros(3)}), r"'p'.*finite"),
        (lambda: Port(np.ones(3), impedance=-1.0), "impedance = -1"),
        (lambda: SecondOrderModel(EYE, None, EYE, B).expand(np.ones(3)), "bare matrices"),
        (lambda: Orthotropic(**WOOD | {"young": (1e9, -1e9, 1e9)}), "young = .* Pa must be positive"),
        (lambda: Orthotropic(**WOOD | {"poisson": (0.4, 0.45, 1.5)}), "strain energy"),
        (lambda: Orthotropic(**WOOD | {"axes": ((1, 0, 0), (0, 1, 0), (0, 1, 0))}), "three orthonormal rows"),
        (lambda: Orthotropic(**WOOD | {"loss_factor": -0.1}), "loss_factor = -0.1"),
        (lambda: Orthotropic(**WOOD | {"rayleigh": (1.0, np.nan)}), "rayleigh = .* must be finite"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(ModelError, match=message):
        make()
