"""Where this user's computed Green's functions and measured rates are kept."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

VARIABLE: Final = "SEATFEM_STORE"


def cache_folder() -> Path:
    """The folder of the environment variable SEATFEM_STORE, or the user's cache (XDG_CACHE_HOME)."""
    if given := os.environ.get(VARIABLE):
        return Path(given)
    if cache := os.environ.get("XDG_CACHE_HOME"):
        return Path(cache) / "seatfem" / "greens"
    try:
        return Path.home() / ".cache" / "seatfem" / "greens"
    except RuntimeError:  # a user without a home, as in containers: nothing can be written there
        return Path(os.devnull) / "seatfem"
