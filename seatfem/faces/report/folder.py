"""The folder of a run, as a page reads it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from impact.files.input_files import MB, read_text
from seatfem.results import IMPULSE
from seatfem.study.runs.pipeline import SUMMARY_FILE

MOST_TEXT: Final = 4 * MB


class ReportError(ValueError):
    """A folder that holds no run, or files of one that cannot be read; the message names the file and the remedy."""


def run_summary(folder: Path) -> dict[str, Any]:
    """Return summary.json of a run. Raises `ReportError` for a folder that holds none, or one that is not whole."""
    path = folder / SUMMARY_FILE
    if folder.is_file():
        raise ReportError(f"{folder}: is a file; give the folder of a run (seatfem run -o), as {folder.stem}-result")
    try:
        summary = json.loads(read_text(path, MOST_TEXT, ReportError))
    except FileNotFoundError:
        raise ReportError(f"{folder}: holds no {SUMMARY_FILE}; give the folder of a run (seatfem run -o)") from None
    except ValueError as error:
        raise (
            error
            if isinstance(error, ReportError)
            else ReportError(f"{path}: is no JSON ({error}); run the scene again")
        ) from None
    if not isinstance(summary, dict) or IMPULSE not in summary:
        raise ReportError(f"{path}: is no summary of a run; give the folder of a run (seatfem run -o)")
    return summary


def text_of(path: Path) -> str:
    """Return the text of a file beside the results; "" where there is none."""
    return read_text(path, MOST_TEXT, ReportError) if path.is_file() else ""
