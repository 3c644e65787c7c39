"""Makes the CAD and mesh files of this folder: python meshes/make_meshes.py"""

from pathlib import Path

from seatfem.geometry import AnnularSeat, Bar
from seatfem.meshing import MeshSpec, make_mesh, write_step

FOLDER = Path(__file__).resolve().parent
SEAT = AnnularSeat()
SEAT_SPEC = MeshSpec(size=1.6e-3, contact_size=0.6e-3)
BAR = Bar(length=30e-3, width=3e-3, height=3e-3)


def main(folder: Path = FOLDER) -> None:
    write_step(SEAT, folder / "annular_seat.step")
    write_step(BAR, folder / "bar.step")
    make_mesh(SEAT, SEAT_SPEC, msh=folder / "annular_seat.msh")


if __name__ == "__main__":
    main()
