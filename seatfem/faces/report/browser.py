"""A page shown in the browser of this machine, where there is one."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path
from typing import Final

SCREENS: Final = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Variables of the environment, one of which is set where a browser of its own window, or one of choice, can open."""


def open_in_browser(page: Path) -> bool:
    """Open a page in the user's browser; return whether there is one."""
    if sys.platform not in ("win32", "darwin") and not any(os.environ.get(name) for name in SCREENS):
        return False  # else a browser in letters would take the terminal
    try:
        return webbrowser.open(page.resolve().as_uri())
    except (webbrowser.Error, OSError, ValueError):  # of a variable BROWSER that cannot be read
        return False
