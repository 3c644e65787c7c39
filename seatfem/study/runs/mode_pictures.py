"""Files of `seatfem modes`: table, pictures, animation, ParaView."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

from impact.files.atomic import whole_file
from impact.progress import Progress
from seatfem.pictures.apart import Picture
from seatfem.pictures.cell_grid import CellGrid, revolve
from seatfem.pictures.plots import animate_mode, plot_modes, write_vtu
from seatfem.structures.model import Array
from seatfem.structures.natural_modes import Mode, NaturalModes
from seatfem.study.runs.pictures import draw_all, mesh_picture

SHOWN = 12


def draw_modes(found: NaturalModes, folder: Path, progress: Progress) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """modes.csv, and where the unknowns have places mesh.png, modes.png, mode_1.gif, modes.vtu; (files, gaps)."""
    table = folder / "modes.csv"
    write_table(found, table)
    if found.mesh is None or not found.modes:
        return (table,), ()
    cut = found.modes[0].diameters is not None
    numbered = [(k, mode) for k, mode in enumerate(found.modes, start=1) if mode.frequency_hz > 0]
    elastic = [(k, mode) for k, mode in numbered if not mode.repeats][:SHOWN]

    @cache  # for both, and made only once the first is drawn
    def shown() -> tuple[CellGrid, list[Array]]:
        return in_space([mode for _, mode in elastic])

    def draw(path: Path) -> None:
        title = "Modes of the seat" if found.complete else "Modes of the seat, not counted"
        frequencies = [mode.frequency_hz for _, mode in elastic]
        plot_modes(*shown(), frequencies, path, title=title, cut=cut, names=[_name(k, mode) for k, mode in elastic])

    def animate(path: Path) -> None:
        grid, shapes = shown()
        animate_mode(grid, shapes[0], elastic[0][1].frequency_hz, path, cut=cut)

    def paraview(path: Path) -> None:
        write_vtu(*in_space([mode for _, mode in numbered]), [mode.frequency_hz for _, mode in numbered], path)

    pictures: list[Picture] = [("mesh.png", mesh_picture(found.mesh))]
    if elastic:
        pictures += [("modes.png", draw), ("mode_1.gif", animate), ("modes.vtu", paraview)]
    files, gaps = draw_all(pictures, folder, progress)
    return (table, *files), gaps


def in_space(modes: list[Mode]) -> tuple[CellGrid, list[Array]]:
    """The body and the displacements of modes, whatever they were computed on."""
    model = modes[0].model
    assert model is not None
    if modes[0].diameters is None:
        return CellGrid.of_model(model), [_amplitudes(mode) for mode in modes]
    body = revolve(model)
    shapes = []
    for mode in modes:
        turned = math.pi / (2 * mode.diameters) if mode.repeats and mode.diameters else 0.0
        shapes.append(body.shape(_amplitudes(mode), mode.diameters or 0, angle=turned))
    return body.grid, shapes


def write_table(found: NaturalModes, path: Path) -> None:
    """One line a mode; an empty field where a number means nothing."""
    lines = ["mode,frequency_hz,residual,nodal_diameters,family,port_share"]
    for k, mode in enumerate(found.modes, start=1):
        diameters = "" if mode.diameters is None else str(mode.diameters)
        share = "" if mode.share is None else f"{mode.share:.6g}"
        lines.append(f"{k},{mode.frequency_hz:.9g},{mode.residual:.2e},{diameters},{mode.family},{share}")
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _amplitudes(mode: Mode) -> Array:
    assert mode.model is not None
    assert mode.shape is not None
    return mode.model.expand(mode.shape)


def _name(number: int, mode: Mode) -> str:
    """What stands before the frequency."""
    if mode.diameters is None:
        return f"{number}"
    if mode.family == "torsion":
        return f"{number}, torsion"
    return f"{number}-{number + 1}, n = {mode.diameters}" if mode.diameters else f"{number}, n = 0"
