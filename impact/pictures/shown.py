"""A figure that notebooks show. Loads matplotlib: imported where a figure is made."""

from __future__ import annotations

import io

import matplotlib
from matplotlib.figure import Figure

from impact.pictures.drawing import SCREEN_DPI, STYLE


class Shown(Figure):
    """Notebooks show by themselves figures of pyplot alone."""

    def _repr_png_(self) -> bytes:
        page = io.BytesIO()
        with matplotlib.rc_context(STYLE):
            self.savefig(page, format="png", dpi=SCREEN_DPI)
        return page.getvalue()
