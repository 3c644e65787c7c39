"""Readers against the sizes of their files: time and memory must grow as the file does, not as its square.

`python -m tests.fuzz.sizes [--bytes N] [NAME ...]` makes each kind of file eight times as large again and again, up to
N bytes, reads it in a process of its own, and prints what that took; tests do so with fewer bytes.
"""

import argparse
import itertools
import json
import math
import os
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

import impact
from impact.bodies.time_series import read_time_series
from impact.measured.frf import read_frf
from impact.measured.reading import read_impulse_response
from impact.storage.hdf5 import load_greens, load_results, save_greens
from seatfem.machine.resources import forget_peak, peak_memory
from seatfem.pictures.moving import load_moving
from seatfem.structures.formats.dxf import read_outline
from seatfem.structures.formats.matrices import read_matrices
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.formats.uff import read_impulse_response_uff, read_modes_uff
from seatfem.structures.kinds.measured import read_columns
from seatfem.structures.shapes.cad import check_readable, stated_unit, step_face_names
from seatfem.study.scene import load_scene
from seatfem.study.scene.strength import load_strength
from seatfem.study.sweep.runner import read_journal as read_study_journal
from seatfem.study.sweep.study import load_study
from tests.uff_sets import function_set, unit_set, write_sets

from . import scenes
from .hdf5 import seal

FACTOR: Final = 8  # from one size to the next
MARGIN: Final = 3.0  # on time in proportion to bytes; a square takes `FACTOR` times the proportion
SHORTEST: Final = 0.06  # s below which a time says nothing: caches, and other work of the machine
HELPER: Final = 300 << 20  # bytes of a helping process without a file
LONG: Final = 20.0  # s after which a file is not made larger; a reader that takes so long for so little is a defect
FIRST: Final = 64  # things in the first file
MEMORY: Final = 100 << 20  # bytes that any file may take
PER_BYTE: Final = 120  # and more for each byte of the file: a word of a text becomes an object of Python
OURS: Final = (ValueError, OSError)
"""What readers raise of files that they refuse."""


@dataclass(frozen=True)
class Growth:
    """Files of one kind, of any number of things, and their reader.

    Attributes:
        name: of the kind, whose ending is the file's.
        write: fills a path with a file of so many things.
        read: opens it; may refuse it by one of `OURS`.
    """

    name: str
    write: Callable[[Path, int], object]
    read: Callable[[Path], object]


@dataclass(frozen=True)
class Reading:
    """A file that was read: things in it, its bytes, seconds of the processor, bytes of memory, and what it ended with
    ("" where it was read)."""

    count: int
    size: int
    seconds: float
    memory: int
    ended: str


def growths() -> Iterator[Growth]:
    """Yield every kind of file."""
    mesh = partial(read_mesh, contact=None, fixed=None, unit=1e-4)
    texts: dict[str, tuple[Callable[[int], str], Callable[[Path], object]]] = {
        "elements.bdf": (lambda n: _bulk(n), mesh),
        "held-nodes.bdf": (lambda n: _bulk(4) + "SPC1,1,123,1,THRU,4\n" * n, mesh),
        "continued.bdf": (lambda n: _bulk(4) + "SPC1,1,123,1\n" + "+,1,2,3,4\n" * n, mesh),
        "one-place.bdf": (lambda n: _bulk(n, spread=0.0), mesh),
        "elements.inp": (_deck, mesh),
        "sets.inp": (lambda n: _deck(4) + "".join(f"*NSET, NSET=N{k}\n1, 2, 3\n" for k in range(n)), mesh),
        "surfaces.inp": (lambda n: _deck(4) + "".join(f"*SURFACE, NAME=N{k}\n1, S1\n" for k in range(n)), mesh),
        "set-of-sets.inp": (lambda n: _deck(4) + "*NSET, NSET=A\n1,2\n*NSET, NSET=B\n" + "A,A\n" * n, mesh),
        "elements.unv": (_universal, mesh),
        "groups.unv": (lambda n: _universal(4, groups=n), mesh),
        "elements.vtk": (_vtk, mesh),
        "elements.mesh": (_medit, mesh),
        "blanks.xdmf": (lambda n: "<Xdmf>" + ">" + " " * n, mesh),
        "brackets.xdmf": (lambda n: "<Xdmf>" + "<a>:/" * n, mesh),
        "doctypes.vtu": (lambda n: "<!" + " " * n + "<! " * n, mesh),
        "lines.dxf": (lambda n: _drawing(LINE.format(k, k + 1) for k in range(n)), read_outline),
        "points.dxf": (
            lambda n: _drawing(["0\nLWPOLYLINE\n70\n1\n", *(POINT.format(k, k * k) for k in range(n))]),
            read_outline,
        ),
        "circles.dxf": (lambda n: _drawing(CIRCLE.format(3 * k) for k in range(n)), read_outline),
        "others.dxf": (lambda n: _drawing(["0\nTEXT\n1\na\n"] * n), read_outline),
        "points.step": (
            lambda n: STEP.format("".join(f"#{k}=CARTESIAN_POINT('',(0.,0.,{k}.));\n" for k in range(n))),
            _step,
        ),
        "faces.step": (lambda n: STEP.format("#1=ADVANCED_FACE('',(" * n), _step),
        "units.step": (lambda n: STEP.format("#1=(LENGTH_UNIT( " * n), _step),
        "series.csv": (lambda n: _table("time [us],pressure [bar]", n), _pressures),
        "impulse.csv": (lambda n: _table("time [us],impulse_response [um/(N s)]", n), read_impulse_response),
        "frf.csv": (
            lambda n: _table("frequency [Hz],receptance real [m/N],receptance imag [m/N]", n, columns=3),
            read_frf,
        ),
        "heights.csv": (lambda n: _table("x [mm],y [mm]", n), partial(read_columns, known=LENGTHS, needed=("x",))),
        "commas.csv": (lambda n: "time [s],force [N]\n" + "," * n, _forces),
        "quotes.csv": (lambda n: 'time [s],force [N]\n"' + 'a"",' * n, _forces),
        "blanks.csv": (
            lambda n: "x" + " " * n + "[mm" + " " * n + ",y\n1,2\n",
            partial(read_columns, known=LENGTHS, needed=("x",)),
        ),
        "diagonal.mtx": (_market, _matrices),
        "scene.toml": (
            lambda n: scenes.CHEAP["spring-reed"] + "".join(f"[[load]]\nforce = '{k} N'\n" for k in range(n)),
            load_scene,
        ),
        "keys.toml": (
            lambda n: scenes.CHEAP["spring-reed"] + "[more]\n" + "".join(f"k{k} = {k}\n" for k in range(n)),
            load_scene,
        ),
        "study.toml": (lambda n: STUDY.format(", ".join(f"'{k + 1} us'" for k in range(n))), load_study),
        "strength.toml": (
            lambda n: STRENGTH.format(", ".join(f"['{1e9 / (k + 1)} Pa', {k + 1}.0]" for k in range(n))),
            load_strength,
        ),
        "study.jsonl": (
            lambda n: '{"key": "a", "changed": {}, "outcome": {"state": "done"}}\n' * n,
            read_study_journal,
        ),
    }
    for name, (text, read) in texts.items():
        yield Growth(name, partial(_write_text, text), read)
    yield Growth("modes.uff", _modes, partial(read_modes_uff, ports={"contact": (7, "+z")}))
    yield Growth("impulse.uff", _response, partial(read_impulse_response_uff, ports={"contact": (7, "+z")}))
    yield Growth("diagonal.npz", _packed_matrix, _matrices)
    yield Growth("modes.h5", _modal, load_greens)
    yield Growth("samples.h5", _sampled, load_greens)
    yield Growth("parts.h5", _sum, load_greens)
    yield Growth("groups.h5", partial(_crowd, groups=True), load_greens)
    yield Growth("attributes.h5", partial(_crowd, groups=False), load_greens)
    yield Growth("results.h5", _results, load_results)
    yield Growth("body.h5", partial(_crowd, groups=True), load_moving)


def measured(growth: Growth, most: int, enough: float = 1.0) -> list[Reading]:
    """Return what files of one kind took, each `FACTOR` times as large as the one before: until one takes ``enough``
    seconds, or the next would have more than ``most`` bytes."""
    readings: list[Reading] = []
    with tempfile.TemporaryDirectory(prefix="sizes-") as folder:
        count = FIRST
        while True:
            path = Path(folder) / growth.name
            growth.write(path, count)
            readings.append(_in_a_child(growth, path, count))
            last = readings[-1]
            if last.seconds >= enough or FACTOR * last.size > most:
                return readings
            count *= FACTOR


def defects(readings: list[Reading]) -> Iterator[str]:
    """Yield in words where time or memory has grown faster than the file, or a reader has ended by another error."""
    for reading in readings:
        if reading.ended.startswith("!"):
            yield f"{reading.count}: {reading.ended}"
        if reading.memory > MEMORY + PER_BYTE * reading.size:
            yield f"{reading.count}: {reading.memory / 1e6:.0f} MB of memory for {reading.size / 1e6:.3g} MB"
    for before, after in itertools.pairwise(readings):
        proportion = after.size / before.size
        if after.seconds > MARGIN * proportion * max(before.seconds, SHORTEST):
            yield (
                f"{before.count} -> {after.count}: {after.seconds / max(before.seconds, SHORTEST):.3g} times the time "
                f"({before.seconds:.3g} -> {after.seconds:.3g} s) for {proportion:.3g} times the bytes"
            )


def _in_a_child(growth: Growth, path: Path, count: int) -> Reading:
    tries = [_read_once(growth, path)]
    if tries[0][0] > SHORTEST:
        tries.append(_read_once(growth, path))  # of which the faster counts
    seconds = min(each[0] for each in tries)
    return Reading(count, path.stat().st_size, seconds, max(each[1] for each in tries), tries[0][2])


def _read_once(growth: Growth, path: Path) -> tuple[float, int, str]:
    """Seconds, memory and the end of a reader in a process of its own, with those that it starts."""
    out, into = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(out)
        ended, before = "", int(forget_peak())
        resource.setrlimit(resource.RLIMIT_CPU, (int(LONG), int(LONG) + 1))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        try:
            growth.read(path)
        except OURS as error:
            ours = type(error).__module__.partition(".")[0] in ("seatfem", "impact") or isinstance(error, OSError)
            ended = f"{'' if ours else '!'}{type(error).__name__}: {str(error)[:200]}"
        except BaseException as error:
            ended = f"!{type(error).__name__}: {str(error)[:200]}"
        helper = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss - HELPER
        taken = max(0, int(peak_memory()) - before, helper)
        os.write(into, json.dumps([taken, ended]).encode())
        os._exit(0)
    os.close(into)
    with os.fdopen(out, "rb") as pipe:
        said = pipe.read().decode()
    _, status, used = os.wait4(child, 0)
    memory, ended = json.loads(said) if said else (0, f"!ended by {os.waitstatus_to_exitcode(status)}")
    return used.ru_utime + used.ru_stime, memory, ended


LENGTHS: Final = {"x": "length", "y": "length"}
LINE: Final = "0\nLINE\n10\n{}\n20\n0\n11\n{}\n21\n0\n"
POINT: Final = "10\n{}\n20\n{}\n"
CIRCLE: Final = "0\nCIRCLE\n10\n{}\n20\n0\n40\n1\n"
STEP: Final = "ISO-10303-21;\nHEADER;ENDSEC;DATA;\n{}\nENDSEC;\nEND-ISO-10303-21;"
STUDY: Final = "scene = 'scene.toml'\n[vary]\n'run.duration' = [{}]\n"
STRENGTH: Final = scenes.STRENGTH[: scenes.STRENGTH.index("points")] + "points = [{}]\n"


def _write_text(text: Callable[[int], str], path: Path, count: int) -> None:
    path.write_text(text(count), encoding="utf-8")
    if path.name == "study.toml":
        path.with_name("scene.toml").write_text(scenes.CHEAP["spring-reed"], encoding="utf-8")


def _points(count: int) -> list[tuple[float, float, float]]:
    """Return the corners of so many tetrahedra in a row, each of which shares a face with the next: a helix."""
    turn, radius, rise = math.acos(-2 / 3), 0.3 * math.sqrt(3), 1 / math.sqrt(10)
    return [(radius * math.cos(turn * k), radius * math.sin(turn * k), rise * k) for k in range(count + 3)]


def _bulk(count: int, *, spread: float = 1.0) -> str:
    nodes = [
        f"GRID,{k},,{spread * x:.5f},{spread * y:.5f},{spread * z:.5f}\n"
        for k, (x, y, z) in enumerate(_points(count), 1)
    ]
    solids = [f"CTETRA,{k},1,{k},{k + 1},{k + 2},{k + 3}\n" for k in range(1, count + 1)]
    return "".join(nodes + solids)


def _deck(count: int) -> str:
    nodes = [f"{k},{x:.5f},{y:.5f},{z:.5f}\n" for k, (x, y, z) in enumerate(_points(count), 1)]
    solids = [f"{k},{k},{k + 1},{k + 2},{k + 3}\n" for k in range(1, count + 1)]
    return "*NODE\n" + "".join(nodes) + "*ELEMENT, TYPE=C3D4, ELSET=all\n" + "".join(solids)


def _universal(count: int, *, groups: int = 1) -> str:
    nodes = [f"{k:10}{1:10}{1:10}{1:10}\n {x:.5e} {y:.5e} {z:.5e}\n" for k, (x, y, z) in enumerate(_points(count), 1)]
    solids = [
        f"{k:10}{111:10}{1:10}{1:10}{1:10}{4:10}\n{k:10}{k + 1:10}{k + 2:10}{k + 3:10}\n" for k in range(1, count + 1)
    ]
    named = [f"{k:10}" + f"{0:10}" * 6 + f"{1:10}\ng{k}\n{8:10}{1:10}{0:10}{0:10}\n" for k in range(1, groups + 1)]
    parts = ((2411, nodes), (2412, solids), (2467, named))
    return "".join(f"    -1\n{number:6}\n{''.join(lines)}    -1\n" for number, lines in parts)


def _vtk(count: int) -> str:
    points = "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in _points(count))
    cells = "".join(f"4 {k} {k + 1} {k + 2} {k + 3}\n" for k in range(count))
    return (
        f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {count + 3} double\n{points}"
        f"CELLS {count} {5 * count}\n{cells}CELL_TYPES {count}\n" + "10\n" * count
    )


def _medit(count: int) -> str:
    points = "".join(f"{x:.5f} {y:.5f} {z:.5f} 0\n" for x, y, z in _points(count))
    cells = "".join(f"{k} {k + 1} {k + 2} {k + 3} 1\n" for k in range(1, count + 1))
    return f"MeshVersionFormatted 2\nDimension 3\nVertices\n{count + 3}\n{points}Tetrahedra\n{count}\n{cells}End\n"


def _drawing(entities: Any) -> str:
    head = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    return head + "".join(entities) + "0\nENDSEC\n0\nEOF\n"


def _step(path: Path) -> None:
    check_readable(path)
    step_face_names(path)
    stated_unit(path)


def _pressures(path: Path) -> None:
    read_time_series(path, "pressure")


def _forces(path: Path) -> None:
    read_time_series(path, "force")


def _matrices(path: Path) -> None:
    read_matrices(path, path, ports={"contact": {0: 1.0}})


def _table(head: str, count: int, columns: int = 2) -> str:
    return head + "\n" + "".join(",".join([str(k + 1), *["1.5"] * (columns - 1)]) + "\n" for k in range(count))


def _market(count: int) -> str:
    rows = "".join(f"{k} {k} 2.5\n" for k in range(1, count + 1))
    return f"%%MatrixMarket matrix coordinate real symmetric\n{count} {count} {count}\n{rows}"


def _packed_matrix(path: Path, count: int) -> None:
    from scipy import sparse

    sparse.save_npz(path, sparse.diags_array(np.random.default_rng(1).random(count) + 1.0).tocsr(), compressed=False)


def _modes(path: Path, count: int) -> None:
    """Modes of dataset 55 by repeating the lines of one."""
    from .corpus import _modes as three

    head = write_sets(path, unit_set()).read_text()
    path.write_text(head + write_sets(path, three()[0]).read_text() * (count // 8))


def _response(path: Path, count: int) -> None:
    time_steps = 1e-6 * np.arange(count)
    write_sets(path, unit_set(), function_set(time_steps, np.exp(-time_steps), in_time=True))


def _modal(path: Path, count: int) -> None:
    omega = 1e3 + np.arange(count, dtype=float)
    save_greens(impact.ModalGreens(omega, 0 * omega + 0.01, np.ones((count, 1)), impact.Residual.none()), path)


def _sampled(path: Path, count: int) -> None:
    save_greens(impact.SampledGreens(np.linspace(0.0, 1e-6, 20 * count), 1e-6, tail="zero"), path)


def _sum(path: Path, count: int) -> None:
    """A sum of so many parts, each in full."""
    _sampled(path, 1)
    with h5py.File(path, "r+") as file:
        leaf = file.create_group("leaf")
        for name, value in file.attrs.items():
            leaf.attrs[name] = value
        file.copy("values", leaf)
        file.attrs["kind"] = "sum"
        for k in range(count):
            file.copy("leaf", f"parts/{k}")
    seal(path)


def _crowd(path: Path, count: int, *, groups: bool) -> None:
    _sampled(path, 8)
    with h5py.File(path, "r+", libver="latest") as file:
        for k in range(count):
            if groups:
                file.create_group(f"more/{k}")
            else:
                file.attrs[f"more-{k}"] = "x" * 20
    seal(path)


def _results(path: Path, count: int) -> None:
    from impact.storage.hdf5 import save_results

    problem = impact.ContactProblem(
        impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.Body(impact.spring(stiffness=1e7))
    )
    save_results(path, {"wave": impact.solve(problem, dt=1e-6, duration=1e-6 * count)}, {})


def _main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="kinds of files; all of them by default")
    parser.add_argument("--bytes", type=int, default=16 << 20, help="largest file")
    parser.add_argument("--enough", type=float, default=4.0, help="seconds after which a file is not made larger")
    given = parser.parse_args()
    worst = 0
    for growth in growths():
        if given.names and growth.name not in given.names:
            continue
        start = time.monotonic()
        readings = measured(growth, given.bytes, given.enough)
        found = list(defects(readings))
        worst |= bool(found)
        line = {"name": growth.name, "readings": [asdict(each) for each in readings], "defects": found}
        sys.stdout.write(json.dumps(line | {"clock": time.monotonic() - start}) + "\n")
        sys.stdout.flush()
    return worst


if __name__ == "__main__":
    sys.exit(_main())
