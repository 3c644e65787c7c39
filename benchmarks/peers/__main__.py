"""Other programs beside ours: benchmarks/results/peers.json and, from it, docs/peers.md.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.peers [table ...]

Without names all tables are made; with names these alone, the others stay as they were found. ``page``: the page alone.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from benchmarks.peers import calculix, impact_scene, tables
from benchmarks.table import RESULTS, Table, machine, timed
from impact.files.safe_files import write_whole
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import solve_modes

FOUND, PAGE = RESULTS / "peers.json", Path(__file__).parents[2] / "docs" / "peers.md"
START = "import seatfem; seatfem.assemble, seatfem.solve_modes, seatfem.greens_function"

HEAD = """# Peers

This page compares other programs with seatfem on the same mesh, [another](trade_programs.md) on the same scenes;
`python -m benchmarks.peers` writes it from `benchmarks/results/peers.json`. The deck for CalculiX is written from our
own model (nodes, elements, constrained components, nodal forces of the port: `seatfem export --to calculix`). The
body is an annular seat of steel, clamped at its underside, in tetrahedra of ten nodes.

{peers}; seatfem with {versions}, on {processor}, one thread each. Times are processor seconds while other
programs were running: compare the ratios, which are theirs over ours.
"""

LIMITS = """## Strengths of each program

- seatfem: direct dynamics gives the response to one load, and ccx factorizes twice in every step; our Green's
  function is computed once and used again for every reed, law and speed. Our error is estimated; that of a time step
  in ccx is not.
- CalculiX: its times include reading the deck and writing the results, and it starts immediately; we load Python and
  its libraries for {start:.1f} s of processor time, not counted above. It needs no band. It has many more elements,
  plasticity, large displacements, friction, heat and flow; we have none of these.
- Debian's ccx uses SPOOLES; builds with PARDISO or PaStiX, which its manual calls faster, were not measured.
  Hexahedra are not compared: ours of second order have 27 nodes, CalculiX's C3D20 have 20.
- scikit-fem and SciPy need forty lines and no reduction; each step of each scene is a solution with the factor.
"""


def start() -> float:
    """Return the processor seconds until our functions can be called."""
    return timed(lambda: subprocess.run([sys.executable, "-c", START], check=True))[1]


def peers() -> list[str]:
    """Return the versions of those that are installed."""
    here = [] if calculix.absent() else [calculix.version()]
    return [*here, *(f"{name} {version(name)}" for name in ("scikit-fem", "scipy"))]


def warm() -> None:
    """Compile kernels and load libraries."""
    model = impact_scene.seat(impact_scene.mesh())
    solve_modes(model, 2)
    greens_function(model, bandwidth=1e5, duration=1e-5, tolerance=0.1)


TABLES: Final[dict[str, tuple[str, Callable[[], Table], Callable[[], str]]]] = {
    "modes": ("Natural modes", tables.modes_table, calculix.absent),
    "impact": ("The impact", tables.impact_table, str),
}


def measured(name: str) -> dict[str, Any]:
    """Return one table, or why it is left out."""
    title, make, absent = TABLES[name]
    if reason := absent():
        return asdict(Table(title, (f"Left out: {reason}.",), (), ()))
    return asdict(make())


def page(found: dict[str, Any]) -> str:
    """Return the page of what was found."""
    about = found["machine"]
    versions = f"Python {about['python']}, NumPy {about['numpy']} and Numba {about['numba']}"
    head = HEAD.format(peers=", ".join(found["peers"]), versions=versions, processor=about["processor"])
    shown = [Table(**found["tables"][name]) for name in TABLES if name in found["tables"]]
    parts = [each.markdown() if each.rows else "\n".join([f"## {each.title}", "", *each.notes, ""]) for each in shown]
    return "\n".join([head, *parts, LIMITS.format(start=found["start"])])


def main(names: list[str]) -> None:
    """Make the tables asked for, then the page of all."""
    if unknown := sorted({*names} - {*TABLES, "page"}):
        raise SystemExit(f"no table {', '.join(unknown)}; there are {', '.join(TABLES)} and page")
    found = json.loads(FOUND.read_text(encoding="utf-8")) if FOUND.exists() else {"tables": {}}
    if names != ["page"]:
        warm()
        found |= {"machine": machine(), "peers": peers(), "start": start()}
    for name in names or TABLES:
        if name != "page":
            found["tables"][name] = measured(name)
            write_whole(FOUND, (json.dumps(found, indent=1) + "\n").encode())
    write_whole(PAGE, page(found).encode())


if __name__ == "__main__":
    main(sys.argv[1:])
