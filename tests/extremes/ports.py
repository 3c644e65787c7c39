"""Ports almost at one place: nearly singular matrices, in the march and out of finite elements."""

from dataclasses import replace

import numpy as np

from impact import Body, Contact, ContactProblem, ModalGreens, Residual, Signorini, measures, rigid_mass, solve
from seatfem.structures.method import Aims
from seatfem.structures.model import Port, SecondOrderModel
from seatfem.structures.reduction.krylov import Krylov
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, swept, worst
from tests.rod_model import rod_model


def port_cells() -> tuple[Cell, ...]:
    """Return sweeps over distance and number of ports."""
    return (
        *swept("distance of two ports", [0.0, *(10.0**k for k in range(-16, 0))], near_ports),
        *swept("distance of two ports of elements", [0.0, *(10.0**k for k in range(-16, 0, 3))], near_element_ports),
        *swept("contacts almost at one place", [2, 4, 8, 16, 32, 64], crowd),
    )


def near_ports(distance: float) -> Finding:
    """A rod struck by two contacts whose ports differ by ``distance``: together they press as one (d'Alembert).

    20 modes leave 3e-5 of the impulse out.
    """
    greens = scenes.modal_rod(20)
    shapes = greens.shapes * (1 + distance * np.array([[0.0, 1.0]]))
    rest = greens.residual.shapes * np.ones((1, 2))
    two = ModalGreens(
        greens.omega, greens.zeta, shapes, Residual(rest, greens.residual.rates, np.zeros((2, 2))), ("a", "b")
    )
    seat, ball = Body(two), rigid_mass(mass=1.0, velocity=-1.0)
    result = solve(ContactProblem(ball, contacts=[Contact(seat, "a"), Contact(seat, "b")]), dt=1e-2, duration=4.0)
    one = scenes.run(ball, Body(greens), Signorini(), 1e-2, 400)
    error = abs(float(result.force.sum()) / float(one.force.sum()) - 1)
    inside = float(np.maximum(-result.gap, 0.0).max())
    off = scenes.relative(measures.impulse(one), scenes.FIRST_BLOW)
    pairs = (error, 1e-9 + 2 * distance), (inside, 1e-9 + 2 * distance), (off, 1e-4)
    return Finding(*worst(*pairs), note="impulse, penetration")


def crowd(contacts: float) -> Finding:
    """Many contacts are 1e-12 apart: forces never pull, none penetrates, together they press as one."""
    p = int(contacts)
    greens = scenes.modal_rod(20)
    spread = 1 + 1e-12 * np.arange(p)
    rest = Residual(greens.residual.shapes * np.ones((1, p)), greens.residual.rates, np.zeros((p, p)))
    names = tuple(str(k) for k in range(p))
    seat = Body(ModalGreens(greens.omega, greens.zeta, greens.shapes * spread, rest, names))
    ball = rigid_mass(mass=1.0, velocity=-1.0)
    result = solve(ContactProblem(ball, contacts=[Contact(seat, k) for k in range(p)]), dt=1e-2, duration=4.0)
    one = scenes.run(ball, Body(greens), Signorini(), 1e-2, 400)
    error = abs(float(result.force.sum()) / float(one.force.sum()) - 1)
    inside = float(np.maximum(-result.gap, 0.0).max())
    off = scenes.relative(measures.impulse(one), scenes.FIRST_BLOW)
    pairs = (error, 1e-9), (inside, 1e-9), (-float(result.force.min()), 1e-9), (off, 1e-4)
    return Finding(*worst(*pairs), note="impulse, penetration, pull")


def near_element_ports(distance: float) -> Finding:
    """A rod of elements with a port at its end and one that takes a share ``distance`` of its middle instead.

    Static compliance 1, 1 - d/2, 1 - d + d^2/2 in closed form: its smaller eigenvalue, d^2/8, must not turn negative.
    A mass on both: d'Alembert's impulse, to the band and to d/2.
    """
    model = _twice_held(distance)
    greens = Krylov().reduce(model, model.damping, Aims(5.0, 4.0, 1e-3)).greens
    static = greens.static_compliance()
    exact = np.array([[1.0, 1 - distance / 2], [1 - distance / 2, 1 - distance + distance**2 / 2]])
    seat = Body(greens)
    problem = ContactProblem(rigid_mass(mass=1.0, velocity=-1.0), contacts=[Contact(seat, "a"), Contact(seat, "b")])
    result = solve(problem, dt=1e-3, duration=4.0)
    impulse = float(result.force.sum()) * result.dt
    return Finding(
        *worst(
            (float(np.abs(static - exact).max()), 1e-9),
            (max(-float(np.linalg.eigvalsh(static)[0]), 0.0), 1e-14),
            (float(np.maximum(-result.gap, 0.0).max()), 1e-9),
            (scenes.relative(impulse, scenes.FIRST_BLOW), 2e-3 + distance / 2),
        ),
        scenes.said(result),
        "static compliance, impulse, penetration",
    )


def _twice_held(distance: float) -> SecondOrderModel:
    model = rod_model(young=1.0, density=1.0, area=1.0, length=1.0, elements=40)
    end = model.ports["contact"].vector
    middle = -np.isclose(model.dofs.points[0][model.dofs.free], 0.5).astype(float)
    ports = {"a": Port(end, 1.0, 1.0), "b": Port((1 - distance) * end + distance * middle, 1.0, 1.0)}
    return replace(model, ports=ports)
