"""Beams, the half-space and small finite element models at the ends of shape, Poisson's ratio, element quality, time
and symmetry."""

from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import splu
from skfem.helpers import ddot, div, sym_grad

from impact import Cantilever, TimoshenkoCantilever, half_space_patch
from seatfem.structures.reduction.greens import named
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, chosen, swept, worst
from tests.rod_model import rod_model
from tests.solids import Aims, Krylov, Material, SecondOrderModel, assemble, factorize, solve_modes

SIDES = ("left", "right", "front", "back")
NUS = (0.0, 1e-9, 0.25, 0.4, 0.45, 0.49, 0.499, 0.4999)


def solid_cells() -> tuple[Cell, ...]:
    """Return sweeps over shapes, materials and meshes."""
    lengths = [10.0**k for k in range(-3, 4)]
    return (
        *swept("length / thickness, Euler-Bernoulli", lengths, slender_beam),
        *swept("length / thickness, Timoshenko", lengths, stubby_beam),
        *swept("length / width of a 3-D bar", lengths, solid_bar),
        *swept("Poisson's ratio, half-space", [*NUS, 0.5], half_space),
        *swept("Poisson's ratio, guided column", NUS, guided_column),
        *swept("Poisson's ratio, bonded block", NUS, bonded_block),
        *swept("height of the flattest elements", [0.0, *(10.0**k for k in range(-14, 1, 2))], slivers),
        *swept("elements across the patch", [1, 2, 3], patch_elements),
        *swept("free rod, time / transit", [10.0**k for k in range(-1, 7)], free_rod),
        *chosen("repeated eigenvalues", symmetric_block, ("modes", "response", "krylov", "second_order")),
    )


def slender_beam(ratio: float) -> Finding:
    """The tip's sum of phi^2/w^2 over 60 modes is L^3/(3 EI) to 4.1e-2/n^3 (the modes' sum rule)."""
    beam = Cantilever(young=2e11, density=7800.0, length=ratio * 1e-3, width=1e-2, thickness=1e-3)
    modes = beam.modes(60)
    total = float(np.sum(modes.deflection(beam.length) ** 2 / modes.omega**2))
    exact = beam.length**3 / (3 * 2e11 * 1e-2 * 1e-9 / 12)
    return Finding(scenes.relative(total, exact), 1e-6, (), "static tip compliance by modes")


def stubby_beam(ratio: float) -> Finding:
    """The tip with shear and rotary inertia has L^3/(3 EI) + L/(kappa A G); n modes leave out less than 0.5/n."""
    beam = TimoshenkoCantilever(young=2e11, density=7800.0, length=ratio * 1e-3, width=1e-2, thickness=1e-3)
    modes = beam.modes(60)
    total = float(np.sum(modes.deflection(beam.length) ** 2 / modes.omega**2))
    exact = beam.length**3 / (3 * 2e11 * 1e-2 * 1e-9 / 12) + beam.length / beam.shear_rigidity
    return Finding(scenes.relative(total, exact), 0.5 / 60, (), "static tip compliance by modes")


def solid_bar(ratio: float) -> Finding:
    """A bar with nu = 0 pulled at its end is l/(E A) soft, in whatever elements: any stretching of them."""
    mesh = box((1.0, 1.0, ratio), (2, 2, 4), hexes=True)
    model = assemble(mesh, Material(1.0, 0.0, 1.0), fixed="fixed", ports={"contact": "contact"})
    return Finding(scenes.relative(compliance(model), ratio), 1e-9 * max(ratio, 1 / ratio), (), "static compliance")


def half_space(nu: float) -> Finding:
    """g from its own series integrates over the crossing time to the static compliance; g(0+) = 1/(rho c_p A)."""
    patch = half_space_patch(young=1.0, poisson=nu, density=1.0, radius=1.0)
    t = np.linspace(0.0, patch.crossing_time * 1.01, 400_001)
    g = patch.impulse_response(t)
    total = float(np.sum((g[1:] + g[:-1]) / 2) * t[1])
    errors = [scenes.relative(total, float(patch.static_compliance()[0, 0]))]
    start = float(patch.initial_value()[0, 0])
    if nu < 0.5:
        errors.append(scenes.relative(float(patch.impulse_response(0.0)), start))
    return Finding(max(errors), 1e-5, (), "integral of g, g(0+)")


def guided_column(nu: float) -> Finding:
    """A column between smooth walls is l/((lambda + 2 mu) A) soft for any Poisson ratio, at most twice in time."""
    material = Material(1.0, nu, 1.0)
    lam, mu = material.lame
    mesh = box((1.0, 1.0, 2.0), (2, 2, 6), hexes=True)
    model = assemble(mesh, material, fixed="fixed", sliding=SIDES, ports={"contact": "contact"})
    static = scenes.relative(compliance(model), 2.0 / (lam + 2 * mu))
    t = np.linspace(0.0, 8.0, 9)
    greens = Krylov().reduce(model, model.damping, Aims(1.0, 8.0, 1e-3)).greens
    bounded = float(np.abs(greens.step_response(t)).max()) * (lam + 2 * mu) / 2.0  # twice the static one at most
    return Finding(max(static, bounded - 2.0 if bounded > 2.1 else 0.0), 1e-9 / (0.5 - nu), (), "static compliance")


def bonded_block(nu: float) -> Finding:
    """A block bonded to its base does not lock: displacement and pressure as separate unknowns give the same.

    The reference is a mixed element (quadratic displacement, linear pressure) on the same mesh; five cells across leave
    2.3 % between them where the solid hardly changes its volume.
    """
    mesh = box((2.0, 2.0, 0.5), (5, 5, 2), hexes=False)
    material = Material(1.0, nu, 1.0)
    model = assemble(mesh, material, fixed="fixed", ports={"contact": "contact"}, order=2)
    stated = 5e-3 if nu <= 0.45 else 0.03
    error = scenes.relative(compliance(model), _mixed_compliance(mesh, material))
    return Finding(error, stated, (), "static compliance")


def slivers(height: float) -> Finding:
    """Patch test: uniform strain is exact however flat the elements, to eps/height; height 0 is no solid.

    And the column's lowest frequency, (pi/2) sqrt((lambda + 2 mu)/rho)/l: three quadratic elements leave 7e-4 at most.
    """
    mesh = box((1.0, 1.0, 1.0), (3, 3, 3), hexes=False)
    points = mesh.p.copy()
    low = np.isclose(points[2], 1 / 3)
    points[2, low] = height / 3
    mesh = skfem.MeshTet(points, mesh.t, _boundaries=mesh.boundaries)
    material = Material(1.0, 0.3, 1.0)
    lam, mu = material.lame
    model = assemble(mesh, material, fixed="fixed", sliding=SIDES, ports={"contact": "contact"}, order=2)
    static = scenes.relative(compliance(model), 1 / (lam + 2 * mu))
    lowest = scenes.relative(float(solve_modes(model, 1).omega[0]), np.pi / 2 * np.sqrt(lam + 2 * mu))
    pairs = (static, 1e-12 + 1e-14 / max(height, 1e-300)), (lowest, 1e-3)
    return Finding(*worst(*pairs), note="static compliance, lowest frequency")


def patch_elements(number: float) -> Finding:
    """A square patch pressed on a block, 1 to 3 quadratic hexes wide, sinks as by scikit-fem's own assembly.

    The stress jumps at the edge of the patch: first order, squared in the energy but for the corners' share. Against
    1, 2 and 4 across, extrapolated (Aitken), it comes from below and is off by less than 0.08/n^1.5.
    """
    n = int(number)
    one, two, four = (compliance(_patch_model(k)) for k in (1, 2, 4))
    limit = four + (four - two) ** 2 / (2 * two - one - four)
    ours = compliance(_patch_model(n))
    expected = _plain_compliance(n)
    return Finding(
        *worst((scenes.relative(ours, expected), 1e-9), (scenes.relative(ours, limit), 0.08 / n**1.5)),
        note="static compliance",
    )


def free_rod(time: float) -> Finding:
    """A free rod by elements and Krylov vectors has d'Alembert's S(t), and late the flight t^2/(2 m) of the whole."""
    model = rod_model(young=1.0, density=1.0, area=1.0, length=1.0, elements=60, fixed_end=False)
    greens = Krylov().reduce(model, model.damping, Aims(10.0, 4.0, 1e-3)).greens
    ours = float(greens.step_response(time))
    exact = float(scenes.FREE_ROD.step_response(time))
    return Finding(scenes.relative(ours, exact), 2e-2 if time < 1 else 1e-3, (), "S(t)")


def symmetric_block(name: str) -> Finding:
    """A block of square section has pairs of equal frequencies, those of a dense solver for all eigenvalues."""
    mesh = _with_corner(box((1.0, 1.0, 2.0), (2, 2, 3), hexes=True))
    model = assemble(mesh, Material(1.0, 0.3, 1.0), fixed="fixed", ports={"contact": "corner"}, order=2)
    values, vectors = linalg.eigh(model.K.toarray(), model.M.toarray())
    omega = np.sqrt(values)
    if name == "modes":
        ours = solve_modes(model, 30).omega
        return Finding(float(np.abs(ours / omega[:30] - 1).max()), 1e-8, (), "30 lowest frequencies")
    b = model.port_matrix[:, 0]
    strength = (vectors.T @ b) ** 2
    t = np.linspace(0.0, 20.0, 101)
    exact = np.sin(np.outer(t, omega)) / omega @ strength
    if name == "response":
        modes = solve_modes(model, len(values))
        ours = np.sin(np.outer(t, modes.omega)) / modes.omega @ (modes.shapes.T @ b) ** 2
        return Finding(float(np.abs(ours - exact).max() / np.abs(exact).max()), 1e-8, (), "g(t) by all modes")
    greens = named(name).reduce(model, model.damping, Aims(1.0, 20.0, 1e-3)).greens
    static = float(strength @ (1 / values))
    rise = (1 - np.cos(np.outer(t, omega))) / values @ strength
    return Finding(
        *worst(
            (scenes.relative(float(greens.static_compliance()[0, 0]), static), 1e-9),
            (float(np.abs(np.asarray(greens.step_response(t)) - rise).max() / rise.max()), 2e-3),
        ),
        note="static compliance, S(t)",
    )


def _patch_mesh(n: int) -> Any:
    mesh = box((3.0, 3.0, 1.5), (3 * n, 3 * n, 2 * n), hexes=True)
    return mesh.with_boundaries(
        {"patch": lambda x: (x[2] > 1.5 - 1e-9) & (np.abs(x[0] - 1.5) < 0.5) & (np.abs(x[1] - 1.5) < 0.5)}
    )


def _patch_model(n: int) -> SecondOrderModel:
    return assemble(_patch_mesh(n), Material(1.0, 0.3, 1.0), fixed="fixed", ports={"contact": "patch"}, order=2)


def _plain_compliance(n: int) -> float:
    """Return the same by scikit-fem's forms, facet integrals and boundary conditions; the patch is a unit square."""
    lam, mu = Material(1.0, 0.3, 1.0).lame
    u = skfem.Basis(_patch_mesh(n), skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    form = skfem.BilinearForm(lambda u, v, _: 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * div(u) * div(v))
    surface = skfem.FacetBasis(u.mesh, u.elem, facets=u.mesh.boundaries["patch"], intorder=4)
    load = skfem.asm(skfem.LinearForm(lambda v, _: v[2]), surface)
    free = np.setdiff1d(np.arange(u.N), u.get_dofs(u.mesh.boundaries["fixed"]).all())
    return float(load[free] @ splu(skfem.asm(form, u)[free][:, free].tocsc()).solve(load[free]))


def _mixed_compliance(mesh: Any, material: Material) -> float:
    """Return the mean displacement of "contact" per unit force by the Taylor-Hood pair, "fixed" held."""
    lam, mu = material.lame
    u = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()), intorder=4)
    p = u.with_element(skfem.ElementTetP1())
    surface = skfem.FacetBasis(mesh, u.elem, facets=mesh.boundaries["contact"], intorder=4)
    shear = skfem.asm(skfem.BilinearForm(lambda u, v, _: 2 * mu * ddot(sym_grad(u), sym_grad(v))), u)
    mixed = skfem.asm(skfem.BilinearForm(lambda u, q, _: -div(u) * q), u, p)
    mass = skfem.asm(skfem.BilinearForm(lambda p, q, _: p * q), p)
    soft = -mass / lam if lam > 0 else -1e12 * mass
    load = skfem.asm(skfem.LinearForm(lambda v, _: v[2]), surface)
    load = load / float(skfem.asm(skfem.Functional(lambda _: 1.0 + 0 * _.x[0]), surface))
    held: NDArray[np.int64] = u.get_dofs(mesh.boundaries["fixed"]).all()
    free = np.setdiff1d(np.arange(u.N), held)
    system = sparse.bmat([[shear[free][:, free], mixed[:, free].T], [mixed[:, free], soft]]).tocsc()
    right = np.concatenate([load[free], np.zeros(p.N)])
    return float(load[free] @ splu(system).solve(right)[: len(free)])


def _with_corner(mesh: Any) -> Any:
    top = float(mesh.p[2].max())
    return mesh.with_boundaries({"corner": lambda x: (x[2] > top - 1e-9) & (x[0] < 0.5) & (x[1] < 0.5)})


def box(size: tuple[float, float, float], cells: tuple[int, int, int], *, hexes: bool) -> Any:
    """Return a box with its underside "fixed", its top "contact", and its four sides."""
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, cells, strict=True)]
    mesh = (skfem.MeshHex if hexes else skfem.MeshTet).init_tensor(*axes)
    edge = [1e-9 * s for s in size]
    return mesh.with_boundaries(
        {
            "fixed": lambda x: x[2] < edge[2], "contact": lambda x: x[2] > size[2] - edge[2],
            "left": lambda x: x[0] < edge[0], "right": lambda x: x[0] > size[0] - edge[0],
            "front": lambda x: x[1] < edge[1], "back": lambda x: x[1] > size[1] - edge[1],
        }
    )  # fmt: skip


def compliance(model: SecondOrderModel) -> float:
    """Return the static displacement of the first port per unit force on it."""
    b = model.port_matrix[:, 0]
    return float(b @ factorize(model.K).solve(b))
