"""Seats in section and from CAD, and a ring along its radius, by scikit-fem, as engineers would write them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

Array = NDArray[np.float64]
Number = Callable[[Any], float]


def seat_modes(table: dict[str, Any], number: Number, count: int, highest: float) -> tuple[Array, Array, float]:
    """Return angular frequencies, mean displacements of the lip and its static compliance, of the seat's section.

    Quadrilaterals of the second order about the axis; the lip is sqrt(``count``/2) elements wide, others grow from it.
    """
    bore, lip, height, outer, thickness = (
        number(table[key]) for key in ("bore_radius", "lip_width", "lip_height", "outer_radius", "thickness")
    )
    fine = round(math.sqrt(count / 2))
    size = lip / fine
    radii = np.concatenate([np.linspace(bore, bore + lip, fine + 1), graded(bore + lip, outer, size)])
    levels = np.concatenate([thickness - graded(0.0, thickness, size)[::-1], [thickness]])
    levels[0] = 0.0
    levels = np.concatenate([levels, thickness + np.linspace(0, height, max(1, round(height / size)) + 1)[1:]])
    mesh = skfem.MeshQuad.init_tensor(radii, levels)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.remove_elements(np.flatnonzero((middle[0] > bore + lip) & (middle[1] > thickness)))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=5)
    young, poisson, density = (number(table["material"][key]) for key in ("young", "poisson", "density"))
    shear, first = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))

    def strains(u: Any, r: Any) -> tuple[Any, ...]:
        return u.grad[0, 0], u[0] / r, u.grad[1, 1], u.grad[0, 1] + u.grad[1, 0]

    @skfem.BilinearForm
    def stiffness(u: Any, v: Any, w: Any) -> Any:
        a, b = strains(u, w.x[0]), strains(v, w.x[0])
        energy = first * sum(a[:3]) * sum(b[:3]) + shear * a[3] * b[3]
        return 2 * np.pi * w.x[0] * (energy + 2 * shear * sum(x * y for x, y in zip(a[:3], b[:3], strict=True)))

    @skfem.BilinearForm
    def inertia(u: Any, v: Any, w: Any) -> Any:
        return 2 * np.pi * w.x[0] * density * dot(u, v)

    top = mesh.facets_satisfying(lambda x: np.abs(x[1] - thickness - height) < 1e-9)
    area = math.pi * ((bore + lip) ** 2 - bore**2)
    mean = skfem.LinearForm(lambda v, w: 2 * np.pi * w.x[0] * v[1] / area).assemble(basis.boundary(top))
    free = basis.complement_dofs(basis.get_dofs(lambda x: x[1] < 1e-9))
    K, M = (form.assemble(basis)[free][:, free].tocsc() for form in (stiffness, inertia))
    squares, vectors = eigsh(K, min(count, len(free) // 3), M, sigma=0)
    kept = squares < highest**2
    return np.sqrt(squares[kept]), mean[free] @ vectors[:, kept], float(mean[free] @ splu(K).solve(mean[free]))


def cad_seat_modes(table: dict[str, Any], number: Number, count: int, highest: float) -> tuple[Array, Array, float]:
    """Return angular frequencies, mean displacements of the lip and its static compliance, by a quarter of a part.

    The part is symmetric about x = 0 and y = 0, clamped on its underside and struck on its highest face. Tetrahedra of
    the second order, on the lip as many to a millimetre as `seat_modes` has on its lip, growing from it.
    """
    size = 1e-3 / round(math.sqrt(count / 2))
    mesh = quarter_mesh(table["file"], size)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()), intorder=3)
    young, poisson, density = (number(table["material"][key]) for key in ("young", "poisson", "density"))
    shear, first = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    inertia = skfem.BilinearForm(lambda u, v, _: 4 * density * dot(u, v))
    fine = skfem.Basis(mesh, basis.elem, intorder=4)
    top = mesh.facets_satisfying(lambda x: np.abs(x[2] - mesh.p[2].max()) < 1e-9)
    face = basis.boundary(top)
    area = skfem.Functional(lambda w: np.ones_like(w.x[0])).assemble(face)
    mean = skfem.LinearForm(lambda v, _: v[2] / area).assemble(face)
    held = [basis.get_dofs(lambda x: np.abs(x[2]) < 1e-9).all()]
    for axis in range(2):
        plane = basis.get_dofs(lambda x, axis=axis: np.abs(x[axis]) < 1e-9)
        held.append(plane.all(f"u^{axis + 1}"))
    free = basis.complement_dofs(np.unique(np.concatenate(held)))
    K = skfem.BilinearForm(lambda u, v, w: 4 * linear_elasticity(first, shear).form(u, v, w)).assemble(basis)
    K, M = (matrix[free][:, free].tocsc() for matrix in (K, inertia.assemble(fine)))
    factor = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(K.shape, factor.solve, dtype=float)
    squares, vectors = eigsh(K, min(count, len(free) // 3), M, sigma=0, OPinv=inverse)
    kept = squares < highest**2
    return np.sqrt(squares[kept]), mean[free] @ vectors[:, kept], float(mean[free] @ factor.solve(mean[free]))


def quarter_mesh(file: str, size: float) -> skfem.MeshTet:
    """Return tetrahedra [m] of the quarter x, y > 0 of a part in millimetres, of this size [m] at its highest face."""
    gmsh.initialize()
    try:
        gmsh.option.set_number("General.Verbosity", 1)
        gmsh.model.occ.import_shapes(file)
        box = gmsh.model.occ.add_box(0, 0, -1e3, 1e3, 1e3, 2e3)
        gmsh.model.occ.intersect(gmsh.model.occ.get_entities(3)[:1], [(3, box)])
        gmsh.model.occ.synchronize()
        heights = {tag: gmsh.model.get_bounding_box(2, tag)[2::3] for _, tag in gmsh.model.get_entities(2)}
        highest = max(bottom for bottom, _ in heights.values())
        faces = [tag for tag, (bottom, _) in heights.items() if bottom > highest - 1e-3]
        distance, field = gmsh.model.mesh.field.add("Distance"), gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.set_numbers(distance, "SurfacesList", faces)
        gmsh.model.mesh.field.set_number(distance, "Sampling", 60)
        gmsh.model.mesh.field.set_string(field, "F", f"{1e3 * size} + 0.35*F{distance}")
        gmsh.model.mesh.field.set_as_background_mesh(field)
        gmsh.option.set_number("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.model.mesh.generate(3)
        tags, places, _ = gmsh.model.mesh.get_nodes()
        corners = gmsh.model.mesh.get_elements_by_type(4)[1].reshape(-1, 4)
    finally:
        gmsh.finalize()
    used, cells = np.unique(corners, return_inverse=True)
    order = np.argsort(tags)
    points = places.reshape(-1, 3)[order[np.searchsorted(tags[order], used)]]
    return skfem.MeshTet(1e-3 * points.T.copy(), cells.reshape(-1, 4).T.copy())


def graded(start: float, end: float, size: float, growth: float = 1.35) -> Array:
    """Return places after ``start`` up to ``end`` whose distances grow from about ``size``."""
    steps = [size]
    while sum(steps) < end - start:
        steps.append(steps[-1] * growth)
    return np.asarray(start + np.cumsum(steps) * (end - start) / sum(steps))


def sprung_ring_modes(
    scene: dict[str, Any], number: Number, count: int, highest: float
) -> tuple[Array, Array, Array, Array, float]:
    """Return angular frequencies, contact, rates, constant forces, and what modes left out yield, of a sprung ring.

    Mindlin's annular plate in bending about the axis, elements of the second order along the radius; springs stand
    evenly on a circle, the mean one unless stated.
    """
    reed, springs = scene["reed"], scene.get("spring", [])
    inner, outer = number(reed["inner_diameter"]) / 2, number(reed["outer_diameter"]) / 2
    young, poisson, density = (number(reed["material"][key]) for key in ("young", "poisson", "density"))
    h, at, width = (number(reed[key]) for key in ("thickness", "contact_radius", "contact_width"))
    circles = [number(spring.get("radius", (inner + outer) / 2)) for spring in springs]
    marks = [inner, at - width / 2, at, at + width / 2, outer, *circles]
    places = np.unique(np.round(np.concatenate([marks, np.linspace(inner, outer, 2 * count + 1)]), 12))
    mesh = skfem.MeshLine(places)
    basis = skfem.Basis(mesh, skfem.ElementLineP2() * skfem.ElementLineP2(), intorder=4)
    bending, shear = young * h**3 / (12 * (1 - poisson**2)), 5 / 6 * young / (2 * (1 + poisson)) * h

    @skfem.BilinearForm
    def stiffness(u: Any, a: Any, v: Any, b: Any, w: Any) -> Any:
        r, da, db = w.x[0], a.grad[0], b.grad[0]
        bent = da * db + a * b / r**2 + poisson * (da * b + a * db) / r
        return 2 * np.pi * r * (bending * bent + shear * (u.grad[0] - a) * (v.grad[0] - b))

    @skfem.BilinearForm
    def inertia(u: Any, a: Any, v: Any, b: Any, w: Any) -> Any:
        return 2 * np.pi * w.x[0] * density * (h * u * v + h**3 / 12 * a * b)

    @skfem.LinearForm
    def mean(v: Any, b: Any, w: Any) -> Any:
        return 2 * np.pi * w.x[0] * v * (np.abs(w.x[0] - at) < width / 2)

    K, M, contact = stiffness.assemble(basis).toarray(), inertia.assemble(basis).toarray(), mean.assemble(basis)
    contact /= math.pi * ((at + width / 2) ** 2 - (at - width / 2) ** 2)
    forces = np.zeros_like(contact)
    deflections = basis.nodal_dofs[0]
    for spring, radius in zip(springs, circles, strict=True):
        node = deflections[int(np.argmin(np.abs(mesh.p[0] - radius)))]
        stiff, preload, gap = number(spring["stiffness"]), number(spring.get("preload", 0)), scene["contact"]["gap"]
        K[node, node] += stiff
        forces[node] -= preload + stiff * number(gap)  # the preload is that on the closed ring, a gap below
    squares, vectors = eigh(K, M, subset_by_value=[-np.inf, highest**2])
    rates = np.zeros(len(squares))
    if "velocity" in reed:
        lifted = np.zeros(len(K))
        lifted[deflections[0]], lifted[basis.split_indices()[0]] = 1.0, 1.0
        rates = number(reed["velocity"]) * (vectors.T @ (M @ lifted))
    shift, shapes = squares[1], vectors.T @ contact  # far below the modes left out, so that they yield as at rest
    whole = float(contact @ np.linalg.solve(K + shift * M, contact))
    left = whole - float(shapes**2 @ (1 / (squares + shift)))
    return np.sqrt(np.maximum(squares, 0)), shapes, rates, vectors.T @ forces, left
