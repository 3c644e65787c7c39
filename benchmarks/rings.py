"""What the rings of a patch change in an impact, and what they cost.

A mass strikes an annular seat, on one mesh whose nodes serve every number of rings. Processor time.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

from table import Table, publish

import impact
from impact import measures
from seatfem.structures.rings import face_compliance
from seatfem.study.impacts.contact import measures_of, problem_of, run_contacts, seat_of, striker_of
from seatfem.study.scene import load_scene

RINGS = (1, 2, 4, 8, 16)
STEP = 10e-9
SCENE = """
[seat]
kind = "annular"
bore_radius = "4 mm"
lip_width = "1 mm"
material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }
damping_ratio = 0.02
mesh = { size = "0.8 mm", contact_size = "0.05 mm" }
greens = { bandwidth = "1 MHz", tolerance = 0.005 }
[reed]
kind = "rigid_mass"
mass = "1 g"
velocity = "-1 m/s"
[run]
duration = "20 us"
"""


def one(rings: int, folder: Path) -> dict[str, float]:
    """Peak of the 1-us mean and impulse of a run, static compliance, and processor times [s]."""
    path = folder / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    scene = load_scene(path)
    scene = scene.model_copy(update={"contact": scene.contact.model_copy(update={"rings": rings})})
    striker = striker_of(scene)
    start = process_time()
    seat = seat_of(scene, mesh_error=False)
    made = process_time()
    result = run_contacts(scene, striker, seat.greens, STEP).seat
    marched = process_time()
    measures_of(scene, problem_of(scene, striker, impact.Body(seat.greens)), STEP)
    again = process_time()
    return {
        "rings": rings,
        "peak_N": measures.filtered_peak_force(result, scene.run.filter_width),
        "impulse_Ns": measures.impulse(result),
        "compliance_m_per_N": face_compliance(seat.greens),
        "vectors": float(str(seat.greens.provenance["vectors"])),
        "seat_s": made - start,
        "contact_s": marched - made,
        "measures_s": again - marched,
        "energy_residual": result.energy.residual,
    }


def main() -> None:
    """All numbers of rings, one of them before: the compiler's time is nobody's."""
    with tempfile.TemporaryDirectory() as folder:
        found = [one(rings, Path(folder)) for rings in (4, *RINGS)][1:]
    base = found[0]
    rows = tuple(
        (
            f"{row['rings']}",
            *(f"{row[key] / base[key] - 1:+.2%}" for key in ("compliance_m_per_N", "peak_N", "impulse_Ns")),
            f"{row['vectors']:.0f}",
            *(f"{row[key] / base[key]:.1f}" for key in ("seat_s", "contact_s", "measures_s")),
        )
        for row in found
    )
    notes = (
        "A mass of 1 g strikes the lip of an annular seat at 1 m/s; one band and tolerance, 16 elements across it.",
        "Changes against one port; processor time of meshing, assembly and reduction, of a run, and of one without",
        "energies, over those of one port.",
    )
    columns = (
        "rings",
        "static compliance",
        "peak, 1-us mean",
        "impulse",
        "Krylov vectors",
        "seat",
        "contact",
        "bare run",
    )
    publish("rings", Table("Rings of a patch", notes, columns, rows))


if __name__ == "__main__":
    main()
