"""Measurement of this computer's rates by small pieces of every kind of work, in less than a minute.

Each time is the smaller of wall and processor time: other programs lengthen the one, several threads the other.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, Final, TypeVar

import numpy as np

import impact
from impact.after.result import ImpactResult
from impact.after.stresses import peak_bending_stress
from impact.greens.modal import ModalGreens, Residual
from impact.notices import Progress, silent
from impact.pictures.drawing import PictureError
from impact.pictures.plots import plot_force
from impact.storage.hdf5 import save_results
from seatfem.jobs.folders import private_folder
from seatfem.machine.resources import Machine
from seatfem.pictures import cell_grid, plots
from seatfem.structures import materials, method
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction import factorization, krylov, reducer
from seatfem.structures.shapes import Block

STEEL: Final = materials.Material(young=2e11, poisson=0.3, density=7850.0)
BODY: Final = Block(20e-3, 20e-3, 8e-3, 5e-3, 5e-3)
COARSE, FINE = MeshSpec(size=8e-3), MeshSpec(size=1.7e-3)
STEPS: Final = 100_000
STEP: Final = 1e-8  # time step of the time integrations that are measured [s]
POLES: Final = 500
BEYOND_IMPORTS: Final = 1.3  # time of the program's start over that of its imports
FRAMES: Final = 3
SAVED: Final = 11  # number of histories of a result
_IMPORTS: Final = "import seatfem.faces.cli, seatfem.study.runs.pipeline, seatfem.study.scene, matplotlib.figure"
SIZES: Final[Any] = {"young": 2e11, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.3e-3}
REED: Final = impact.Cantilever(**SIZES)

Rates = Mapping[str, float]
Made = TypeVar("Made")


def calibrate(progress: Progress = silent) -> Machine:
    """Return the rates of this computer. Rates of pictures keep their defaults if pictures cannot be drawn.

    Raises:
        MeshingError: gmsh does not run.
    """
    default = Machine()
    rates: dict[str, float] = {}

    def add(stage: str, new_rates: Rates) -> None:
        rates.update(new_rates)
        progress("measuring this computer", len(rates) / len(default.rates()))
        progress(stage, 1.0)

    start = BEYOND_IMPORTS * _time(lambda: subprocess.run([sys.executable, "-P", "-c", _IMPORTS], check=True))
    add("program start", {"start": start, "compiled": default.compiled * start / default.start})
    meshes, measured = _meshing()
    add("meshing", measured)
    models, measured = _assembly(meshes)
    add("assembly", measured)
    add("reduction", _reduction(models, default))
    result, measured = _contact()
    add("contact", measured)
    with private_folder("calibration") as folder:
        seconds = _time(lambda: save_results(folder / "result.h5", {"wave": result}, {}))
        add("files", {"value": seconds / SAVED / STEPS})
        add("pictures", _pictures(result, meshes, models, folder, default))
    return replace(default, **rates, origin="rates measured on this computer just now")


def _time(work: Callable[[], object], repeats: int = 2) -> float:
    """Return the shortest time of several runs [s]."""
    return min(_once(work)[1] for _ in range(repeats))


def _once(work: Callable[[], Made]) -> tuple[Made, float]:
    """Return the result of the work, and its time [s]."""
    wall, processor = perf_counter(), _processor()
    result = work()
    return result, min(perf_counter() - wall, _processor() - processor)


def _processor() -> float:
    """Return the processor time of this process and of the child processes for which it has waited [s]."""
    return process_time() + sum(os.times()[2:4])


def _meshing() -> tuple[tuple[SeatMesh, SeatMesh], Rates]:
    coarse, short = _once(lambda: make_mesh(BODY, COARSE))
    fine, long = _once(lambda: make_mesh(BODY, FINE))
    element = max(long - short, 0.1 * long) / (fine.quality.elements - coarse.quality.elements)
    start = max(short - coarse.quality.elements * element, 0.1 * short)
    return (coarse, fine), {"meshing_start": start, "element": element}


def _assembly(meshes: tuple[SeatMesh, SeatMesh]) -> tuple[tuple[SecondOrderModel, SecondOrderModel], Rates]:
    coarse, fine = (assemble(mesh, STEEL, ports={"contact": "contact"}) for mesh in meshes)
    seconds = _time(lambda: assemble(meshes[1], STEEL, ports={"contact": "contact"}))
    return (coarse, fine), {"entry": seconds / fine.K.nnz}


def _reduction(models: tuple[SecondOrderModel, SecondOrderModel], default: Machine) -> Rates:
    coarse, fine = models
    n, start = fine.size, _time(lambda: factorization.factorize(coarse.K))
    factor = max(_time(lambda: factorization.factorize(fine.K)) - start, 0.1 * start)
    factored, load = factorization.factorize(fine.K), np.ones(n)
    solve = _time(lambda: factored.solve(load), 5)
    band, ratio = 5e5, 0.02
    aims, damping = method.Aims(band, 1e-4, 0.01), fine.damping.plus(ratio)

    def reduced() -> reducer.Reduction:
        return krylov.Krylov().reduce(fine, damping, aims)

    greens = reduced().greens  # the first call loads compiled code
    whole = _time(reduced)
    vectors = int(str(greens.origin["vectors"]))
    remainder = whole - start - factor - vectors * solve
    usual = vectors * (default.product * fine.K.nnz + default.check + default.inner * n * vectors)
    slower = max(remainder / usual, 0.1)
    return {
        "factor_start": start,
        "factor": factor / n**1.47,
        "solve": solve / n ** (4 / 3),
        "product": slower * default.product,
        "inner": slower * default.inner,
        "check": slower * default.check,
    }


def _contact() -> tuple[ImpactResult, Rates]:
    reed = impact.cantilever_reed(**SIZES, damping_ratio=0.03, n_modes=40, tip_deflection=1e-3)
    omega = np.linspace(1e5, 1e7, POLES)
    many = ModalGreens(omega, np.full(POLES, 0.1), np.full((POLES, 1), 1.0), Residual.spring(1e-8 * np.eye(1)), ("c",))

    def run(seat: impact.GreensFunction) -> ImpactResult:
        problem = impact.ContactProblem(reed, impact.Body(seat), gap=0.0, law=impact.Signorini())
        return impact.solve(problem, dt=STEP, duration=STEP * STEPS)

    spring = impact.spring(stiffness=3e7)
    result = run(spring)
    run(many)
    short, long = _time(lambda: run(spring), 3), _time(lambda: run(many))
    pole = max(long - short, 0.1 * long) / STEPS / POLES
    peak_bending_stress(result.force, STEP, reed, REED)
    stress = _time(lambda: peak_bending_stress(result.force, STEP, reed, REED))
    step = max(short / STEPS - 40 * pole, 0.1 * short / STEPS)
    return result, {"pole": pole, "step": step, "stress": stress / STEPS / 40}


def _pictures(
    result: ImpactResult,
    meshes: tuple[SeatMesh, SeatMesh],
    models: tuple[SecondOrderModel, SecondOrderModel],
    folder: Path,
    default: Machine,
) -> Rates:
    """Return the rates of pictures of curves and of bodies, drawn as in a run; the defaults if they cannot be drawn."""
    try:
        plot_force(result, result, folder / "force.png", filter_width=1e-6)
        sheet = _time(lambda: plot_force(result, result, folder / "force.png", filter_width=1e-6))
        _draw(models[0], folder)
        coarse, fine = (_time(lambda model=model: _draw(model, folder)) for model in models)  # type: ignore[misc]
    except PictureError:
        return {name: getattr(default, name) for name in ("sheet", "view", "face")}
    small, large = (int(mesh.mesh.boundary_facets().size) for mesh in meshes)
    face = max((fine - coarse) / FRAMES, 0.02 * fine / FRAMES) / (large - small)
    view = max((coarse - sheet) / FRAMES - face * small, 0.1 * coarse / FRAMES)
    return {"sheet": sheet, "view": view, "face": face}


def _draw(model: SecondOrderModel, folder: Path) -> None:
    grid = cell_grid.CellGrid.of_model(model)
    waves = grid.points.T / grid.size
    shapes = [np.asarray(np.cos((k + 1) * waves)) for k in range(FRAMES)]
    plots.plot_modes(grid, shapes, [1e3 * (k + 1) for k in range(FRAMES)], folder / "modes.png")
