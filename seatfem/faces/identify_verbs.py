"""The verb identify, which takes a record file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from seatfem.faces.terminal import COMMON, DONE, Common, Output, lines, print_outcome, progress_of
from seatfem.study.identify import fit


def identify(
    record: Annotated[
        Path, Parameter(help="The record file (TOML): a scene, records, keys to be fitted (docs/howto/identify.md).")
    ],
    /,
    *,
    output: Output = None,
    no_pictures: Annotated[bool, Parameter(negative="", help="Numbers and files only.")] = False,
    common: Common = COMMON,
) -> int:
    """Find the values of a scene's keys that explain records of force, strain or motion, each with its interval.

    Parameters
    ----------
    output:
        Folder for identify.json and identify.png [default: the record file's name + "-identify"].
    """
    folder, messages = output or Path(f"{record.stem}-identify"), lines(stderr=True, quiet=common.quiet)
    with progress_of(common) as progress:
        result = fit.identify(record, progress=progress, tell=messages.print)
    files, gap = fit.write(result, folder, pictures=not no_pictures)
    print_outcome(lines(quiet=common.quiet), result.sentences(), [gap], files)
    return DONE


VERBS: Final = (identify,)
