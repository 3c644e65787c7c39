"""The numbers of a scene as the command line writes them, and how far they are from those on file."""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from seatfem.faces.cli import run_command

ROOT: Final = Path(__file__).parents[2]
FILE: Final = Path(__file__).with_name("numbers.json")
HELP: Final = Path(__file__).with_name("help.json")
VARY: Final = re.compile(
    r"time_s$|seconds|memory|_bytes|version|machine|stages|wall|^notes|pictures|store|threads|created|energy_residual|_residual$|"
    r"engine|advice|history|predicted_(time|memory)|reused|words"
)
"""Keys of numbers that change from run to run or machine to machine, and of texts."""
MOST: Final = 3  # of a list, as of landings
OF_BAR: Final = 0.05  # of an error bar, by which a number with one may move where the same libraries computed it
SAME: Final = 1e-4  # relative: of numbers without one
OF_BARS: Final = 0.05  # relative: of bars and predictions, which are sums of small differences
LIBRARIES: Final = ("numpy", "scipy", "gmsh", "scikit-fem", "pypardiso", "numba")
FOREIGN: Final = 20.0  # times as far where other versions of them did


def scenes() -> Mapping[str, Path]:
    """Return the scenes that are frozen, by name: all examples, and those beside this file."""
    examples = sorted({*(ROOT / "examples").glob("*.toml")} - {*(ROOT / "examples").glob("*_study.toml")})
    return {path.stem: path for path in (*examples, *sorted((Path(__file__).parent / "scenes").glob("*.toml")))}


def versions() -> dict[str, str]:
    """Return the versions of the libraries that numbers depend on."""
    return {name: version(name) for name in LIBRARIES}


def numbers_of(scene: Path, folder: Path) -> dict[str, Any]:
    """Return the numbers that `seatfem run` writes of a scene: of its summary and its plan, by key.

    The store of seats must be empty: what was computed before may be finer.
    """
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = run_command(["run", str(scene), "--no-pictures", "-o", str(folder)])
    assert code in (0, 1), said.getvalue()[-2000:]
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    return dict(_flat("", summary)) | dict(_flat("plan.", plan))


def _flat(prefix: str, content: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(content, Mapping):
        for key, value in content.items():
            if not VARY.search(str(key)):
                yield from _flat(f"{prefix}{key}.", value)
    elif isinstance(content, list):
        for number, value in enumerate(content[:MOST]):
            yield from _flat(f"{prefix}{number}.", value)
    elif content is None or isinstance(content, bool | int | float):
        yield prefix.rstrip("."), float(f"{content:.8g}") if isinstance(content, float) else content


def moved(now: Mapping[str, Any], frozen: Mapping[str, Any], *, foreign: bool = False) -> list[str]:
    """Return a line for each number that is missing, new, or further off than it may be.

    ``foreign``: the frozen ones were computed with other versions of the libraries.
    """
    lines = [f"{key}: is no longer there" for key in sorted(frozen.keys() - now.keys())]
    lines += [f"{key}: is new" for key in sorted(now.keys() - frozen.keys())]
    for key in sorted(frozen.keys() & now.keys()):
        value, before = now[key], frozen[key]
        if isinstance(value, bool) or isinstance(before, bool) or value is None or before is None:
            lines += [f"{key}: {before} -> {value}"] if value != before else []
        elif not math.isclose(value, before, rel_tol=SAME, abs_tol=(FOREIGN if foreign else 1.0) * _slack(key, frozen)):
            lines.append(f"{key}: {before:.9g} -> {value:.9g}")
    return lines


def _slack(key: str, frozen: Mapping[str, Any]) -> float:
    """Return by how much a number may move in its own unit."""
    folder, _, name = key.rpartition(".")
    bar = frozen.get(f"{folder}.error_bar_{name}" if folder else f"error_bar_{name}")
    if isinstance(bar, float) and math.isfinite(bar):
        return OF_BAR * bar
    value = frozen[key]
    if "error" in key or key.startswith("plan."):
        return OF_BARS * abs(value)
    return 1e-12


def help_of_verbs() -> dict[str, str]:
    """Return what `seatfem --help` and the help of each verb say, by verb."""
    from seatfem.faces.cli import app  # cyclopts, with all verbs

    verbs = sorted(name for name in app if not name.startswith("-"))
    return {verb: _help([verb] if verb else []) for verb in ("", *verbs)}


def _help(verb: list[str]) -> str:
    """Return the words of a help, however wide the terminal is."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        run_command([*verb, "--help"])
    return " ".join(re.sub(r"[\u2500-\u257f]", " ", said.getvalue()).split())
