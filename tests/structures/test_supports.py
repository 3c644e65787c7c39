"""Springs, dashpots and absorbing boundaries; symmetry planes, also oblique; sectors."""

import numpy as np
import pytest
import skfem
from scipy import sparse
from scipy.linalg import eigh

from seatfem.structures.elements.supports import Absorbing, Dashpot, Foundation
from tests.solids import Material, ModelError, assemble

STEEL = Material(200e9, 0.3, 7850.0, "steel")
ROD = Material(1.0, 0.0, 1.0)
TURN = np.array([[0.8, -0.36, 0.48], [0.6, 0.48, -0.64], [0.0, 0.8, 0.6]])  # a rotation


def box(x, y, z, order=2):
    """Return a box of hexahedra with corners 0 and the last of x, y, z; faces x0, x1, ..., a quarter's contact."""
    faces = {f"{'xyz'[a]}{k}": face(a, (x, y, z)[a][-k]) for a in range(3) for k in (0, 1)}
    faces["contact"] = lambda p: (p[2] > z[-1] - 1e-9) & (np.abs(p[0]) < 0.5) & (np.abs(p[1]) < 0.5)
    mesh = skfem.MeshHex.init_tensor(*(np.asarray(c, dtype=float) for c in (x, y, z))).with_boundaries(faces)
    return mesh if order == 1 else skfem.MeshHex2.from_mesh(mesh).with_boundaries(mesh.boundaries)


def face(axis, place):
    return lambda p: np.abs(p[axis] - place) < 1e-9


def turned(mesh):
    kind = type(mesh)
    return kind(TURN @ mesh.doflocs, mesh.t).with_boundaries(mesh.boundaries)


def compliance(model):
    b = model.port_matrix[:, 0]
    return b @ sparse.linalg.spsolve(model.K.tocsc(), b)


@pytest.mark.parametrize("turn", [False, True])
def test_a_block_on_an_elastic_foundation_sinks_by_the_pressure_over_its_stiffness(turn):
    """The block sinks by F/(k A) + F L/(E A) for nu = 0, and moves sideways by F/(k_t A)."""
    mesh = box([0, 1], [0, 1, 2], [0, 1, 3])
    mesh = turned(mesh) if turn else mesh
    model = assemble(mesh, ROD, fixed=(), supports=(Foundation("z0", 0.5, 0.25),), ports={"top": "z1"})
    assert compliance(model) == pytest.approx(1 / (0.5 * 2) + 3 / 2, rel=1e-9)
    everywhere = np.tile((TURN if turn else np.eye(3))[:, 0], model.size // 3)
    assert everywhere @ model.K @ everywhere == pytest.approx(0.25 * 2, rel=1e-9)


def test_dashpots_act_by_area_and_direction():
    mesh = box([0, 1], [0, 1, 2], [0, 1, 3])
    model = assemble(mesh, ROD, fixed=(), supports=(Dashpot("z0", 4.0, 1.0), Dashpot("x0", 3.0)), ports={"top": "z1"})
    x, z = (np.tile(np.eye(3)[a], model.size // 3) for a in (0, 2))
    assert z @ model.C @ z == pytest.approx(4.0 * 2, rel=1e-12)
    assert x @ model.C @ x == pytest.approx(1.0 * 2 + 3.0 * 6, rel=1e-12)
    assert abs(model.C - model.C.T).max() == 0.0
    assert model.rayleigh is None


def march(model, force, step, count):
    """Return the displacement of the port by average acceleration (Newmark)."""
    b = model.port_matrix[:, 0]
    solve = sparse.linalg.splu((model.M + step / 2 * model.C + step**2 / 4 * model.K).tocsc()).solve
    u, v, a, seen = np.zeros(model.size), np.zeros(model.size), np.zeros(model.size), []
    for k in range(count):
        early_u, early_v = u + step * v + step**2 / 4 * a, v + step / 2 * a
        a = solve(b * force((k + 1) * step) - model.C @ early_v - model.K @ early_u)
        u, v = early_u + step**2 / 4 * a, early_v + step / 2 * a
        seen.append(b @ u)
    return np.array(seen)


@pytest.mark.slow
def test_a_rod_with_an_absorbing_end_is_semi_infinite():
    """The end's motion is the integral of F/(rho c A) for three transits: less than 1 % comes back."""
    mesh = box([0, 1], [0, 1], np.linspace(0, 10, 41))
    sides = ("x0", "x1", "y0", "y1")
    model = assemble(mesh, ROD, fixed=(), sliding=sides, supports=(Absorbing("z0"),), ports={"top": "z1"})
    pulse = lambda t: np.sin(np.pi * t / 4) ** 2 if t < 4 else 0.0  # noqa: E731
    seen = march(model, pulse, 0.1, 350)
    t = 0.1 * np.arange(1, 351)
    exact = np.where(t < 4, t / 2 - np.sin(np.pi * t / 2) / np.pi, 2.0)
    assert np.abs(seen - exact).max() < 0.01 * 2


@pytest.mark.slow
def test_a_sphere_of_waves_leaves_through_an_absorbing_block():
    """Pushed in the middle of its face, a block with absorbing walls moves as one twice its size, not yet reflected.

    Dashpots alone leave 12 % of the peak behind, as they resist no slow motion; springs beside them 4 %.
    """
    pulse = lambda t: np.sin(np.pi * t / 3) ** 2 if t < 3 else 0.0  # noqa: E731
    solid, walls = Material(1.0, 0.25, 1.0), ("x1", "y1", "z0")
    middle = tuple(Absorbing(wall, (0.0, 0.0, 0.0)) for wall in walls)
    cases = {
        "far": (5, ()),
        "dashpots": (2.5, tuple(map(Absorbing, walls))),
        "springs": (2.5, middle),
        "closed": (2.5, ()),
    }
    seen = {}
    for name, (size, supports) in cases.items():
        mesh = box(np.arange(0, size + 0.1, 0.5), np.arange(0, size + 0.1, 0.5), np.arange(-size, 0.1, 0.5), 1)
        model = assemble(
            mesh, solid, mass="nodal", supports=supports or (Dashpot("x1", 0.0),), fixed=(), sliding=("x0", "y0")
        )
        seen[name] = march(model, pulse, 0.1, 88)  # the echo of the far walls needs 2 * 5/1.1 = 9
    returned = {name: np.abs(seen[name] - seen["far"]).max() / np.abs(seen["far"]).max() for name in cases}
    assert returned["dashpots"] < 0.13
    assert returned["springs"] < 0.045
    assert returned["closed"] > 0.3


@pytest.mark.slow
def test_sliding_on_oblique_planes_is_sliding_on_turned_axes():
    mesh = box([0, 0.5, 1], [0, 0.5, 1], [0, 1, 2])
    arguments = {"fixed": "z0", "sliding": ("x0", "y0"), "ports": {"contact": "contact"}}
    straight, oblique = (assemble(m, STEEL, **arguments) for m in (mesh, turned(mesh)))
    assert oblique.size == straight.size
    assert compliance(oblique) == pytest.approx(compliance(straight), rel=1e-9)
    shapes = [m.expand(sparse.linalg.spsolve(m.K.tocsc(), m.port_matrix[:, 0])) for m in (straight, oblique)]
    assert np.allclose(shapes[1], TURN @ shapes[0], atol=1e-9 * np.abs(shapes[0]).max())
    for a in (oblique.K, oblique.M):
        assert abs(a - a.T).max() == 0.0
    nodal = assemble(turned(mesh), STEEL, mass="nodal", **arguments)
    assert nodal.M.nnz == nodal.size


@pytest.mark.slow
def test_a_quarter_with_copies_is_the_whole():
    whole = assemble(box(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5), [0, 1, 2]), STEEL, fixed="z0")
    quarter = box([0, 0.5, 1], [0, 0.5, 1], [0, 1, 2])
    sector = assemble(quarter, STEEL, fixed="z0", sliding=("x0", "y0"), copies=4)
    assert sector.ports["contact"].area == pytest.approx(1.0, rel=1e-12)
    assert sector.ports["contact"].impedance == pytest.approx(whole.ports["contact"].impedance, rel=1e-12)
    assert compliance(sector) == pytest.approx(compliance(whole), rel=1e-9)
    for s in (0.0, 3e4, 1e5):  # the transform of g at real s
        values = []
        for model in (whole, sector):
            b = model.port_matrix[:, 0]
            values.append(b @ sparse.linalg.spsolve((model.K + s**2 * model.M).tocsc(), b))
        assert values[1] == pytest.approx(values[0], rel=1e-9)


@pytest.mark.slow
def test_symmetric_and_antisymmetric_halves_hold_all_frequencies_of_the_whole():
    whole, half = (turned(box(x, [0, 0.8], [0, 1, 2])) for x in ([-1, 0, 1], [0, 1]))

    def squares(mesh, **held):
        model = assemble(mesh, STEEL, fixed="z0", ports={"top": "z1"}, **held)
        return eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)

    both = np.concatenate([squares(half, sliding="x0"), squares(half, antisymmetric="x0")])
    assert np.sort(both)[:12] == pytest.approx(squares(whole)[:12], rel=1e-8)


def test_bad_supports():
    with pytest.raises(ModelError, match=r"Foundation\('z0'\): normal = -1"):
        Foundation("z0", -1.0)
    mesh = box([0, 1], [0, 1], [0, 1])
    with pytest.raises(ModelError, match=r"Absorbing:.*'wall'.*x0"):
        assemble(mesh, STEEL, fixed=(), supports=(Absorbing("wall"),), ports={"top": "z1"})
    with pytest.raises(ModelError, match="nothing is left to move"):
        assemble(box([0, 1], [0, 1], [0, 1], 1), STEEL, fixed=("x0", "x1"), ports={"top": "z1"})
