"""A squeeze film of air under a plate that lands on a lip: floor, step, pull, tilt, and what a march with it takes.

The plate and seat of `lips.py`, the plate released 0.1 mm above the lip at 2 m/s.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

from lips import SCENE
from table import Table, publish

import impact
from impact import measures
from impact.after.result import ImpactResult, as_one
from seatfem.structures.rings import Division
from seatfem.study.impacts.contact import problem_of, seat_of, striker_of
from seatfem.study.method import stated_method
from seatfem.study.scene import load_scene

AIR = 'film = {{ viscosity = "{mu} uPa s", floor = "{floor} um", tension_limit = "{limit} bar" }}'
STEPS, FILTER = (200e-9, 50e-9, 10e-9), 1e-6
UNBROKEN = 1e9  # bar


def landing(film: str, arcs: int, tilt: str, step: float, folder: Path) -> tuple[ImpactResult, float]:
    """The contact of the whole lip, and processor time of a step [s]."""
    text = SCENE.format(arcs=arcs, tilt=tilt, axis="0 deg").replace('gap = "1 um"', f'gap = "100 um"\n{film}')
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    scene = load_scene(path)
    seat = seat_of(scene, method=stated_method(scene).seat, mesh_error=False).greens
    problem = problem_of(scene, striker_of(scene), impact.Body(seat))
    stepper = impact.ContactStepper(impact.prepare(problem, step, scene.run.duration), flying=True)
    start = process_time()
    stepper.advance(stepper.prepared.steps)
    spent = (process_time() - start) / stepper.prepared.steps
    return as_one(impact.collect(stepper), Division.of(seat).shares), spent


def row(
    arcs: int, tilt: str, floor: float, limit: float, step: float, folder: Path, mu: float = 18.0
) -> tuple[str, ...]:
    """``floor`` [um], 0: no film; ``limit`` [bar]."""
    film = AIR.format(mu=mu, floor=floor, limit=limit) if floor else ""
    result, spent = landing(film, arcs, tilt, step, folder)
    return (
        str(arcs),
        tilt,
        f"{floor:g}, mu {mu / 18 - 1:+.0%}" if mu != 18.0 else f"{floor:g}" if floor else "no film",
        "" if not floor else "none" if limit == UNBROKEN else f"{limit:g} bar",
        f"{1e9 * step:g}",
        f"{measures.film_force_peak(result):.1f}",
        f"{measures.stiction_force_peak(result):.2f}",
        f"{measures.filtered_peak_force(result, FILTER):.1f}",
        f"{1e6 * measures.impulse(result):.1f}",
        f"{result.energy.residual:.0e}",
        f"{1e6 * spent:.2f}",
    )


def main() -> None:
    """The first run, which compiles, is not counted."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for arcs in (1, 32):
            for floor in (0.0, 1.0):
                row(arcs, "0 deg", floor, 1.0, STEPS[0], folder)
        films = [(floor, limit) for limit in (UNBROKEN, 1.0) for floor in (1.0, 3.0)]
        rows = [row(1, "0 deg", *film, step, folder) for film in ((0.0, 1.0), *films) for step in STEPS]
        rows.append(row(1, "0 deg", 1.0, 1.0, STEPS[1], folder, mu=18 * 1.03))
        tilts = ("0 deg", "0.03 deg", "0.1 deg", "0.3 deg")
        rows += [row(32, tilt, floor, 1.0, STEPS[1], folder) for tilt in tilts for floor in (0.0, 1.0)]
    notes = (
        "The plate and seat of the arcs of a lip; mode 1 at 2 m/s, 0.1 mm above the lip; air, a lip of 1 mm.",
        "Peak: mean over 1 us. Residual: of the energy ledger, over the largest energy.",
    )
    columns = (
        "arcs",
        "tilt",
        "floor, um",
        "limit of the pull",
        "step, ns",
        "film, N",
        "pull, N",
        "peak, N",
        "impulse, uN s",
        "residual",
        "us a step",
    )
    publish("film", Table("A squeeze film", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
