"""Common style of all figures, and their output to files."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.files.safe_files import whole_file
from impact.names import how_to_mend
from impact.notices import SeatfemError
from impact.quantities import scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


DPI, SCREEN_DPI = 180, 100
# Okabe & Ito (2008), distinguishable with every common colour blindness
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#7F7F7F")
BLUE, ORANGE, GREEN, PURPLE, SKY, GREY = COLOURS

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.linewidth": 1.3,
    "lines.solid_joinstyle": "round",
    "legend.fontsize": 8.0,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "none",
    "legend.borderpad": 0.3,
    "figure.titlesize": 10.5,
    "figure.titleweight": "bold",
    "agg.path.chunksize": 20000,
    "svg.fonttype": "none",
}


class PictureError(SeatfemError, RuntimeError):
    """Error of a picture that cannot be drawn; the message names what is missing and the command that repairs it."""


def try_draw(draw: Callable[[Path], object], path: Path) -> str:
    """Draw ``path``; return the reason if it cannot be drawn, by any error of its libraries, or ""."""
    try:
        draw(path)
    except PictureError as gap:
        return str(gap)
    except Exception as problem:
        return f"{path.name}: {type(problem).__name__}: {str(problem) or 'no reason given'}"
    return ""


def load_matplotlib() -> Any:
    """Return matplotlib with the modules that drawings use. Raises what importing it raises."""
    import matplotlib
    import matplotlib.backends.backend_agg
    import matplotlib.cm
    import matplotlib.collections
    import matplotlib.colors
    import matplotlib.figure
    import matplotlib.patches
    import matplotlib.ticker

    return matplotlib


@contextmanager
def sheet(path: str | os.PathLike[str] | None, width: float, height: float) -> Iterator[Figure]:
    """Yield a matplotlib figure of ``width`` x ``height`` [inch] in the common style, written if the block succeeds.

    The suffix of ``path`` determines the format (.png, .pdf, .svg); without a path nothing is written, and the caller
    shows the figure. No global state, pyplot or rcParams, is changed. Raises `PictureError`: matplotlib is missing, or
    cannot write this format.
    """
    try:
        matplotlib = load_matplotlib()
        from matplotlib.figure import Figure
    except Exception as missing:  # a broken installation may raise any error
        name = "a figure" if path is None else Path(path).name
        raise PictureError(f"{name} needs matplotlib: {how_to_mend('matplotlib', 'pictures', missing)}") from missing

    class Shown(Figure):
        """Figure that notebooks display, as they display figures of pyplot."""

        def _repr_png_(self) -> bytes:
            page = io.BytesIO()
            with matplotlib.rc_context(_STYLE):
                self.savefig(page, format="png", dpi=SCREEN_DPI)
            return page.getvalue()

    with matplotlib.rc_context(_STYLE):
        figure = Shown(figsize=(width, height), layout="constrained")
        formats = matplotlib.backends.backend_agg.FigureCanvasAgg(figure).get_supported_filetypes()
        if path is not None and Path(path).suffix[1:].lower() not in formats:
            raise PictureError(f"{Path(path).name}: unknown picture format; use one of .{', .'.join(sorted(formats))}")
        yield figure
        if path is None:
            figure.canvas.draw()  # within the common style
            return
        with whole_file(path) as temporary:
            if Path(path).suffix.lower() == ".png":  # savefig would draw everything a second time, for its layout
                figure.dpi, usual = DPI, figure.dpi
                canvas = matplotlib.backends.backend_agg.FigureCanvasAgg(figure)
                canvas.print_png(temporary, pil_kwargs={"compress_level": 4})
                figure.dpi = usual
            else:
                figure.savefig(temporary, dpi=DPI)


def time_axis(axes: Axes, window: tuple[float, float]) -> float:
    """Show a time window [s] along x, in a readable unit; return its factor."""
    rate, unit = scaled(window[1], "s")
    axes.set(xlim=(rate * window[0], rate * window[1]), xlabel=f"time [{unit}]")
    return rate


def zero_line(axes: Axes) -> None:
    """Draw a thin line at zero behind the curves."""
    axes.axhline(0.0, color=GREY, linewidth=0.6, zorder=1.5)
