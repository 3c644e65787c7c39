"""Which pictures belong to a run, and what to say where one cannot be made."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

from impact.drawing import gap_of
from impact.greens_plots import plot_greens
from impact.modal import ModalGreens
from impact.plots import plot_energy, plot_force, plot_motion
from impact.poles import PoleGreens
from impact.progress import Progress
from impact.result import ImpactResult
from seatfem.inspection.imported import response_of
from seatfem.mesh.meridian import MeridianMesh
from seatfem.mesh.seat_mesh import SeatMesh
from seatfem.model import Array
from seatfem.scene import Scene
from seatfem.scene.imported import FrequencyResponseFile
from seatfem.scene.seats import ElasticSeat, RevolvedSeat
from seatfem.seats.seat import SeatAnswer
from seatfem.seats.store import Store, StoreError
from seatfem.views.cell_grid import CellGrid
from seatfem.views.fit_plot import plot_fit
from seatfem.views.plots import animate_mode, plot_mesh, plot_modes
from seatfem.views.revolved_grid import revolve
from seatfem.views.section_plot import plot_section

SHOWN_MODES = 6
Picture = tuple[str, Callable[[Path], None]]


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
    pictures: list[Picture] = [
        ("force.png", lambda p: plot_force(result, baseline, p, filter_width=width, title=title)),
        ("motion.png", lambda p: plot_motion(result, baseline, p, title=title)),
        ("energy.png", lambda p: plot_energy(result, p, title=title)),
        ("greens.png", lambda p: plot_greens(seat.greens, p, duration=memory, width=1 / band)),
    ]
    of_seat = _seat_pictures(scene, seat)
    files, gaps = draw_all(pictures + of_seat, folder, progress)
    if not isinstance(scene.seat, ElasticSeat):
        return files, gaps
    names = [name for name, _ in of_seat]
    try:
        more = _through_store(scene.seat_key(), [file for file in files if file.name in names], names, folder)
    except (StoreError, OSError) as problem:
        return files, (*gaps, f"pictures of the seat are not kept for later runs: {problem}")
    return (*files, *more), gaps


def _through_store(key: str, drawn: list[Path], names: list[str], folder: Path) -> tuple[Path, ...]:
    """Keep what was drawn of the seat; where nothing of it can be drawn, copies of what was kept."""
    store = Store.default()
    for file in drawn:
        store.keep(key, file)
    return () if names else store.fetch(key, folder)


def _seat_pictures(scene: Scene, seat: SeatAnswer) -> list[Picture]:
    measured, fitted = scene.seat, seat.greens
    if isinstance(measured, FrequencyResponseFile) and isinstance(fitted, ModalGreens | PoleGreens):
        width = scene.run.filter_width
        return [("fit.png", lambda p: plot_fit(response_of(measured), fitted, p, width=width))]
    if seat.model is None or seat.mesh is None:
        return []
    pictures: list[Picture] = [("mesh.png", lambda p: draw_mesh(seat.mesh, p))]
    if seat.modes is None or len(seat.modes.frequencies_hz) == 0:
        return pictures
    count = min(SHOWN_MODES, len(seat.modes.frequencies_hz))
    frequencies, cut = _frequencies(seat, count), isinstance(scene.seat, RevolvedSeat)

    @cache  # for both, and made only once the first is drawn
    def shown() -> tuple[CellGrid, list[Array]]:
        return _shapes(seat, count)

    def animate(path: Path) -> None:
        grid, shapes = shown()
        animate_mode(grid, shapes[0], frequencies[0], path, cut=cut)

    title = "Modes of the seat" if _whole(seat) else "Modes of the seat that this load excites"
    pictures.append(("modes.png", lambda p: plot_modes(*shown(), frequencies, p, title=title, cut=cut)))
    pictures.append(("mode_1.gif", animate))
    return pictures


def _whole(seat: SeatAnswer) -> bool:
    """Whether the modes are all there are: counted, and of the whole body instead of a section or sector."""
    assert seat.modes is not None
    return seat.modes.complete and seat.about.get("seat_level", "3d") == "3d"


def draw_mesh(mesh: SeatMesh | MeridianMesh | None, path: Path) -> None:
    """Whichever picture suits the mesh."""
    if isinstance(mesh, MeridianMesh):
        plot_section(mesh.mesh, path)
    else:
        plot_mesh(mesh, path)


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


def draw_all(pictures: list[Picture], folder: Path, progress: Progress) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Draw them into a folder; (files written, gaps in words)."""
    files, gaps = [], []
    for number, (name, draw) in enumerate(pictures, start=1):
        if gap := gap_of(draw, folder / name):
            gaps.append(f"skipped pictures: {gap}")
        else:
            files.append(folder / name)
        progress("pictures", number / len(pictures))
    return tuple(files), tuple(dict.fromkeys(gaps))
