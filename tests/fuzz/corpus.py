"""The sound files that mutations start from, written once into a folder."""

import gzip
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from scipy import sparse
from scipy.io import mmwrite

import impact
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper
from impact.storage.hdf5 import save_checkpoint, save_greens, save_results
from seatfem.pictures.moving import save_moving
from seatfem.structures.cache import Store
from seatfem.study.sweep.runner import Outcome, append
from tests.moving_block import block_modes, block_wave
from tests.uff_sets import function_set, mode_set, unit_set, write_sets

from . import scenes

ROOT: Final = Path(__file__).parents[2]
Form = Literal["toml", "hdf5", "text", "bytes"]
Entry = Literal[
    "run",
    "draw",
    "plan",
    "greens",
    "results",
    "checkpoint",
    "series",
    "impulse",
    "impulse-uff",
    "store",
    "journal",
    "moving",
]
MODEL: Final = impact.ModalGreens(
    2 * np.pi * np.array([2e3, 5.1e3, 9.3e3]),
    np.array([0.02, 0.01, 0.03]),
    np.array([[20.0, 5.0], [16.0, -12.0], [12.0, 7.0]]),
    impact.Residual(np.array([[0.01, 0.002]]), np.array([1e5]), 1e-9 * np.eye(2)),
    ("lip", "stop"),
)
SEAT: Final = impact.ModalGreens(
    MODEL.omega, MODEL.zeta, MODEL.shapes[:, :1], impact.Residual.relaxing(1e-8, 1e5), origin={"kind": "own"}
)


@dataclass(frozen=True)
class Specimen:
    """A folder with a sound scene or kernel file.

    Attributes:
        name: of the folder.
        target: the file that is mutated.
        form: how it is mutated, beside byte by byte.
        entry: what reads it: a verb of the program ("draw": `run` up to the call of gmsh), or a reader.
        share: of the cases, relative to the others.
    """

    name: str
    target: str
    form: Form
    entry: Entry
    share: float = 1.0

    @property
    def cheap(self) -> bool:
        """Read in milliseconds: no gmsh, no plan of a drawn seat."""
        by_gmsh = self.target.endswith((".msh", ".med", ".step")) or self.name.endswith("-solved")
        return self.entry not in ("draw", "plan") and not by_gmsh


def build(folder: Path) -> tuple[Specimen, ...]:
    """Every specimen, in a folder of its name below ``folder``; those of an earlier call are read."""
    index = folder / "index.json"
    if not index.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        found = list(_written(folder))
        index.write_text(json.dumps([asdict(specimen) for specimen in found], indent=1), encoding="utf-8")
    return tuple(Specimen(**entry) for entry in json.loads(index.read_text(encoding="utf-8")))


def _written(folder: Path) -> Iterator[Specimen]:
    meshes = _meshes(folder / "meshes")
    yield from _scenes(folder, meshes)
    yield from _lives(folder)
    yield from _greens(folder)
    yield from _matrices(folder)
    yield from _measured(folder)
    yield from _mesh_files(folder, meshes)
    yield from _kept(folder)
    shutil.rmtree(meshes)


def _scenes(folder: Path, meshes: Path) -> Iterator[Specimen]:
    for name, text in scenes.CHEAP.items():
        _scene(folder / name, text)
        yield Specimen(name, "scene.toml", "toml", "run", 4.0)
        yield Specimen(name, "scene.toml", "toml", "plan", 0.5)
    for name, text in scenes.DRAWN.items():
        there = _scene(folder / name, text)
        if name == "cad":
            shutil.copy(ROOT / "meshes" / "stopper.step", there / "part.step")
        if name == "mesh-file":
            shutil.copy(meshes / "tet-1-2.inp", there / "ring.inp")
        yield Specimen(name, "scene.toml", "toml", "draw", 3.0)
        yield Specimen(name, "scene.toml", "toml", "plan", 0.5)
    for name in ("annular", "annular-arc", "bar", "block"):
        _scene(folder / f"{name}-solved", scenes.DRAWN[name])
        yield Specimen(f"{name}-solved", "scene.toml", "toml", "greens", 0.15)
    for name, text in scenes.of_examples().items():
        _scene(folder / f"example-{name}", text)
        yield Specimen(f"example-{name}", "scene.toml", "toml", "draw")


def _lives(folder: Path) -> Iterator[Specimen]:
    """A scene with a file of strength; both are read before anything is computed."""
    there = _scene(folder / "life", scenes.CHEAP["spring-reed"] + scenes.LIFE)
    (there / "strength.toml").write_text(scenes.STRENGTH, encoding="utf-8")
    yield Specimen("life", "strength.toml", "toml", "run", 3.0)
    yield Specimen("life", "scene.toml", "toml", "run", 2.0)


def _scene(folder: Path, text: str) -> Path:
    folder.mkdir()
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return folder


def _greens(folder: Path) -> Iterator[Specimen]:
    t = 1e-6 * np.arange(1001)
    modal = impact.ModalGreens(SEAT.omega, SEAT.zeta, SEAT.shapes, impact.Residual.none())
    sampled = impact.SampledGreens(
        modal.impulse_response(t), 1e-6, tail="zero", static=modal.static_compliance(), origin={"kind": "measured"}
    )
    solid = {"young": 200e9, "density": 7850.0}
    rod = {**solid, "area": 1e-6, "length": 0.03}
    kinds: dict[str, Any] = {
        "modal": SEAT,
        "poles": impact.PoleGreens.from_modal(SEAT),
        "sampled": sampled,
        "delay-rod": impact.fixed_rod(**rod),
        "damped-rod": impact.fixed_rod(**rod, damping_ratio=0.1),
        "half-space": impact.half_space_patch(**solid, poisson=0.3, radius=1e-3),
    }
    for name, greens in kinds.items():
        there = _scene(folder / f"greens-{name}", scenes.GREENS)
        save_greens(greens, there / "seat.h5")
        yield Specimen(there.name, "seat.h5", "hdf5", "run", 5.0 if name in ("modal", "poles", "sampled") else 2.0)
    _scene(folder / "greens-scene", scenes.GREENS)
    save_greens(SEAT, folder / "greens-scene" / "seat.h5")
    yield Specimen("greens-scene", "scene.toml", "toml", "run", 2.0)


def _matrices(folder: Path) -> Iterator[Specimen]:
    n = 12
    line = sparse.diags_array([np.ones(n), np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1, -1])
    k = sparse.csr_array(sparse.diags_array([2.0 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1]))
    k, m = 3e7 * k, sparse.csr_array(1e-3 * (line + 3 * sparse.eye_array(n)))
    for ending in (".mtx", ".npz", ".npy", ".mtx.gz"):
        there = _scene(folder / f"matrices{ending}", scenes.MATRICES.format(ending) + scenes.REED + scenes.RUN)
        (there / "port.csv").write_text(f"dof,weight\n{n},0.5\n{n - 1},0.5\n", encoding="utf-8")
        for name, matrix in (("K", k), ("M", m)):
            path = there / f"{name}{ending}"
            if ending == ".npz":
                sparse.save_npz(path, matrix)
            elif ending == ".npy":
                np.save(path, matrix.toarray())
            else:
                mmwrite(there / f"{name}.mtx", sparse.coo_array(matrix), symmetry="symmetric", precision=17)
            if ending == ".mtx.gz":
                path.write_bytes(gzip.compress((there / f"{name}.mtx").read_bytes(), mtime=0))
        form: Form = "text" if ending == ".mtx" else "bytes"
        yield Specimen(there.name, f"K{ending}", form, "run", 3.0)
        if ending == ".mtx":
            yield from (Specimen(there.name, name, "text", "run", 1.5) for name in ("M.mtx", "port.csv"))
            yield Specimen(there.name, "scene.toml", "toml", "run", 2.0)


def _measured(folder: Path) -> Iterator[Specimen]:
    f = 25.0 * np.arange(4, 500)
    one = impact.ModalGreens(SEAT.omega, SEAT.zeta, SEAT.shapes, impact.Residual.spring(1e-8))
    h = one.transfer(2j * np.pi * f)[:, 0, 0]
    there = _scene(folder / "frf-csv", scenes.RESPONSE.format("csv") + scenes.BALL + scenes.RUN)
    rows = [f"{x:.6g},{value.real:.9g},{value.imag:.9g}" for x, value in zip(f, h, strict=True)]
    head = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    (there / "frf.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    yield Specimen(there.name, "frf.csv", "text", "run", 2.0)
    yield Specimen(there.name, "scene.toml", "toml", "run")
    there = _scene(folder / "frf-uff", scenes.RESPONSE.format("uff") + scenes.BALL + scenes.RUN)
    write_sets(there / "frf.uff", unit_set(), function_set(f, h))
    yield Specimen(there.name, "frf.uff", "text", "run", 2.0)
    there = _scene(folder / "modes-uff", scenes.MODES)
    write_sets(there / "modes.uff", unit_set(), *_modes())
    yield Specimen(there.name, "modes.uff", "text", "run", 3.0)
    yield Specimen(there.name, "scene.toml", "toml", "run")
    t = 1e-5 * np.arange(200)
    g = SEAT.impulse_response(t)
    (folder / "series").mkdir()
    table = [f"{1e6 * a:.6g},{1e6 * b:.6g}" for a, b in zip(t, g, strict=True)]
    _table(folder / "series" / "g.csv", "time [us],impulse_response [um/(N s)]", table)
    _table(folder / "series" / "p.csv", "time [us],pressure [bar]", table)
    write_sets(folder / "series" / "g.uff", unit_set(), function_set(t, g, in_time=True))
    yield Specimen("series", "g.csv", "text", "impulse", 2.0)
    yield Specimen("series", "p.csv", "text", "series", 2.0)
    yield Specimen("series", "g.uff", "text", "impulse-uff", 2.0)


def _table(path: Path, head: str, rows: list[str]) -> None:
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")


def _modes() -> list[dict[str, Any]]:
    columns = zip(SEAT.frequencies_hz, SEAT.zeta, SEAT.shapes[:, 0], strict=True)
    return [mode_set(k + 1, f, zeta, (0.0, 0.0, 0.0), (z, 3.0, 0.0)) for k, (f, zeta, z) in enumerate(columns)]


def _meshes(folder: Path) -> Path:
    """A quarter ring in every format that gmsh writes, and as .vtu."""
    folder.mkdir()
    script = ROOT / "tests" / "structures" / "write_mesh_files.py"
    subprocess.run([sys.executable, str(script), str(folder)], check=True, capture_output=True)
    return folder


def _mesh_files(folder: Path, meshes: Path) -> Iterator[Specimen]:
    for name in ("tet-1-2.unv", "tet-2-2.unv", "tet-2-2.inp", "tet-1-2.bdf"):
        yield _mesh_file(folder, meshes / name, 2.5)
    vtu = meshes / "tet-1-2.vtu"
    _write_vtu(meshes / "tet-1-2.inp", vtu)
    yield _mesh_file(folder, vtu, 2.5)
    by_gmsh = ("tet-1-2.msh2.msh", "hex20-2-2.msh2bin.msh", "tet-2-2.msh4.msh", "tet-1-2.msh4bin.msh", "tet-1-2.med")
    for name in by_gmsh:
        yield _mesh_file(folder, meshes / name, 0.3)
    for name in ("stopper", "annular_seat"):
        there = _scene(folder / f"{name}.step", scenes.DRAWN["cad"])
        shutil.copy(ROOT / "meshes" / f"{name}.step", there / "part.step")
        yield Specimen(there.name, "part.step", "text", "greens", 0.2)


def _mesh_file(folder: Path, source: Path, share: float) -> Specimen:
    there = folder / source.name
    contact, fixed = ("PID 1", "PID 2") if source.suffix == ".bdf" else ("contact", "fixed")
    _scene(there, scenes.MESH.format(source.name, contact, fixed) + scenes.BALL + scenes.RUN)
    shutil.copy(source, there / source.name)
    binary = source.suffix == ".med" or "bin" in source.name
    return Specimen(there.name, source.name, "bytes" if binary else "text", "greens", share)


def _write_vtu(source: Path, path: Path) -> None:
    """The mesh of another file as ASCII .vtu, its surfaces as triangles with arrays of 0 and 1."""
    from seatfem.structures.formats.abaqus import read_abaqus

    mesh = read_abaqus(source)
    faces = [mesh.surfaces[name] for name in ("contact", "fixed")]
    cells = [*mesh.cells.tolist(), *(row for part in faces for row in part.tolist())]
    n, (a, b) = len(mesh.cells), map(len, faces)
    types = [10] * n + [5] * (a + b)
    marks = {"contact": [0] * n + [1] * a + [0] * b, "fixed": [0] * (n + a) + [1] * b}

    def array(kind: str, name: str, values: Any, width: int = 1) -> str:
        text = " ".join(f"{value:.17g}" for value in np.ravel(values))
        return (
            f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">\n{text}\n</DataArray>'
        )

    parts = [
        '<?xml version="1.0"?>',
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">',
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(cells)}">',
        f"<Points>{array('Float64', 'Points', mesh.points, 3)}</Points>",
        f"<Cells>{array('Int64', 'connectivity', [node for row in cells for node in row])}",
        f"{array('Int64', 'offsets', np.cumsum([len(row) for row in cells]))}{array('UInt8', 'types', types)}</Cells>",
        f"<CellData>{''.join(array('Int64', name, values) for name, values in marks.items())}</CellData>",
        "</Piece></UnstructuredGrid></VTKFile>",
    ]
    path.write_text("\n".join(parts), encoding="utf-8")


def _kept(folder: Path) -> Iterator[Specimen]:
    """What the program writes for itself: results, checkpoints, entries of the store."""
    (folder / "results").mkdir()
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.Body(SEAT))
    result = impact.solve(problem, dt=1e-6, duration=2e-4)
    save_results(folder / "results" / "result.h5", {"wave": result, "spring": result}, {"title": "a"})
    yield Specimen("results", "result.h5", "hdf5", "results", 4.0)
    (folder / "checkpoint").mkdir()
    save_checkpoint(begun_march(), folder / "checkpoint" / "march.h5")
    yield Specimen("checkpoint", "march.h5", "hdf5", "checkpoint", 3.0)
    for name, body in {"modes": block_modes(refined=1), "stress_wave": block_wave(3)}.items():
        (folder / f"moving-{name}").mkdir()
        save_moving(body, folder / f"moving-{name}" / f"{name}.h5")
        yield Specimen(f"moving-{name}", f"{name}.h5", "hdf5", "moving", 2.0)
    (folder / "store").mkdir()
    Store(folder / "store").put(KEY, SEAT)
    yield Specimen("store", f"{KEY}.h5", "hdf5", "store", 1.5)
    (folder / "journal").mkdir()
    for key in ("0123", "4567"):
        append(folder / "journal" / "journal.jsonl", key, Outcome("done", "", 1.0, {"impulse_Ns": 1.0}))
    yield Specimen("journal", "journal.jsonl", "text", "journal")


KEY: Final = "0123456789abcdef" * 4


def begun_march() -> ContactStepper:
    """Halfway through a march, and the same stepper that a checkpoint is restored into."""
    stepper = fresh_march()
    stepper.advance(100)
    return stepper


def fresh_march() -> ContactStepper:
    """Not yet begun."""
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.Body(SEAT))
    return ContactStepper(prepare(problem, dt=1e-6, duration=2e-4))
