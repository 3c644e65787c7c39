"""Bodies that are the same in other words, and bodies alike in themselves: free, symmetric, of several regions."""

import math
from typing import Any

import numpy as np
from scipy import linalg

from impact import Body, Signorini, measures, rigid_mass
from impact.greens.base import Array
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.method import Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import named
from seatfem.structures.reduction.krylov import Krylov
from seatfem.structures.reduction.modes import solve_modes
from seatfem.units import parse_quantity
from tests.extremes import scenes
from tests.extremes.blocks import box
from tests.extremes.cell import Cell, Finding, chosen, swept, worst
from tests.rod_model import rod_model

_REDUCTIONS = ("krylov", "second_order")
STEEL = {
    "SI": ("200e9 Pa", "7850 kg/m^3"),
    "mm, t, s": ("200000 N/mm^2", "7.85e-9 t/mm^3"),
    "cm, g, s": ("2e12 dyn/cm^2", "7.85 g/cm^3"),
    "mm, kg, ms": ("200 GPa", "7.85e-6 kg/mm^3"),
}


def alike_cells() -> tuple[Cell, ...]:
    """Return free bodies, repeated eigenvalues, systems of units."""
    return (
        *swept("free rod, time / transit", [10.0**k for k in range(-1, 7)], free_rod),
        *swept("mass of striker / free rod", [10.0**k for k in range(-8, 9)], struck_free_rod),
        *swept("mass of striker / free rod of elements", [10.0**k for k in range(0, 9, 2)], struck_free_elements),
        *swept("free block struck at a corner, time / transit", [10.0**k for k in range(1, 7)], free_block),
        *chosen("repeated eigenvalues", symmetric_block, ("modes", "response", *_REDUCTIONS)),
        *chosen("units of a finite element seat", unit_systems, ("SI", "mm, t, s", "m, kg, us")),
        *chosen("one steel, stated twice", twice_stated, tuple(STEEL)),
    )


def free_block(time: float) -> Finding:
    """A free block pushed off its centre flies and turns: S -> t^2/2 (1/m + (a_x^2 + a_y^2)/I), I = m (3^2 + 1)/12.

    What bends and yields at the corner is left out: below 6 times 1/(E side), 32/t^2 of S.
    """
    mesh = _with_corner(box((1.0, 1.0, 3.0), (2, 2, 3), hexes=True))
    model = assemble(mesh, Material(1.0, 0.3, 1.0), fixed=(), ports={"contact": "corner"})
    greens = Krylov().reduce(model, model.damping, Aims(0.5, 10.0, 1e-2)).greens
    mass, inertia, arm = 3.0, 3.0 * (9.0 + 1.0) / 12, 0.25
    exact = time**2 / 2 * (1 / mass + 2 * arm**2 / inertia)
    return Finding(scenes.relative(float(greens.step_response(time)), exact), 32 / time**2 + 1e-6, (), "S(t)")


def twice_stated(units: str) -> Finding:
    """A block of two regions, the lower in SI, the upper in other units, is the block of one material."""
    mesh = box((0.01, 0.01, 0.02), (2, 2, 4), hexes=True)
    two = mesh.with_subdomains({"low": lambda x: x[2] < 0.01, "high": lambda x: x[2] > 0.01})
    one, other = _steel("SI"), _steel(units)
    ours, exact = _block_step(two, {"low": one, "high": other}), _block_step(mesh, one)
    return Finding(float(np.abs(ours / exact - 1).max()), 1e-9, (), "S(t)")


def _steel(units: str) -> Material:
    young, density = STEEL[units]
    return Material(parse_quantity(young, "pressure"), 0.3, parse_quantity(density, "density"))


def _block_step(mesh: Any, material: Any) -> Array:
    model: SecondOrderModel = assemble(mesh, material, fixed="fixed", ports={"contact": "contact"})
    greens = Krylov().reduce(model, model.damping, Aims(1e5, 1e-4, 1e-2)).greens
    return np.asarray(greens.step_response(np.linspace(1e-5, 1e-4, 10)))


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


def unit_systems(name: str) -> Finding:
    """One seat in three systems of units has one step response in SI, to round-off of the eigensolver."""
    length, mass, time = {"SI": (1.0, 1.0, 1.0), "mm, t, s": (1e3, 1e-3, 1.0), "m, kg, us": (1.0, 1.0, 1e6)}[name]
    ours, exact = (_step_in(*units) for units in ((length, mass, time), (1.0, 1.0, 1.0)))
    ours = ours * mass / time**2  # compliance: length per force
    return Finding(float(np.abs(ours / exact - 1).max()), 1e-7, (), "S(t)")


def _step_in(length: float, mass: float, time: float) -> Array:
    side = 0.01 * length
    mesh = box((side, side, 2 * side), (2, 2, 3), hexes=True)
    young, density = 2e11 * mass / (length * time**2), 7800.0 * mass / length**3
    model = assemble(mesh, Material(young, 0.3, density), fixed="fixed", ports={"contact": "contact"})
    greens = Krylov().reduce(model, model.damping, Aims(1e5 / time, 1e-4 * time, 1e-2)).greens
    return np.asarray(greens.step_response(np.linspace(1e-5, 1e-4, 10) * time))


def free_rod(time: float) -> Finding:
    """A free rod by elements and Krylov vectors has d'Alembert's S(t), and late the flight t^2/(2 m) of the whole."""
    model = rod_model(young=1.0, density=1.0, area=1.0, length=1.0, elements=60, fixed_end=False)
    greens = Krylov().reduce(model, model.damping, Aims(10.0, 4.0, 1e-3)).greens
    ours = float(greens.step_response(time))
    exact = float(scenes.FREE_ROD.step_response(time))
    return Finding(scenes.relative(ours, exact), 2e-2 if time < 1 else 1e-3, (), "S(t)")


def struck_free_rod(ratio: float) -> Finding:
    """A mass on a free rod has N = Z v exp(-Z t/m) until the wave is back after two transits; they part for good.

    Impulse m v (1 - exp(-2/m)): the rod's end moves on at twice that speed or more. A light mass is watched for 40 m/Z.
    """
    span, n = min(2.5, 40 * ratio), 4000
    result = scenes.run(rigid_mass(mass=ratio, velocity=-1.0), Body(scenes.FREE_ROD), Signorini(), span / n, n)
    exact = -ratio * math.expm1(-min(span, 2.0) / ratio)
    return Finding(scenes.relative(measures.impulse(result), exact), 1e-6, scenes.said(result), "impulse")


def struck_free_elements(ratio: float) -> Finding:
    """A rod of finite elements with its rigid mode does the same to masses that meet its low modes."""
    model = rod_model(young=1.0, density=1.0, area=1.0, length=1.0, elements=60, fixed_end=False)
    greens = Krylov().reduce(model, model.damping, Aims(10.0, 4.0, 1e-3)).greens
    result = scenes.run(rigid_mass(mass=ratio, velocity=-1.0), Body(greens), Signorini(), 1e-3, 3000)
    exact = -ratio * math.expm1(-2 / ratio)
    return Finding(scenes.relative(measures.impulse(result), exact), 1e-2, scenes.said(result), "impulse")


def _with_corner(mesh: Any) -> Any:
    top = float(mesh.p[2].max())
    return mesh.with_boundaries({"corner": lambda x: (x[2] > top - 1e-9) & (x[0] < 0.5) & (x[1] < 0.5)})
