"""Which pictures belong to a run, and what to say where one cannot be made."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from impact.atomic import whole_file
from impact.drawing import PictureError
from impact.greens_plots import plot_greens
from impact.plots import plot_energy, plot_force, plot_motion
from impact.progress import Progress
from impact.result import ImpactResult
from seatfem.mesh.meridian import MeridianMesh
from seatfem.model import Array
from seatfem.scene import Scene
from seatfem.scene.seats import ElasticSeat, RevolvedSeat
from seatfem.seats.seat import SeatAnswer
from seatfem.seats.store import Store
from seatfem.views.cell_grid import CellGrid
from seatfem.views.plots import animate_mode, plot_mesh, plot_modes, write_vtu
from seatfem.views.revolved_grid import revolve
from seatfem.views.section_plot import plot_section

SHOWN_MODES = 6
_Picture = tuple[str, Callable[[Path], None]]


def draw_run(
    scene: Scene, seat: SeatAnswer, result: ImpactResult, baseline: ImpactResult, folder: Path, progress: Progress
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Force, motion, energy, Green's function, mesh and modes; (files written, gaps in words).

    Mesh and modes of a seat that was computed before, whose matrices are gone, come from the store.
    """
    title, width = scene.title or "Impact", scene.run.filter_width
    elastic = isinstance(scene.seat, ElasticSeat)
    band = scene.seat.greens.bandwidth if isinstance(scene.seat, ElasticSeat) else 1 / width
    memory = min(scene.run.duration, (40 if elastic else 200) / band)
    pictures: list[_Picture] = [
        ("force.png", lambda p: plot_force(result, baseline, p, filter_width=width, title=title)),
        ("motion.png", lambda p: plot_motion(result, baseline, p, title=title)),
        ("energy.png", lambda p: plot_energy(result, p, title=title)),
        ("greens.png", lambda p: plot_greens(seat.greens, p, duration=memory, width=1 / band)),
    ]
    of_seat = _seat_pictures(scene, seat)
    files, gaps = _draw(pictures + of_seat, folder, progress)
    if not isinstance(scene.seat, ElasticSeat):
        return files, gaps
    store, key, names = Store.default(), scene.seat_key(), [name for name, _ in of_seat]
    for file in (file for file in files if file.name in names):
        store.keep(key, file)
    return (*files, *(store.fetch(key, folder) if not names else ())), gaps


def draw_modes(
    scene: Scene, seat: SeatAnswer, folder: Path, progress: Progress
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Modes and mesh alone, with a table and a ParaView file; (files written, gaps in words)."""
    pictures = _seat_pictures(scene, seat)
    files, gaps = _draw(pictures, folder, progress)
    if seat.modes is None or seat.model is None:
        return files, gaps
    grid, shapes = _shapes(seat, len(seat.modes.frequencies_hz))
    table = folder / "modes.csv"
    rows = zip(seat.modes.frequencies_hz, seat.modes.residuals, strict=True)
    _write_table(table, [f"{k},{f:.9g},{r:.2e}" for k, (f, r) in enumerate(rows, start=1)])
    more, missing = _draw(
        [("modes.vtu", lambda p: write_vtu(grid, shapes, _frequencies(seat, len(shapes)), p))], folder, progress
    )
    return (table, *files, *more), tuple(dict.fromkeys(gaps + missing))


def _seat_pictures(scene: Scene, seat: SeatAnswer) -> list[_Picture]:
    if seat.model is None or seat.mesh is None:
        return []
    pictures: list[_Picture] = [("mesh.png", lambda p: _draw_mesh(seat, p))]
    if seat.modes is None or len(seat.modes.frequencies_hz) == 0:
        return pictures
    count = min(SHOWN_MODES, len(seat.modes.frequencies_hz))
    grid, shapes = _shapes(seat, count)
    frequencies, cut = _frequencies(seat, count), isinstance(scene.seat, RevolvedSeat)
    pictures.append(("modes.png", lambda p: plot_modes(grid, shapes, frequencies, p, cut=cut)))
    pictures.append(("mode_1.gif", lambda p: animate_mode(grid, shapes[0], frequencies[0], p, cut=cut)))
    return pictures


def _draw_mesh(seat: SeatAnswer, path: Path) -> None:
    if isinstance(seat.mesh, MeridianMesh):
        plot_section(seat.mesh.mesh, path)
    else:
        plot_mesh(seat.mesh, path)


def _shapes(seat: SeatAnswer, count: int) -> tuple[CellGrid, list[Array]]:
    """In space, whatever the level of modelling."""
    assert seat.model is not None
    assert seat.modes is not None
    found = [seat.model.expand(seat.modes.shapes[:, k]) for k in range(count)]
    if not isinstance(seat.mesh, MeridianMesh):
        return CellGrid.of_model(seat.model), found
    body = revolve(seat.model)
    return body.grid, [body.shape(amplitudes, 0) for amplitudes in found]


def _frequencies(seat: SeatAnswer, count: int) -> list[float]:
    assert seat.modes is not None
    return [float(f) for f in seat.modes.frequencies_hz[:count]]


def _draw(pictures: list[_Picture], folder: Path, progress: Progress) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    files, gaps = [], []
    for number, (name, draw) in enumerate(pictures, start=1):
        try:
            draw(folder / name)
            files.append(folder / name)
        except PictureError as gap:
            gaps.append(f"skipped pictures: {gap}")
        progress("pictures", number / len(pictures))
    return tuple(files), tuple(dict.fromkeys(gaps))


def _write_table(path: Path, rows: list[str]) -> None:
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(["mode,frequency_hz,residual", *rows]) + "\n", encoding="utf-8")
