"""Pictures of a run and of the modes of a seat, and messages about those that cannot be drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from impact.after.result import ImpactResult
from impact.files.csv_table import write_csv
from impact.notices import Progress
from impact.pictures.drawing import try_draw
from impact.pictures.plots import plot_energy, plot_force, plot_greens, plot_motion, plot_strains
from impact.quantities import text
from seatfem.machine.libraries import picture_library_gap
from seatfem.pictures import frames, plots, rendering, skins
from seatfem.pictures import moving as moving_pictures
from seatfem.structures import cache, natural_modes, rings
from seatfem.structures.cache import Store, StoreError
from seatfem.structures.finite_elements import DRAWN_MODES
from seatfem.structures.kinds import Structure
from seatfem.structures.mesh import plane_meshes
from seatfem.structures.method import Method, Solved
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.modes import Modes
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round
from seatfem.study.scene import Run

if TYPE_CHECKING:
    from seatfem.structures.mesh import meshing
    from seatfem.structures.natural_modes import Mode, NaturalModes

SHOWN_MODES = 6  # modes in a run's modes.png
MODES_FILE: Final = "modes.h5"
BODIES: Final = (
    "mesh.png",
    "modes.png",
    "mode_1.gif",
    "landing.gif",
    "seat_stress.png",
    "stress_wave.gif",
    "stress_wave.png",
    "reed_stress_wave.gif",
    "reed_stress_wave.png",
    "margin_map.png",
)  # pictures in three dimensions, drawn by VTK in another process


def raising(problem: Exception, path: Path) -> None:
    """Raise the reason why a picture cannot be made; takes the place of the function that draws it."""
    raise problem


def draw_run(
    done: Round,
    baseline: ImpactResult,
    folder: Path,
    progress: Progress,
    painter: rendering.Painter,
    more: Sequence[rendering.Picture] = (),
    landings: Sequence[Mapping[str, object]] = (),
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Draw force, motion, energy, Green's function, ``more``, mesh and modes of a round; return the files and messages
    on gaps.

    ``painter``: drawing process, on which `ahead` has begun. ``landings``: records as in summary.json, to be marked.
    Pictures of mesh and modes of a seat that is reused are copied from the store; without any, it is meshed again.
    """
    scene, seat, result, how = done.plan.scene, done.seat, done.result, done.plan.method.seat
    title, width = scene.title or "Impact", scene.run.filter_width
    marked: dict[str, Any] = {"filter_width": width, "title": title, "landings": landings}
    struck = "seat" if scene.stopper is None else "seat and stopper"
    of_run: list[rendering.Picture] = [
        ("force.png", lambda path: plot_force(result, baseline, path, **marked)),
        ("motion.png", lambda path: plot_motion(result, baseline, path, crank=scene.crank, **marked)),
        ("energy.png", lambda path: plot_energy(result, path, title=title, targets=struck)),
        _greens_picture(scene.run, how, seat),
        *more,
    ]
    copies: tuple[Path, ...] = ()
    missing: tuple[str, ...] = ()
    key = "" if how.exact else cache.key_of(scene.seat, how)
    if key and seat.mesh is None:
        try:
            copies = Store.default().fetch(key, folder)
            seat = seat if copies else scene.seat.meshed(seat, how, progress)
        except Exception as problem:  # all numbers are on file: the missing pictures are reported instead
            missing = (f"no pictures of the seat's mesh and modes: {problem}",)
    of_seat = _seat_pictures(scene.seat, width, seat)
    files, gaps = draw_all(of_run + of_seat, folder, progress, painter)
    names = [name for name, _ in of_seat]
    try:
        for file in (file for file in files if key and file.name in names):
            Store.default().keep(key, file)
    except (StoreError, OSError) as problem:
        missing = (*missing, f"pictures of the seat are not kept for later runs: {problem}")
    return (*files, *copies), (*gaps, *missing)


def ahead(done: Round, painter: rendering.Painter) -> None:
    """Begin to draw the pictures that need the seat only, while the run continues; none for a seat without a mesh."""
    scene, seat = done.plan.scene, done.seat
    bodies = [picture for picture in _seat_pictures(scene.seat, scene.run.filter_width, seat) if picture[0] in BODIES]
    if bodies and not picture_library_gap():
        painter.take([*bodies, _greens_picture(scene.run, done.plan.method.seat, seat)])


def _greens_picture(run: Run, how: Method, seat: Solved) -> rendering.Picture:
    """Return greens.png."""
    known = how.bandwidth
    band, periods = (1 / run.filter_width, 200) if known is None else (known, 40)
    whole = rings.join_all_parts(seat.greens)  # p parts have p^2 responses
    draw = partial(plot_greens, whole, duration=min(run.duration, periods / band), width=1 / band)
    return "greens.png", draw


def gauge_pictures(touches: Touches, title: str) -> list[rendering.Picture]:
    """Return gauges.png of a run with strain gauges."""
    draw = partial(plot_strains, touches.strains, touches.seat.dt, title=title or "Strain at the gauges")
    return [("gauges.png", draw)] if touches.strains else []


def stopper_pictures(touches: Touches, width: float, title: str) -> list[rendering.Picture]:
    """Return stopper_force.png of a run that strikes its stopper; ``width``: of the filter [s]."""
    struck = touches.stopper
    if struck is None or not np.any(struck.rows.force):
        return []
    words = f"Force on the stopper: {title}" if title else "Force on the stopper"
    draw = partial(plot_force, struck, filter_width=width, title=words, names=("stopper", ""))
    return [("stopper_force.png", draw)]


def _seat_pictures(body: Structure, width: float, seat: Solved) -> list[rendering.Picture]:
    if drawn := body.fit_pictures(seat.greens, width):
        return drawn
    if seat.mesh is None:
        return []
    of_mesh: list[rendering.Picture] = [("mesh.png", mesh_picture(seat.mesh))]
    if seat.model is None or seat.modes is None or len(seat.modes.frequencies_hz) == 0:
        return of_mesh
    # "Modes of the seat": all modes are known, and of the whole body instead of a section or sector
    whole = seat.modes.complete and seat.about.get("seat_level", "3d") == "3d"
    diameters = 0 if isinstance(seat.mesh, plane_meshes.MeridianMesh) else None
    title = "Modes of the seat" if whole else "Modes of the seat that this load excites"
    return [*of_mesh, *_mode_pictures(_kept_modes(seat.model, seat.modes, diameters), title, most=SHOWN_MODES)]


def _mode_pictures(numbered: list[tuple[int, Mode]], title: str, *, most: int) -> list[rendering.Picture]:
    """Return modes.png, of so many modes at the most, mode_1.gif and modes.h5; or a picture that fails with the reason
    why they cannot be drawn."""
    try:
        shown = modes_in_motion(numbered, title)
    except Exception as problem:  # all numbers are on file: the missing picture is reported instead
        return [("modes.png", partial(raising, problem))]
    return [
        ("modes.png", partial(moving_pictures.plot_frames, shown, title=title, most=most)),
        ("mode_1.gif", partial(moving_pictures.swing_frame, shown)),
        (MODES_FILE, partial(moving_pictures.save_moving, shown)),
    ]


def _kept_modes(model: SecondOrderModel, modes: Modes, diameters: int | None) -> list[tuple[int, Mode]]:
    """Return the first `DRAWN_MODES` modes of a seat's Green's function, numbered from 1."""
    triples = zip(modes.frequencies_hz[:DRAWN_MODES], modes.residuals, modes.shapes.T, strict=False)
    return [
        (number, natural_modes.Mode(float(frequency), float(residual), math.nan, model, shape, diameters))
        for number, (frequency, residual, shape) in enumerate(triples, start=1)
    ]


def modes_in_motion(numbered: list[tuple[int, Mode]], title: str) -> frames.Frames:
    """Return modes of one mesh on its surface; of a body of revolution all around the axis."""
    skin, shapes = skins.skin_of(numbered[0][1].model), []
    for _, mode in numbered:
        diameters = mode.diameters or 0
        turned = math.pi / (2 * diameters) if mode.repeats and diameters else 0.0
        shapes.append(skin.moved(_amplitudes(mode)[:, skin.nodes].T, diameters, turned=turned))
    labels = [f"{_name(k, mode)}: {text(mode.frequency_hz, 'Hz', 4)}" for k, mode in numbered]
    frequency = np.array([mode.frequency_hz for _, mode in numbered])
    return frames.mode_frames(skin, shapes, labels, title, frequency)


def mesh_picture(mesh: meshing.SeatMesh | plane_meshes.MeridianMesh | None) -> Callable[..., None]:
    """Return the function that draws this kind of mesh."""
    if isinstance(mesh, plane_meshes.MeridianMesh):
        return partial(plots.plot_section, mesh.mesh)
    return partial(plots.plot_mesh, None if mesh is None else mesh.mesh)


def draw_all(
    wanted: list[rendering.Picture], folder: Path, progress: Progress, painter: rendering.Painter
) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Draw all pictures, `BODIES` by the ``painter`` meanwhile, those that it has begun once; return the files and
    messages about gaps."""
    files: list[Path] = []
    gaps: dict[str, list[str]] = {}  # names of pictures by the reason why they are missing
    bodies = [] if picture_library_gap() else [picture for picture in wanted if picture[0] in BODIES]
    painter.take([picture for picture in bodies if picture[0] not in painter])
    for number, (name, draw) in enumerate(sorted(wanted, key=lambda p: p[0] in painter), start=1):
        if gap := painter.wait(name, folder) if name in painter else try_draw(_draw_and_clear(draw), folder / name):
            gaps.setdefault(gap.removeprefix(name), []).extend([name] if gap.startswith(name) else [])
        else:
            files.append(folder / name)
        progress("pictures", number / len(wanted))
    return tuple(files), tuple(f"skipped pictures: {', '.join(names)}{reason}" for reason, names in gaps.items())


def _draw_and_clear(draw: Callable[..., object]) -> Callable[[Path], object]:
    """Return the function of a path alone, which frees the curves of a figure: these are large, and in rings."""

    def draw_at(path: Path) -> None:
        if clear := getattr(draw(path=path), "clear", None):
            clear()

    return draw_at


def draw_modes(natural: NaturalModes, folder: Path, progress: Progress) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Write modes.csv and, of a meshed body, mesh.png, modes.png, mode_1.gif, modes.vtu; return files and gaps."""
    table = folder / "modes.csv"
    write_table(natural, table)
    if natural.mesh is None or not natural.modes:
        return (table,), ()
    numbered = [(k, mode) for k, mode in enumerate(natural.modes, start=1) if mode.frequency_hz > 0]
    elastic = [(k, mode) for k, mode in numbered if not mode.repeats][:DRAWN_MODES]
    title = "Modes of the seat"

    def paraview(path: Path) -> None:
        body = modes_in_motion(numbered, title)
        names = (f"mode {k:02d}, {mode.frequency_hz:.6g} Hz" for k, (_, mode) in enumerate(numbered, start=1))
        moving_pictures.write_surface(body, dict(zip(names, body.displacement, strict=True)), path)

    wanted: list[rendering.Picture] = [("mesh.png", mesh_picture(natural.mesh))]
    if elastic:
        wanted += [*_mode_pictures(elastic, title, most=DRAWN_MODES), ("modes.vtu", paraview)]
    with rendering.drawing_apart() as painter:
        files, gaps = draw_all(wanted, folder, progress, painter)
    return (table, *files), gaps


def write_table(natural: NaturalModes, path: Path) -> None:
    """Write one line for each mode, with empty fields where a number does not apply."""
    heads = ("mode", "frequency_hz", "residual", "nodal_diameters", "family", "port_share")
    modes = enumerate(natural.modes, start=1)
    rows = ((k, float(m.frequency_hz), float(m.residual), m.diameters, m.family, m.share) for k, m in modes)
    write_csv(path, heads, rows, digits=9)


def _amplitudes(mode: Mode) -> Array:
    return mode.model.expand(mode.shape)


def _name(number: int, mode: Mode) -> str:
    """Return a mode's number, family and nodal diameters n, to stand before its frequency."""
    if mode.diameters is None:
        return f"{number}"
    if mode.family == "torsion":
        return f"{number}, torsion"
    return f"{number}-{number + 1}, n = {mode.diameters}" if mode.diameters else f"{number}, n = 0"
