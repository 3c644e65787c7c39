"""Makes the CAD and mesh files of this folder: python meshes/make_meshes.py"""

import subprocess
import sys
from pathlib import Path

from seatfem.structures.formats.writing import write_mesh
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat

FOLDER = Path(__file__).resolve().parent


def main(folder: Path = FOLDER) -> None:
    seat = make_mesh(AnnularSeat(), MeshSpec(size=1.6e-3, contact_size=0.6e-3))
    write_mesh(seat, folder / "annular_seat.msh")
    # gmsh keeps to processes of its own
    for script in ("step_files.py", "cad_parts.py", "valve_plate_assembly.py"):
        subprocess.run([sys.executable, str(FOLDER / script), str(folder)], check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
