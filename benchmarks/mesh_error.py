"""Error of g by the mesh, against what the planner expects of its sizes: `python benchmarks/mesh_error.py`.

Seats of all kinds on meshes from coarse to fine, compared after the Hann pulse of the band with a much finer mesh.
"""

from __future__ import annotations

import numpy as np
from table import Table, publish

from seatfem.structures.estimates.mesh_size import Sizes, mesh_error
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.solved import Solved
from seatfem.study.impacts.contact import seat_of
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene

STEEL = {"young": "200 GPa", "poisson": 0.3, "density": "7850 kg/m^3"}
SEATS: dict[str, dict[str, object]] = {
    "annular": {"kind": "annular", "bore_radius": "4 mm", "lip_width": "1 mm"},
    "stopper": {"kind": "stopper", "radius": "6 mm", "thickness": "5 mm", "contact_radius": "2 mm"},
    "conical": {"kind": "conical", "bore_radius": "4 mm", "face_width": "2 mm", "contact_width": "1 mm"},
    "block": {
        "kind": "block", "width": "12 mm", "depth": "12 mm", "thickness": "8 mm", "patch_width": "3 mm",
        "patch_depth": "2 mm", "model": "sector",
    },
    "bar": {"kind": "bar", "length": "20 mm", "width": "5 mm", "height": "5 mm", "model": "sector"},
    "plate": {
        "kind": "plate", "ports": 4, "port_radius": "3 mm", "pitch": "10 mm", "margin": "5 mm", "thickness": "3 mm",
        "land_width": "1 mm", "clamp_width": "2 mm", "model": "sector",
    },
}  # fmt: skip
ACROSS = (1, 2, 4)  # elements across the struck face
PER_DEPTH = (1, 3)  # elements over the depth of the body
FINER = (6, 6)  # the same of the reference


def solved(seat: dict[str, object], band: float, sizes: Sizes) -> Solved:
    """The seat on one mesh."""
    reed = {"kind": "rigid_mass", "mass": "1 g", "velocity": "-1 m/s"}
    table = {**seat, "material": STEEL, "damping_ratio": 0.05}
    scene = Scene.model_validate({"seat": table, "reed": reed, "run": {"duration": "0.5 ms"}})
    keys = {"bandwidth": band, "tolerance": 1e-3}
    values: dict[str, object] = {f"seat.greens.{key}": value for key, value in keys.items()}
    values |= {"seat.mesh.size": sizes.size, "seat.mesh.contact_size": sizes.contact_size}
    return seat_of(scene, method=stated_method(scene).replaced(values).seat, mesh_error=False)


def rows_of(name: str, seat: dict[str, object], band: float) -> list[tuple[str, ...]]:
    """One row a mesh."""
    reed = {"kind": "rigid_mass", "mass": "1 g", "velocity": "-1 m/s"}
    scene = Scene.model_validate({"seat": {**seat, "material": STEEL}, "reed": reed, "run": {"duration": "0.5 ms"}})
    assert isinstance(scene.seat, Drawn)
    patch = scene.seat.patch()
    assert patch is not None

    def sizes(across: int, per_depth: int) -> Sizes:
        contact = patch.width / across
        return Sizes(max(contact, min(patch.depth, patch.c_s / band) / per_depth), contact)

    t = np.linspace(0.0, 60 / band, 600)
    fine = solved(seat, band, sizes(*FINER)).greens.filtered(t, 1 / band)
    found = []
    for across in ACROSS:
        for per_depth in PER_DEPTH:
            chosen = sizes(across, per_depth)
            answer = solved(seat, band, chosen)
            error = np.max(np.abs(answer.greens.filtered(t, 1 / band) - fine)) / np.max(np.abs(fine))
            expected = mesh_error(patch, band, chosen)
            mesh = f"{1e3 * chosen.size:.3g}, {1e3 * chosen.contact_size:.3g}"
            unknowns = str(answer.about["seat_dof"])
            found.append((name, f"{band / 1e3:g}", mesh, unknowns, f"{100 * error:.2g}", f"{100 * expected:.2g}"))
    return found


def main() -> None:
    """The table of all seats."""
    rows = [row for name, seat in SEATS.items() for row in rows_of(name, seat, 200e3)]
    notes = (f"Reference: {FINER[0]} elements across the struck face and {FINER[1]} over the depth.",)
    columns = ("seat", "band [kHz]", "size, at the contact [mm]", "unknowns", "error of g [%]", "expected [%]")
    publish("mesh_error", Table("Error of g by the mesh", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
