"""Axisymmetric assembly: rigid motions, total mass and force, nodal mass, regions, supports, messages of bad input."""

import math

import numpy as np
import pytest
import skfem

from seatfem.pictures.skins import skin_of
from seatfem.structures.elements.supports import Absorbing, Foundation
from tests.solids import Material, ModelError, Orthotropic, assemble_axisymmetric

STEEL = Material(200e9, 0.3, 7850.0, "steel")
KINDS = [(skfem.MeshTri, 1), (skfem.MeshTri, 2), (skfem.MeshQuad, 1), (skfem.MeshQuad, 2)]


def ring(inner=0.0, outer=1.0, height=2.0, n=(3, 4), kind=skfem.MeshQuad):
    """Return the meridian of a (hollow) cylinder: contact on top, fixed below."""
    mesh = kind.init_tensor(np.linspace(inner, outer, n[0] + 1), np.linspace(0, height, n[1] + 1))
    return mesh.with_boundaries(
        {
            "contact": lambda x: np.isclose(x[1], height),
            "fixed": lambda x: np.isclose(x[1], 0.0),
            "outer": lambda x: np.isclose(x[0], outer),
        }
    )


def unknowns(model, amplitudes):
    """Return the vector of unknowns whose expansion is (3, n_nodes) ``amplitudes``."""
    return model.dofs.turned.T @ np.asarray(amplitudes).T.ravel()


def rigid_motions(model, harmonic):
    """Return amplitudes (U, V, W): along z; along x and about y."""
    r, _, z = model.dofs.points
    one, none = np.ones_like(r), np.zeros_like(r)
    return [(none, none, one)] if harmonic == 0 else [(one, -one, none), (z, -z, -r)]


@pytest.mark.parametrize("harmonic", [0, 1, 2])
def test_port_is_the_rings_mean_normal_displacement_and_its_impedance(harmonic):
    model = assemble_axisymmetric(ring(0.5), STEEL, harmonic=harmonic, order=2)
    port, r = model.ports["contact"], model.dofs.points[0]
    area = math.pi * (1 - 0.25)
    assert port.area == pytest.approx(area, rel=1e-12)
    along = unknowns(model, np.stack([0 * r, 0 * r, r]))  # mean of r over the ring: 2/3 (b^3 - a^3)/(b^2 - a^2)
    assert port.vector @ along == pytest.approx(2 / 3 * (1 - 0.125) / 0.75, rel=1e-12)
    assert port.impedance == pytest.approx(7850 * STEEL.c_p * area / (1 if harmonic == 0 else 2), rel=1e-12)


def test_port_on_a_cone_follows_its_outward_normal():
    mesh = ring(0.5, height=1.0)
    points = np.array(mesh.p)
    points[1] -= 0.5 * points[0] * points[1]  # the top falls outward: normal (1, 2)/sqrt(5)
    cone = skfem.MeshQuad(points, mesh.t).with_boundaries(mesh.boundaries)
    model = assemble_axisymmetric(cone, STEEL, order=2)
    one = np.ones_like(model.dofs.points[0])
    port = model.ports["contact"]
    assert port.area == pytest.approx(math.pi * 0.75 * math.sqrt(1.25), rel=1e-12)
    assert port.vector @ unknowns(model, (0 * one, 0 * one, one)) == pytest.approx(2 / math.sqrt(5), rel=1e-12)
    assert port.vector @ unknowns(model, (one, 0 * one, 0 * one)) == pytest.approx(1 / math.sqrt(5), rel=1e-12)


def test_sliding_on_a_cone_leaves_its_tangents_free():
    mesh = ring(0.5, height=1.0)
    points = np.array(mesh.p)
    points[0] += 0.25 * points[1]
    cone = skfem.MeshQuad(points, mesh.t).with_boundaries(
        {"contact": mesh.boundaries["contact"], "outer": mesh.boundaries["outer"]}
    )
    for harmonic in (0, 2):
        model = assemble_axisymmetric(cone, STEEL, harmonic=harmonic, fixed=(), sliding="outer", order=2)
        u, _, w = model.expand(np.random.default_rng(1).standard_normal(model.size))
        on = np.isclose(model.dofs.points[0] - 0.25 * model.dofs.points[2], 1.0)
        assert np.abs(u[on] - 0.25 * w[on]).max() < 1e-12  # normal (4, -1)
        assert np.abs(w[on]).max() > 0.1


def test_regions_weigh_and_damp_apart():
    mesh = ring(0.5).with_subdomains({"low": lambda x: x[1] < 1, "high": lambda x: x[1] > 1})
    rubber = Material(1e7, 0.4, 1000.0, loss_factor=0.2, rayleigh=(3.0, 1e-5))
    model = assemble_axisymmetric(mesh, {"low": STEEL, "high": rubber}, fixed=(), ports={}, order=2)
    one = np.ones_like(model.dofs.points[0])
    z = unknowns(model, (0 * one, 0 * one, one))
    half = math.pi * 0.75
    assert z @ model.M @ z == pytest.approx(half * (7850 + 1000), rel=1e-12)
    assert z @ model.C @ z == pytest.approx(3.0 * 1000 * half, rel=1e-9)
    low = model.dofs.points[2] < 1 - 1e-9
    upper = unknowns(model, (0 * one, 0 * one, np.where(low, 0.0, model.dofs.points[2] - 1)))
    assert upper @ model.loss @ upper == pytest.approx(0.2 * half * rubber.elasticity[2, 2], rel=1e-9)
    with pytest.raises(ModelError, match="none"):
        assemble_axisymmetric(mesh, {"low": STEEL}, order=2)


def test_orthotropic_solids_must_be_the_same_in_every_meridian():
    fine = Orthotropic((10e9, 10e9, 1e9), (0.25, 0.1, 0.1), (4e9, 1e9, 1e9), 1500.0)
    model = assemble_axisymmetric(ring(), fine, harmonic=1, fixed=(), order=2)
    assert np.abs(model.K @ unknowns(model, rigid_motions(model, 1)[1])).max() < 1e-12 * abs(model.K).max()
    with pytest.raises(ModelError, match="turned by 45 degrees"):
        assemble_axisymmetric(ring(), Orthotropic((10e9, 10e9, 1e9), (0.25, 0.1, 0.1), (5e9, 1e9, 1e9), 1500.0))


def test_supports_act_on_the_whole_ring():
    plain = assemble_axisymmetric(ring(0.5), STEEL, fixed=(), order=2)
    held = assemble_axisymmetric(
        ring(0.5), STEEL, fixed=(), order=2, supports=[Foundation("fixed", 1e9, 2e8), Absorbing("outer")]
    )
    one = np.ones_like(plain.dofs.points[0])
    z = unknowns(plain, (0 * one, 0 * one, one))
    assert z @ (held.K - plain.K) @ z == pytest.approx(1e9 * math.pi * 0.75, rel=1e-9)
    assert z @ held.C @ z == pytest.approx(7850 * STEEL.c_s * 2 * math.pi * 2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"harmonic": -1}, "harmonic = -1"),
        ({"order": 3}, "order 3"),
        ({"fixed": "bottom"}, "no boundary 'bottom'"),
        ({"fixed": "contact"}, "take them out of one"),
    ],
)
def test_bad_arguments_are_named(change, words):
    with pytest.raises(ModelError, match=words):
        assemble_axisymmetric(ring(), STEEL, **change)


def test_bad_meshes_are_named():
    mesh = ring()
    with pytest.raises(ModelError, match="must be >= 0"):
        assemble_axisymmetric(mesh.translated((-0.5, 0.0)).with_boundaries(mesh.boundaries), STEEL)
    with pytest.raises(ModelError, match="two dimensions"):
        assemble_axisymmetric(skfem.MeshTet(), STEEL)
    points = np.array(mesh.p)
    points[:, 7] += [0.6, 0.0]
    with pytest.raises(ModelError, match="folded"):
        assemble_axisymmetric(skfem.MeshQuad(points, mesh.t).with_boundaries(mesh.boundaries), STEEL)


@pytest.mark.parametrize(("kind", "order"), KINDS)
def test_the_surface_of_a_body_of_revolution_moves_as_the_body(kind, order):
    model = assemble_axisymmetric(ring(0.0, kind=kind), STEEL, harmonic=1, fixed=(), order=order)
    skin = skin_of(model)
    lateral, tilt = (skin.moved(np.array(motion)[:, skin.nodes].T, 1) for motion in rigid_motions(model, 1))
    np.testing.assert_allclose(lateral, np.outer(np.ones(len(skin.points)), [1, 0, 0]), atol=1e-12)
    x, _, z = skin.points.T
    np.testing.assert_allclose(tilt, np.column_stack([z, 0 * z, -x]), atol=1e-12)
