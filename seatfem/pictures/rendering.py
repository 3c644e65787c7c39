"""Off-screen rendering with pyvista in a separate process, which survives crashes of VTK."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import whole_file
from impact.names import how_to_mend
from impact.pictures.drawing import PictureError, try_draw
from seatfem.jobs import crew, folders
from seatfem.machine.libraries import picture_library_gap, select_offscreen_window

if TYPE_CHECKING:
    from types import ModuleType


Image = NDArray[np.uint8]

View = tuple[float, float, float]

ABOVE: Final[View] = (0.45, -1.0, 0.62)
BELOW: Final[View] = (0.45, -1.0, -0.62)
"""Directions from the body to the camera."""
BORDER: Final = 6  # white border of cropped images [pixels]
NO_DRIVER: Final = (
    "no pictures: VTK cannot draw off-screen, an OpenGL driver is missing; "
    "install it: apt-get install libegl1 libgl1-mesa-dri"
)
TRIED: Final = "SEATFEM_VTK_TRIED"
"""Environment variable of the drawing process, in which VTK needs no trial: a crash is harmless there."""

_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(16, 16)
window.Render()
raise SystemExit(0 if window.SupportsOpenGL() else 1)
"""


def load_pyvista() -> ModuleType:
    """Return pyvista after checking that VTK can draw off-screen.

    Raises:
        PictureError: a package, system library or driver is missing; the message names the command that installs it.
    """
    if gap := picture_library_gap():
        raise PictureError(gap)
    select_offscreen_window()
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # without a try at X, which warns
    if not can_draw():
        raise PictureError(NO_DRIVER)
    return import_pyvista()


@cache
def can_draw() -> bool:
    """Return whether VTK can draw: tried once, in a process (0.6 s), since libEGL without a driver crashes it."""
    if os.environ.get(TRIED):
        return True
    try:
        tried = subprocess.run([sys.executable, "-P", "-c", _PROBE], capture_output=True, timeout=60, check=False)
    except subprocess.TimeoutExpired:
        return False
    return tried.returncode == 0


def import_pyvista() -> ModuleType:
    """Return pyvista for files only, without testing whether it can draw.

    Raises:
        PictureError: it is missing or broken.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings by third-party modules at import
            import pyvista
    except Exception as missing:  # a broken installation may raise any error
        raise PictureError(how_to_mend("pyvista", "pictures", missing)) from missing
    return pyvista


def new_plotter(pyvista: ModuleType, size: tuple[int, int], *, shrunk: bool = False) -> Any:
    """Return an off-screen plotter on white, with the theme of this package; antialiased, unless its images are
    ``shrunk`` to half their size or less, which smooths them in a third of the time."""
    theme = pyvista.themes.DocumentTheme()
    plotter = pyvista.Plotter(off_screen=True, notebook=False, window_size=list(size), theme=theme)
    if shrunk:
        plotter.disable_anti_aliasing()
    else:
        plotter.enable_anti_aliasing("msaa", multi_samples=4)  # in software, SSAA takes 1.5 times as long
    plotter.show(auto_close=False)
    plotter.suppress_rendering = True  # otherwise every actor and every camera motion would render, in software
    return plotter


def aim(plotter: Any, points: NDArray[np.float64], margin: float, view: View = ABOVE) -> None:
    """Set a parallel camera that sees all ``points`` (n, 3) and ``margin`` [m] around them, z upwards."""
    towards = np.asarray(view) / np.linalg.norm(view)
    right = np.cross((0.0, 0.0, 1.0), towards)
    right /= np.linalg.norm(right)
    up = np.cross(towards, right)
    low, high = points.min(axis=0), points.max(axis=0)
    spans = [(float((points @ axis).min()) - margin, float((points @ axis).max()) + margin) for axis in (right, up)]
    middle = (low + high) / 2
    focus = middle + sum(
        (0.5 * (a + b) - float(middle @ axis)) * axis for (a, b), axis in zip(spans, (right, up), strict=True)
    )
    distance = 3 * float(np.linalg.norm(high - low) + margin)
    width, height = plotter.window_size
    half = max((spans[1][1] - spans[1][0]) / 2, (spans[0][1] - spans[0][0]) / 2 * height / width)
    plotter.enable_parallel_projection()
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + distance * towards
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.parallel_scale = half
    plotter.reset_camera_clipping_range()


def shoot(plotter: Any) -> Image:
    """Return the current image of the plotter (height, width, 3).

    Raises:
        PictureError: nothing was drawn.
    """
    plotter.suppress_rendering = False
    plotter.render()
    image = np.array(plotter.image[..., :3], dtype=np.uint8)
    plotter.suppress_rendering = True
    if float(np.std(image)) == 0.0:
        raise PictureError("VTK drew an empty picture: its OpenGL does not work here; try: seatfem doctor")
    return image


def halved(image: Image) -> Image:
    """Return the image at half the size: each pixel is the mean of four."""
    from PIL import Image as Pillow

    return np.asarray(Pillow.fromarray(image).reduce(2))


def in_few_colours(images: list[Image], fixed: NDArray[Any]) -> list[Any]:
    """Return all images, as Pillow's, in the same 256 colours. ``fixed``: RGB colours (n, 3) in 0..255 that are always
    included, since the quantizer drops colours of small areas."""
    from PIL import Image as Pillow

    always = np.asarray(fixed).astype(int)
    sample = Pillow.fromarray(
        np.concatenate([image[::2, ::2] for image in images[:: max(1, len(images) // 8)]])
    ).quantize(256 - len(always))
    palette = Pillow.new("P", (1, 1))
    palette.putpalette([*always.ravel().tolist(), *(sample.getpalette() or [])[: 3 * (256 - len(always))]])
    return [Pillow.fromarray(image).quantize(palette=palette, dither=Pillow.Dither.NONE) for image in images]


def write_gif(images: list[Image], fixed: NDArray[Any], path: str | os.PathLike[str], milliseconds: int) -> None:
    """Write an endless GIF of the images, quantized by `in_few_colours`."""
    quantized = in_few_colours(images, fixed)
    with whole_file(path) as temporary:
        quantized[0].save(temporary, "GIF", save_all=True, append_images=quantized[1:], duration=milliseconds, loop=0)


def crop(images: list[Image]) -> list[Image]:
    """Return images of equal size without their common white margin, except `BORDER` pixels."""
    inked = np.any([np.any(image < 250, axis=2) for image in images], axis=0)
    (top, bottom), (left, right) = (np.flatnonzero(inked.any(axis=axis))[[0, -1]] for axis in (1, 0))
    rows, columns = (slice(max(a - BORDER, 0), b + BORDER + 1) for a, b in ((top, bottom), (left, right)))
    return [image[rows, columns] for image in images]


TIMEOUT: Final = 900.0  # longest wall time for one picture, sufficient on a busy machine [s]
WORKER: Final = "seatfem.pictures.picture_worker:reply"
READY: Final = "libraries"
"""Name in place of a picture's in a request to load the libraries only."""

Picture = tuple[str, Callable[..., object]]
"""File name, and the function that draws it, called with ``path``."""


@contextmanager
def drawing_apart() -> Iterator[Painter]:
    """Yield a `Painter` with a separate process, which ends with the block.

    If the process crashes or hangs, only the current picture is lost. A drawing that cannot be pickled is drawn in this
    process when it is requested.
    """
    with folders.private_folder("pictures") as private, crew.crew(WORKER) as ask:
        painter = Painter(private, ask)
        try:
            yield painter
        finally:
            painter.end()


class Painter:
    """Client of a worker that draws one picture after the other; a worker that has ended is replaced."""

    def __init__(self, private: Path, ask: crew.Ask) -> None:
        self._private, self._ask, self._taken, self._cannot, self._is_ending = private, ask, 0, "", False
        self._thread = ThreadPoolExecutor(1, "pictures")
        self._drawn: dict[str, Future[str] | Callable[..., object]] = {}  # latest drawing of each name
        self._begun: Future[str] | None = None

    def begin(self) -> None:
        """Start the process and load its libraries, before the first picture is requested."""
        self._begun = self._begun or self._thread.submit(self._drawn_apart, READY)

    def take(self, pictures: Sequence[Picture]) -> None:
        """Queue the pictures; a picture replaces an earlier one of the same name."""
        for name, draw in pictures:
            if isinstance(former := self._drawn.pop(name, None), Future):
                former.cancel()
            self._taken += 1
            drawing = self._private / f"{self._taken}.pickle"
            if _handed_over(draw, drawing):
                self.begin()
                self._drawn[name] = self._thread.submit(self._drawn_apart, name, str(drawing))
            else:
                self._drawn[name] = draw

    def __contains__(self, name: str) -> bool:
        """Return whether a picture of this name was queued."""
        return name in self._drawn

    def wait(self, name: str, folder: Path) -> str:
        """Copy a picture into ``folder`` when it is drawn; return the reason if it could not be drawn, else ""."""
        drawn = self._drawn[name]
        if not isinstance(drawn, Future):
            return try_draw(lambda path: drawn(path=path), folder / name)
        return drawn.result() or try_draw(lambda path: _moved(self._private / name, path), folder / name)

    def end(self) -> None:
        """Draw no more pictures; the worker ends with its crew."""
        self._is_ending = True
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _drawn_apart(self, name: str, drawing: str = "") -> str:
        """Return the reason why a picture was not drawn, or ""; without a ``drawing`` libraries are loaded only."""
        if self._cannot or self._is_ending:
            return self._cannot
        try:
            [(_, answer)] = self._ask([json.dumps([drawing, str(self._private / name)])], TIMEOUT)
        except (OSError, ValueError, RuntimeError, MemoryError) as error:
            return f"{name}: {str(error) or type(error).__name__}"
        if isinstance(answer, str):
            return answer
        problem = "the process that draws it crashed; seatfem doctor shows what may be missing"
        if answer.hung:
            problem = f"no answer within {TIMEOUT:g} s"
        elif not self._is_ending and not can_draw():
            self._cannot = NO_DRIVER
        return self._cannot or f"{name}: {problem}"


def _handed_over(draw: Callable[..., object], drawing: Path) -> bool:
    """Write a drawing to a file for another process, and return whether it can be pickled."""
    try:
        with drawing.open("wb") as file:
            pickle.dump(draw, file, protocol=pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError, OSError, MemoryError):
        return False
    return True


def _moved(drawn: Path, path: Path) -> None:
    with whole_file(path) as temporary:
        shutil.copyfile(drawn, temporary)
