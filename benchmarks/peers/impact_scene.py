"""One impact for all peers: a rigid mass on the lip of the demo's seat through a linear spring; what is read off it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact import ContactProblem, ImpactResult, LinearSpring, ModalGreens, rigid_mass, solve
from impact.after.histories import averaged
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.shapes import AnnularSeat

STEEL = Material(200e9, 0.3, 7850.0)
MASS, SPEED, STIFFNESS = 20e-3, 1.0, 2e9  # kg, m/s, N/m: the spring is about as stiff as the seat
DURATION, WIDTH = 20e-6, 2e-6  # of the record and of the Hann window over the force [s]
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """Mean contact force of the steps that end at dt, 2 dt, ... [N], and the processor seconds it took."""

    force: Array
    dt: float
    seconds: float


def mesh() -> Any:
    """Straight tetrahedra of the demo's shape."""
    return make_mesh(AnnularSeat(), MeshSpec(5e-3, 2.5e-3, curved=False)).mesh


def seat(of: Any) -> SecondOrderModel:
    """Of steel, undamped, clamped below, with ten nodes an element."""
    return assemble(of, STEEL, order=2)


def reduced(model: SecondOrderModel, tolerance: float) -> ModalGreens:
    """The seat's Green's function for this record and window."""
    found = greens_function(model, bandwidth=1 / WIDTH, duration=1.2 * DURATION, tolerance=tolerance)
    assert isinstance(found, ModalGreens)
    return found


def impact_of(greens: ModalGreens, dt: float) -> ImpactResult:
    """The mass on it."""
    problem = ContactProblem(rigid_mass(mass=MASS, velocity=-SPEED), greens, law=LinearSpring(STIFFNESS))
    return solve(problem, dt=dt, duration=DURATION)


def course(result: ImpactResult, seconds: float) -> Course:
    """The force of a result of ours."""
    return Course(result.force[1:], result.dt, seconds)


def of_points(force: Array, dt: float, seconds: float) -> Course:
    """Of a peer that gives the force at dt, 2 dt, ... [N], linear between them and zero before: its means by steps."""
    return Course((force + np.concatenate([[0.0], force[:-1]])) / 2, dt, seconds)


def filtered(one: Course, times: Array) -> Array:
    """The force [N] averaged by a Hann window of `WIDTH`, read at ``times``."""
    smooth = averaged(one.force, one.dt, WIDTH, "hann")
    return np.interp(times, one.dt * np.arange(len(smooth)), smooth)


def impulse(one: Course) -> float:
    """N s."""
    return float(one.force.sum()) * one.dt


def contact_duration(one: Course) -> float:
    """From the first to the last force [s], its end where the falling force of the last steps meets zero."""
    closed = np.flatnonzero(one.force > 1e-6 * one.force.max())
    last = closed[-1]
    slope = one.force[last - 1] - one.force[last]
    return float(one.dt * (last + 0.5 + (one.force[last] / slope if slope > 0 else 0.5)))


def apart(one: Course, truth: Course) -> tuple[float, float, float, float]:
    """Relative differences [%]: filtered force, largest over its peak; its peak; impulse; contact duration."""
    times = np.linspace(0, DURATION, 401)
    a, b = filtered(one, times), filtered(truth, times)
    whole = np.abs(a - b).max() / b.max()
    pairs = ((a.max(), b.max()), *((f(one), f(truth)) for f in (impulse, contact_duration)))
    return (100 * float(whole), *(100 * (float(x) / float(y) - 1) for x, y in pairs))
