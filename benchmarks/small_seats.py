"""All modes or a Krylov space for small seats: where `seatfem.structures.reduction.modal.ALL_MODES` comes from."""

from __future__ import annotations

from pathlib import Path

from table import Table, best, publish

from impact.progress import silent
from seatfem.structures.discretise import draw, matrices
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import reduce_model
from seatfem.structures.reduction.modal import ALL_MODES
from seatfem.study.scene import load_scene

BAND, DURATION, TOLERANCE = 4e5, 1.5e-3, 0.01  # Hz, s
METHODS: tuple[str, ...] = ("modes", "krylov")
SIZES = (8e-3, 1.6e-3, 1.2e-3, 1e-3)  # of elements [m]


def main() -> None:
    """Half sections of two seats, meshed ever finer."""
    rows = []
    for name in ("flapper_on_stopper", "flapper_on_annular_seat"):
        seat = load_scene(Path(__file__).parents[1] / "examples" / f"{name}.toml").seat
        assert isinstance(seat, Drawn)
        for size in SIZES:
            mesh = draw(seat, MeshSpec(size=size, contact_size=0.4 * size), "axisymmetric")
            model = matrices(seat, mesh, "axisymmetric", silent)
            seconds = [_seconds(model, seat.damping_ratio, method) for method in METHODS]
            rows.append((name, str(model.size), *(f"{1e3 * t:.0f}" for t in seconds)))
    rows.sort(key=lambda row: int(row[1]))
    notes = (f"Milliseconds of a reduction on one core. With method = 'auto', all modes up to {ALL_MODES} unknowns.",)
    columns = ("seat", "unknowns", "all modes", "Krylov")
    publish("small_seats", Table("Small seats: all modes or a Krylov space", notes, columns, tuple(rows)))


def _seconds(model: SecondOrderModel, damping_ratio: float, method: str) -> float:
    def reduce() -> None:
        reduce_model(
            model,
            bandwidth=BAND,
            duration=DURATION,
            tolerance=TOLERANCE,
            damping_ratio=damping_ratio,
            method=method,
            progress=silent,
        )

    return best(reduce, 3)


if __name__ == "__main__":
    main()
