"""Compiles what numba compiles, once, before several processes would: the march, bodies, batches, fatigue, elements."""

import numpy as np
import skfem

import impact
import seatfem
from impact.life.damage import rainflow
from impact.life.multiaxial import DangVan, Papadopoulos

STEP, DURATION = 1e-7, 2e-6
STEEL = seatfem.Material(young=2e11, poisson=0.3, density=7850.0)


def march() -> None:
    """Compile one contact by poles and by step weights, with a film, two contacts, many scenes, stresses."""
    reed = {"young": 2e11, "density": 7850.0, "length": 25e-3, "width": 1e-2, "thickness": 3e-4, "tip_deflection": 1e-6}
    seat = impact.spring(stiffness=1e6)
    rod = impact.fixed_rod(young=2e11, density=7850.0, area=1e-6, length=1e-2, damping_ratio=0.1)
    tip = impact.cantilever_reed(**reed)
    for target in (seat, rod):
        problem = impact.ContactProblem(tip, target)
        result = impact.solve(problem, dt=STEP, duration=DURATION)
    impact.solve(problem, dt=STEP, duration=DURATION, engine="fft")
    beam = impact.Cantilever(*(reed[key] for key in ("young", "density", "length", "width", "thickness")))
    impact.reed_stress(result.force, STEP, tip, beam)
    thrown = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), seat, law=impact.Hertz(1e9))
    impact.solve_many(thrown, dt=STEP, duration=DURATION, velocities=[-1.0, -2.0])
    impact.solve(impact.ContactProblem(tip, seat, film=impact.SqueezeFilm(1e-16, 1e-6)), dt=STEP, duration=DURATION)
    both = impact.cantilever_reed(**reed, contact_at=(2e-2, 25e-3))
    contacts = [impact.Contact(seat, striker_port=port) for port in (0, 1)]
    impact.solve(impact.ContactProblem(both, contacts=contacts), dt=STEP, duration=DURATION)
    filmed = [impact.Contact(seat, striker_port=port, film=impact.SqueezeFilm(1e-16, 1e-6)) for port in (0, 1)]
    impact.solve(impact.ContactProblem(both, contacts=filmed), dt=STEP, duration=DURATION)


def elements() -> None:
    """Compile the elements of a block of tetrahedra and one of hexahedra, and the Green's function of the latter."""
    for kind, mass in ((skfem.MeshTet, "consistent"), (skfem.MeshHex, "nodal")):
        mesh = kind.init_tensor(*([0.0, 1e-2, 2e-2],) * 3)
        named = mesh.with_boundaries({"contact": lambda x: x[2] > 0.0199, "fixed": lambda x: x[2] < 1e-4})
        model = seatfem.assemble(named, STEEL, ports={"contact": "contact"}, mass=mass)
    seatfem.greens_function(model, bandwidth=1e5, duration=2e-5, tolerance=0.1)


def fatigue() -> None:
    """Compile the search for cycles, spheres and planes."""
    rainflow([0.0, 1.0])
    stress = np.random.default_rng(0).normal(size=(70, 6))
    DangVan(0.6, 1.0).value(stress)
    Papadopoulos(0.6, 1.0, tolerance=0.1).value(stress)


if __name__ == "__main__":
    march()
    fatigue()
    elements()
