"""The same impact on meshes that users have: what a step of CalculiX's direct dynamics costs, beside a scene of ours.

A whole scene of CalculiX takes up to a quarter of an hour there. So it runs the first steps alone, and the rest is
extrapolated from these: its times of whole scenes in the table before are proportional to the number of steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from benchmarks.peers import calculix, calculix_impact, plain_impact
from benchmarks.peers import impact_scene as scene
from benchmarks.peers.bodies import timed
from benchmarks.table import Table
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.shapes import AnnularSeat

SIZES: Final = (2.5e-3, 1.5e-3)  # of the elements [m]
STEPS: Final = (0.4e-6, 0.2e-6, 0.1e-6)  # of whole scenes [s]
RUN, FIRST, MORE = 0.2e-6, 4, 12  # step that is run [s], and how many of them, twice
TOLERANCE, STEP, FINE = 1e-2, 20e-9, 10e-9  # of our Green's function; of our march and of the reference [s]


@dataclass(frozen=True)
class Found:
    """Of one mesh: processor seconds of ours, and of CalculiX before its first step and for each; errors [%] of ours
    and of Newmark's rule in `STEPS`, as `scene.apart` gives; ``same``: CalculiX from that rule in what it ran [%].
    """

    unknowns: int
    ours: float
    start: float
    step: float
    our_errors: tuple[float, ...]
    errors: tuple[tuple[float, ...], ...]
    same: float

    def seconds(self, step: float) -> float:
        """Of a whole scene by CalculiX."""
        return self.start + self.step * scene.DURATION / step


def meshes_table() -> Table:
    """Our scenes whole, CalculiX's extrapolated."""
    found = [_found(make_mesh(AnnularSeat(), MeshSpec(size, size / 2, curved=False)).mesh) for size in SIZES]
    rows = [row for one in found for row in _rows(one)]
    within = " and ".join(_within(one) for one in found)
    same = ", ".join(f"{one.same:.2g} %" for one in found)
    notes = (
        f"The impact above on finer meshes. Ours: a first scene to a tolerance of {100 * TOLERANCE:g} %, the mean of "
        f"one before and one after CalculiX. CalculiX runs its first {FIRST} and its first {MORE} steps of "
        f"{1e9 * RUN:g} ns: what a step takes, and what comes before the first. **Its times of whole scenes are "
        "extrapolated from these**; in the table above they grow with the number of steps alone.\n\n"
        "Errors are from Newmark's trapezoidal rule on the whole mesh in steps of "
        f"{1e9 * FINE:g} ns; those in CalculiX's rows are of that rule in steps as long, from which its force differs "
        f"by {same} of the largest in the steps that it ran.\n\n"
        f"At equal accuracy, the filtered force within our tolerance of {100 * TOLERANCE:g} % of its peak at all "
        f"times: {within}. That step is read off a straight line through the errors on double logarithmic axes.",
    )
    columns = ("program", "unknowns", "step (ns)", "a step (s)", "scene (s)", "apart (%)", "peak (%)", "impulse (%)")
    return Table("The impact on finer meshes", notes, (*columns, "ratio"), tuple(rows))


def _found(mesh: Any) -> Found:
    model = scene.seat(mesh)
    truth, *coarse = (_by_newmark(model, step) for step in (FINE, *STEPS))
    mine, before = timed(lambda: _ours(mesh))
    first, more = (calculix_impact.march(model, RUN, count * RUN)[0] for count in (FIRST, MORE))
    _, after = timed(lambda: _ours(mesh))
    step = (more.seconds - first.seconds) / (MORE - FIRST)
    alike = coarse[STEPS.index(RUN)].force[:MORE]
    same = 100 * float(np.abs(more.force - alike).max() / np.abs(alike).max())
    errors = tuple(scene.apart(one, truth) for one in coarse)
    start = first.seconds - FIRST * step
    return Found(model.size, (before + after) / 2, start, step, scene.apart(mine, truth), errors, same)


def _ours(mesh: Any) -> scene.Course:
    """All that a first scene takes, from the mesh on."""
    return scene.course(scene.impact_of(scene.reduced(scene.seat(mesh), TOLERANCE), STEP), 0.0)


def _by_newmark(model: SecondOrderModel, step: float) -> scene.Course:
    """The trapezoidal rule on the whole mesh, with one factorization: no reduction, no contact algorithm."""
    [port] = model.ports.values()
    factor = factorize(model.M + step**2 / 4 * model.K)
    force = plain_impact.newmark(model.K, port.vector, step, factor, factor.solve(port.vector))
    return scene.of_points(force, step, 0.0)


def _rows(one: Found) -> Iterator[tuple[str, ...]]:
    """Ours, then CalculiX step by step."""
    yield ("ours", f"{one.unknowns}", f"{1e9 * STEP:g}", "", f"{one.ours:.2f}", *_told(one.our_errors), "1")
    for step, errors in zip(STEPS, one.errors, strict=True):
        seconds, name = one.seconds(step), f"{calculix.NAME}, extrapolated"
        times = f"{one.step:.2f}", f"{seconds:.0f}"
        yield (name, f"{one.unknowns}", f"{1e9 * step:g}", *times, *_told(errors), f"{seconds / one.ours:.0f}")


def _told(errors: tuple[float, ...]) -> tuple[str, ...]:
    """The whole filtered force, its peak, the impulse."""
    return f"{errors[0]:.2g}", *(f"{error:+.2g}" for error in errors[1:3])


def _within(one: Found) -> str:
    """The step at which the rule comes within our tolerance, and the ratio of times there."""
    slope, start = np.polyfit(np.log(STEPS), np.log([errors[0] for errors in one.errors]), 1)
    step = float(np.exp((np.log(100 * TOLERANCE) - start) / slope))
    ratio = one.seconds(step) / one.ours
    return f"{1e9 * step:.0f} ns and {ratio:.0f} times our time with {one.unknowns} unknowns"
