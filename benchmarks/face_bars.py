"""Error bars of landings on lips of faces: 32 arcs on a coarse mesh, against 96 on a fine one."""

from __future__ import annotations

import tempfile
from pathlib import Path

from face_lips import CAD, MESHES, SCENE
from table import Table, publish

from seatfem.structures.solved import Solved
from seatfem.study.accuracy.error_budget import error_budget
from seatfem.study.impacts.contact import run_contacts, seat_of, striker_of
from seatfem.study.impacts.measures import measured
from seatfem.study.impacts.touches import Touches
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene, load_scene

STEP = 50e-9
NAMES = ("impulse", "filtered_peak", "line_force")
LANDINGS = (
    ("slot_seat", 0.2, 0),
    ("slot_seat", 0.4, 45),
    ("slot_seat", 0.1, 90),
    ("annular_seat", 0.3, 90),
    ("annular_seat", 0.1, 30),
)
COARSE, FINE = (32, 4.0, 0.7), (96, 2.5, 0.25)


def landing(file: str, tilt: float, axis: float, how: tuple[int, float, float]) -> tuple[Scene, Solved, Touches]:
    """One on the statics of a part, with so many arcs and elements of two sizes [mm]."""
    arcs, size, contact = how
    seat = CAD.format(MESHES / f"{file}.step") + '\nmodel = "spring"'
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "scene.toml"
        text = SCENE.format(seat=seat, size=size, contact=contact, arcs=arcs, tilt=tilt, axis=axis)
        path.write_text(text, encoding="utf-8")
        scene = load_scene(path)
    solved = seat_of(scene, method=stated_method(scene).seat, mesh_error=how == COARSE)
    return scene, solved, run_contacts(scene, striker_of(scene), solved.greens, STEP)


def main() -> None:
    """True error over stated bar, and the bar, of three measures."""
    rows = []
    for file, tilt, axis in LANDINGS:
        scene, solved, touches = landing(file, tilt, axis, COARSE)
        _, _, finer = landing(file, tilt, axis, FINE)
        budget = error_budget(scene, stated_method(scene), solved, striker_of(scene), touches)
        values, right = (measured(each, scene.run.filter_width) for each in (touches, finer))
        cells = (
            (f"{abs(values[n] - right[n]) / budget.bar(n):.2f}", f"{100 * budget.bar(n) / values[n]:.1f} %")
            for n in NAMES
        )
        rows.append((f"{file}, {tilt} deg about {axis} deg", *(text for cell in cells for text in cell)))
    notes = (
        "The flapper of `face_lips.py` on the statics of two parts: 32 arcs and elements of 4 and 0.7 mm; what 96 arcs",
        "with elements of 2.5 and 0.25 mm change, over the bar that the coarse run states; and the bar, of the value.",
    )
    columns = ("landing", "impulse", "bar", "peak", "bar", "line force", "bar")
    publish("face_bars", Table("Error bars along lips of faces", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
