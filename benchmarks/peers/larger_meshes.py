"""The same impact on meshes that users have: CalculiX's direct dynamics beside our reduction and march.

Each run of CalculiX takes minutes: results/peers_meshes.jsonl keeps what is done, and what is there is not run again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any, Final

import numpy as np

from benchmarks.peers import calculix, calculix_impact, plain_impact
from benchmarks.peers import impact_scene as scene
from benchmarks.peers.bodies import timed
from benchmarks.table import RESULTS, Table
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.shapes import AnnularSeat

KEPT: Final = RESULTS / "peers_meshes.jsonl"
RUNS: Final = ((1.5e-3, 0.2e-6), (2.5e-3, 0.2e-6), (2.5e-3, 0.1e-6), (1.5e-3, 0.4e-6), (2.5e-3, 0.4e-6))
"""Size of the elements [m], step of CalculiX [s]; the order in which they are run."""
TOLERANCE, STEP, FINE = 1e-2, 20e-9, 10e-9  # of our Green's function; of our march and of the reference [s]
HALVED: Final = 0.1e-6  # a step that is extrapolated to where it was not run [s]


@dataclass(frozen=True)
class Found:
    """One run of CalculiX, and ours before and after it: processor seconds, and errors [%] as `scene.apart` gives."""

    unknowns: int
    step: float
    theirs: float
    ours: float
    their_errors: tuple[float, ...]
    our_errors: tuple[float, ...]


def meshes_table() -> Table:
    """What is on file, and the runs that are not."""
    found = [Found(**json.loads(line)) for line in KEPT.read_text("utf-8").splitlines()] if KEPT.exists() else []
    for size, step in RUNS:
        mesh = make_mesh(AnnularSeat(), MeshSpec(size, size / 2, curved=False)).mesh
        model = scene.seat(mesh)
        if any(one.unknowns == model.size and one.step == step for one in found):
            continue
        found.append(_run(mesh, model, step))
        with KEPT.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(found[-1])) + "\n")
    return _table(sorted(found, key=lambda one: (one.unknowns, -one.step)))


def _run(mesh: Any, model: SecondOrderModel, step: float) -> Found:
    truth = _reference(model)
    mine, before = timed(lambda: _ours(mesh))
    theirs, _ = calculix_impact.march(model, step)
    _, after = timed(lambda: _ours(mesh))
    errors = (scene.apart(one, truth) for one in (theirs, mine))
    return Found(model.size, step, theirs.seconds, (before + after) / 2, *errors)


def _ours(mesh: Any) -> scene.Course:
    """All that a first scene takes, from the mesh on."""
    return scene.course(scene.impact_of(scene.reduced(scene.seat(mesh), TOLERANCE), STEP), 0.0)


def _reference(model: SecondOrderModel) -> scene.Course:
    """Newmark's trapezoidal rule on the whole mesh, in small steps: no reduction, no contact algorithm."""
    [port] = model.ports.values()
    factor = factorize(model.M + FINE**2 / 4 * model.K)
    force = plain_impact.newmark(model.K, port.vector, FINE, factor, factor.solve(port.vector))
    return scene.of_points(force, FINE, 0.0)


def _table(found: list[Found]) -> Table:
    rows = [row for unknowns in sorted({one.unknowns for one in found}) for row in _rows(found, unknowns)]
    within = "; ".join(_within(found, unknowns) for unknowns in sorted({one.unknowns for one in found}))
    notes = (
        f"The impact above on finer meshes. Ours to a tolerance of {100 * TOLERANCE:g} %, before and after each run of "
        "CalculiX; errors are from Newmark's trapezoidal rule on the whole mesh with one factorization and steps of "
        f"{1e9 * FINE:g} ns. CalculiX's mass of four points is in its errors. *Extrapolated*: twice as many steps, each "
        "as dear; not run.\n\n"
        f"At equal accuracy: the filtered force is within our tolerance of {100 * TOLERANCE:g} % of its peak at all "
        f"times {within}. That step is read off a straight line through the errors on double logarithmic axes.",
    )
    columns = ("program", "unknowns", "step (ns)", "time (s)", "apart (%)", "peak (%)", "impulse (%)", "ratio")
    return Table("The impact on finer meshes", notes, columns, tuple(rows))


def _rows(found: list[Found], unknowns: int) -> Iterator[tuple[str, ...]]:
    """Of one mesh: ours, then CalculiX step by step."""
    here = [one for one in found if one.unknowns == unknowns]
    ours = fmean(one.ours for one in here)
    errors = here[0].our_errors
    yield ("ours", f"{unknowns}", f"{1e9 * STEP:g}", f"{ours:.2f}", *_told(errors), "1")
    for one in here:
        name, ratio = calculix.NAME, f"{one.theirs / ours:.0f}"
        yield (name, f"{unknowns}", f"{1e9 * one.step:g}", f"{one.theirs:.0f}", *_told(one.their_errors), ratio)
    finest = here[-1]
    if finest.step > 1.5 * HALVED:
        seconds = finest.theirs * finest.step / HALVED
        name, ratio = f"{calculix.NAME}, extrapolated", f"{seconds / ours:.0f}"
        yield (name, f"{unknowns}", f"{1e9 * HALVED:g}", f"{seconds:.0f}", "", "", "", ratio)


def _told(errors: tuple[float, ...]) -> tuple[str, ...]:
    """The whole filtered force, its peak, the impulse."""
    return f"{errors[0]:.2g}", *(f"{error:+.2g}" for error in errors[1:3])


def _within(found: list[Found], unknowns: int) -> str:
    """The step at which CalculiX comes within our tolerance, and the ratio of times there."""
    here = [one for one in found if one.unknowns == unknowns]
    if len(here) < 2:
        return f"with {unknowns} unknowns at a step that one run does not tell"
    steps, errors = np.log([(one.step, one.their_errors[0]) for one in here]).T
    slope, start = np.polyfit(steps, errors, 1)
    step = float(np.exp((np.log(100 * TOLERANCE) - start) / slope))
    ratio = fmean(one.theirs * one.step for one in here) / step / fmean(one.ours for one in here)
    return f"with {unknowns} unknowns from steps of {1e9 * step:.0f} ns on, at {ratio:.0f} times our time"
