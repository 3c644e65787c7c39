"""An annular seat in section and a ring along its radius by scikit-fem, as an engineer would write them himself."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh, splu
from skfem.helpers import dot

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
    squares, vectors = squares[kept], vectors[:, kept]
    return np.sqrt(squares), mean[free] @ vectors, float(mean[free] @ splu(K).solve(mean[free]))


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
