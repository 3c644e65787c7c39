"""How short waves may be on a plate: a free ring plate by Mindlin elements, and the same as a solid of revolution.

    python benchmarks/thick_reeds.py

Both are pushed on a ring at the hole's edge, g at that port judged after the Hann pulse of a band at which the bending
wave has so many thicknesses; the solid's mesh has four elements over its thickness, or more. Writes
benchmarks/results/thick_reeds.csv, a row per thickness and band.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from impact.greens.modal import ModalGreens
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.lip import Lip
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meridian import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import BEYOND, Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat, RingPlate
from seatfem.structures.sheets import Sheet, model_of

STEEL = Material(206e9, 0.3, 7800.0)
INNER, OUTER, LAND = 4e-3, 12e-3, 1e-3
THICKNESSES = (4e-3, 6e-3, 7.5e-3)
SHARES = (1 / 6, 1 / 4, 1 / 3, 0.42)  # of the bending wave that the thickness is
WIDTHS = 5  # of the pulse, over which g is compared: later the rigid motion hides the rest
RESULT = Path(__file__).parent / "results" / "thick_reeds.csv"


def off_by(thickness: float, share: float) -> tuple[float, float]:
    """The band [Hz], and by what share of the solid's largest g that of the plate differs from it."""
    shape = RingPlate(2 * OUTER, 2 * INNER, thickness)
    band = (share * Sheet(shape, STEEL, 1.0).bending_wave(1.0) / thickness) ** 2
    solid = AnnularSeat(INNER, LAND, 0.0, lip_edge_radius=0.0, outer_radius=OUTER, thickness=thickness)
    mesh = make_meridian(solid, MeshSpec(min(thickness / 4, 0.4e-3), 0.12e-3))
    sheet = Sheet(shape, STEEL, band / 10, size=Sheet(shape, STEEL, band).element_size)  # by itself it would be refused
    models = model_of(sheet, (Lip(INNER + LAND / 2, LAND),)), assemble_axisymmetric(mesh, STEEL, fixed=())
    t = np.linspace(0.0, WIDTHS / band, 200)
    plate, right = (_greens(model, band).filtered(t, 1 / band) for model in models)
    return band, float(np.abs(plate - right).max() / np.abs(right).max())


def _greens(model: SecondOrderModel, band: float) -> ModalGreens:
    cutoff, aims = BEYOND * band, Aims(band, WIDTHS / band, 0.1)
    return with_modes(model, model.damping.plus(0.01), solve_modes(model, up_to_hz=cutoff), cutoff, aims, [0])


def main() -> None:
    """All thicknesses and bands."""
    with RESULT.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("thickness_mm", "over_width", "over_wave", "band_kHz", "off_by"))
        for thickness in THICKNESSES:
            for share in SHARES:
                band, off = off_by(thickness, share)
                row = (1e3 * thickness, thickness / (OUTER - INNER), share, band / 1e3, off)
                writer.writerow(f"{value:.4g}" for value in row)


if __name__ == "__main__":
    main()
