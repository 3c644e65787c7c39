"""Errors that plans predict, against the bars that their runs state: `python benchmarks/planned_error.py [scene ...]`.

Each example is planned for its own target and carried out as planned, without rounds of refinement; rows are by measure
and source of error.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from table import Table, publish

from impact.runs.budget import safety
from seatfem.structures.cache import Cache
from seatfem.structures.store import Store
from seatfem.study.accuracy.error_budget import error_budget
from seatfem.study.impacts.contact import run_contacts, seat_of, stress_of, striker_of
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.measures import SOURCES
from seatfem.study.method import as_stated
from seatfem.study.planning.planner import plan_scene
from seatfem.study.scene import load_scene
from seatfem.study.scene.measures import key_of

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = (
    "flapper_on_spring",
    "paper_table1_3mm_area",
    "flapper_on_stopper",
    "flapper_on_annular_seat",
    "flapper_on_arc",
    "mass_on_bar",
    "flapper_on_valve_plate",
)


def rows_of(name: str) -> list[tuple[str, ...]]:
    """Predicted and stated, in percent, for each measure asked for."""
    scene = load_scene(EXAMPLES / f"{name}.toml")
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "store")
        plan = plan_scene(scene, store=store)
        planned = as_stated(plan.scene, plan.method)
        seat = seat_of(planned, Cache(Path(folder) / "seat.h5", store))
    striker = striker_of(planned)
    assert planned.run.time_step is not None
    touches = run_contacts(planned, striker, seat.greens, planned.run.time_step)
    stress = stress_of(planned, striker, touches.seat.force, touches.seat.dt, lift_of(touches))
    left = error_budget(planned, plan.method, seat, striker, touches, stress)
    found = []
    for measure in planned.accuracy.judged:
        value = abs(left.values[measure])
        stated = {source: safety(measure) * part[measure] / value for source, part in left.parts.items()}
        shares = {source: safety(measure) * plan.shares.get(source, {}).get(measure, 0.0) for source in SOURCES}
        parts = (f"{100 * shares[s]:.2g} / {100 * stated.get(s, 0.0):.2g}" for s in SOURCES)
        whole = f"{100 * plan.error[measure]:.2g} / {100 * left.relative(measure):.2g}"
        found.append((name, plan.level, key_of(measure), f"{100 * scene.accuracy.target:g}", whole, *parts))
    return found


def main() -> None:
    """The table of all scenes, or of those named."""
    rows = [row for name in sys.argv[1:] or SCENES for row in rows_of(name)]
    notes = ("Error bars in percent of the measure: predicted by the plan / stated by the run, and their shares.",)
    columns = ("scene", "level", "measure", "target", "bar", *(source.replace("_", " ") for source in SOURCES))
    publish("planned_error", Table("Planned error", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
