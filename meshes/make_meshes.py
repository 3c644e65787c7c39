"""Makes the CAD and mesh files of this folder: python meshes/make_meshes.py"""

import subprocess
import sys
from pathlib import Path

from seatfem.structures.mesh.meshing import make_mesh, write_step
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, Bar, Block, ConicalSeat, Flapper, Stopper, ValvePlate

FOLDER = Path(__file__).resolve().parent
SEAT = AnnularSeat()
SEAT_SPEC = MeshSpec(size=1.6e-3, contact_size=0.6e-3)
BAR = Bar(length=30e-3, width=3e-3, height=3e-3)
STEP_FILES = {
    "annular_seat": SEAT,
    "flat_seat": AnnularSeat(lip_height=0.0, lip_edge_radius=0.0),
    "conical_seat": ConicalSeat(contact_width=1e-3),
    "valve_plate": ValvePlate(),
    "reed_plate": ValvePlate(ports=3, layout="row"),
    "stopper": Stopper(),
    "domed_stopper": Stopper(dome_radius=20e-3),
    "bar": BAR,
    "flapper": Flapper(
        root_width=8e-3,
        taper_length=2e-3,
        neck_width=6e-3,
        neck_length=15e-3,
        paddle_diameter=16e-3,
        thickness=0.3e-3,
    ),
    "block": Block(width=20e-3, depth=16e-3, thickness=8e-3, patch_width=3e-3, patch_depth=2e-3),
}


def main(folder: Path = FOLDER) -> None:
    for name, geometry in STEP_FILES.items():
        write_step(geometry, folder / f"{name}.step")
    make_mesh(SEAT, SEAT_SPEC, msh=folder / "annular_seat.msh")
    # gmsh keeps to processes of its own
    for script in ("cad_parts.py", "valve_plate_assembly.py"):
        subprocess.run([sys.executable, str(FOLDER / script), str(folder)], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
