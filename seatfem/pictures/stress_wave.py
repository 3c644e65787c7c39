"""A stress wave: a body at a few times, deformed, exaggerated as it says, and coloured by its von Mises stress."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.pictures.drawing import PictureError
from impact.quantities import scaled, text
from seatfem.pictures.paraview import DISPLACEMENT, write_frames
from seatfem.pictures.plots import album
from seatfem.pictures.rendering import (
    ABOVE,
    LIGHT,
    Image,
    aim,
    crop,
    load_pyvista,
    new_plotter,
    round_factor,
    shoot,
    write_gif,
)
from seatfem.pictures.skin import Skin
from seatfem.structures.model import Array

if TYPE_CHECKING:
    from types import ModuleType

HEIGHT: Final = 0.05
"""Largest drawn displacement over the size of the body."""
COLOURS: Final = "viridis"  # told apart with every common colour blindness, and in grey
UNTOLD: Final = "#D8DADD"
SIZE: Final = (760, 560)
SHOWN: Final = 12  # on a sheet
MILLISECONDS: Final = 150  # of each picture
ALMOST: Final = 0.98  # of all that is seen at all times is below the end of the colour scale
OWN: Final = 60  # of 256 colours, for the scale
STRESS: Final = "von Mises [Pa]"
_BAR: Final = {
    "n_labels": 2,
    "fmt": "%.3g",
    "label_font_size": 13,
    "title_font_size": 14,
    "position_x": 0.64,
    "position_y": 0.86,
    "width": 0.34,
    "height": 0.09,
    "color": "black",
}


@dataclass(frozen=True, eq=False)
class StressWave:
    """A body at F times.

    Attributes:
        skin: what is seen of it, S nodes.
        mises: (F, S) von Mises stress [Pa]; nan where none is known.
        displacement: (F, S, 3) of the nodes [m].
        time: (F,) [s].
        touch: time of the first touch [s].
        told: (S,) nodes away from singular edges, which determine the colour scale.
        note: to be said below.
    """

    skin: Skin
    mises: Array
    displacement: Array
    time: Array
    touch: float
    told: NDArray[np.bool_]
    note: str = ""

    def check(self) -> None:
        """Raise `PictureError` of what does not fit together, or has no stress at all."""
        frames, nodes = len(self.time), len(self.skin.nodes)
        if self.mises.shape != (frames, nodes) or self.displacement.shape != (frames, nodes, 3):
            raise PictureError(f"{frames} times of {nodes} nodes need as many stresses, not {self.mises.shape}")
        if not np.isfinite(self.mises[:, self.told]).any():
            raise PictureError("no stress is computed anywhere on this body: lower stress.distance")

    @cached_property
    def end(self) -> float:
        """Return the end of the colour scale of all times [Pa]: the first touch, short and narrow, is beyond it."""
        return float(np.nanquantile(self.mises[:, self.told], ALMOST)) or 1.0

    @cached_property
    def exaggeration(self) -> float:
        """Return the factor of drawn over true displacements: one of 1, 2, 5, 10, ..."""
        farthest = float(np.abs(self.displacement).max()) or 1e-30
        return round_factor(HEIGHT * self.skin.size / farthest)

    def below(self) -> str:
        """Return the words below every picture."""
        end, most = text(self.end, "Pa"), text(float(np.nanmax(self.mises[:, self.told])), "Pa")
        return f"yellow: {end} and more, largest {most}; displacements {self.exaggeration:g} times{self.note}"

    def heading(self, frame: int) -> str:
        """Time, and that since the first touch."""
        since = float(self.time[frame]) - self.touch
        return f"{text(float(self.time[frame]), 's', 5)} (touch {'+' if since >= 0 else '-'} {text(abs(since), 's')})"


def animate_wave(wave: StressWave, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw an endless GIF of a wave; the colour scale is that of all times.

    Raises:
        PictureError: what drawing needs is missing, parts that do not fit together.
    """
    images = _drawn(wave, range(len(wave.time)), title)
    import matplotlib

    scale = 255 * matplotlib.colormaps[COLOURS](np.linspace(0.0, 1.0, OWN))[:, :3]
    write_gif(images, np.concatenate([np.full((1, 3), 255), scale]), path, MILLISECONDS)


def plot_wave(wave: StressWave, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw `SHOWN` of its times on one sheet, or all where they are fewer. Raises as `animate_wave`."""
    chosen = np.unique(np.linspace(0, len(wave.time) - 1, min(SHOWN, len(wave.time))).round().astype(int))
    images = crop(_drawn(wave, chosen.tolist(), ""))
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    headings = [wave.heading(k) for k in chosen]
    factor, unit = scaled(wave.end, "Pa")
    with album(images, headings, path, title or "Stress wave", 3 if len(images) > 4 else 2) as figure:
        scale = ScalarMappable(Normalize(0.0, factor * wave.end), COLOURS)
        bar = figure.colorbar(scale, ax=figure.axes, orientation="horizontal", aspect=50, shrink=0.6, pad=0.02)
        bar.set_label(f"von Mises [{unit}]\n{wave.below()}", fontsize=8)


def write_wave(wave: StressWave, path: str | os.PathLike[str]) -> None:
    """Write the same for ParaView: NAME.pvd and NAME/0001.vtu, ..., the body at rest with its displacement and stress.

    Raises:
        PictureError: pyvista is missing, parts that do not fit together.
    """
    wave.check()
    fields = (
        {STRESS: mises[wave.skin.which], DISPLACEMENT: wave.skin.moved(displacement)}
        for mises, displacement in zip(wave.mises, wave.displacement, strict=True)
    )
    write_frames(wave.skin.points, wave.skin.triangles, zip(wave.time, fields, strict=True), path)


def _drawn(wave: StressWave, frames: Any, title: str) -> list[Image]:
    """Return images of the frames, with colour scale and words where there is a title."""
    wave.check()
    pyvista = load_pyvista()
    plotter, images = new_plotter(pyvista, SIZE), []
    factor, unit = scaled(wave.end, "Pa")
    surface, seen = _surface(pyvista, wave.skin), [wave.skin.points + _off(wave, k) for k in frames]
    everything, name = np.concatenate(seen), f"von Mises [{unit}]"
    for k, points in zip(frames, seen, strict=True):
        plotter.clear_actors()
        surface.points = points
        surface.point_data[name] = factor * wave.mises[k][wave.skin.which]
        drawn = plotter.add_mesh(
            surface.copy(),
            scalars=name,
            cmap=COLOURS,
            clim=(0.0, factor * wave.end),
            nan_color=UNTOLD,
            smooth_shading=True,
            split_sharp_edges=True,
            show_scalar_bar=False,
            **LIGHT,
        )
        if title:
            plotter.add_scalar_bar(name, mapper=drawn.mapper, **_BAR)
            plotter.add_text(f"{title}\n{wave.heading(k)}", position=(14, SIZE[1] - 54), font_size=9, color="black")
            plotter.add_text(wave.below(), position=(14, 12), font_size=7, color="black")
        aim(plotter, everything, 0.09 * wave.skin.size if title else 0.0, ABOVE)
        images.append(shoot(plotter))
        if title:
            plotter.remove_scalar_bar(name)
    plotter.close()
    return images


def _off(wave: StressWave, frame: int) -> Array:
    return wave.exaggeration * wave.skin.moved(wave.displacement[frame])


def _surface(pyvista: ModuleType, skin: Skin) -> Any:
    return pyvista.PolyData.from_regular_faces(skin.points, skin.triangles)
