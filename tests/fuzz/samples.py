"""Sound files of every format that the program opens, from which damaged ones are made, and what reads each."""

import gzip
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from scipy import sparse
from scipy.io import mmwrite

import impact
from impact.bodies.time_series import read_time_series
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper
from impact.measured.frf import read_impulse_response
from impact.storage.hdf5 import load_results, restore_checkpoint, save_checkpoint, save_greens, save_results
from seatfem.faces.report.figures import body_figure
from seatfem.pictures.moving import load_moving, save_moving
from seatfem.structures.formats.dxf import write_outline
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.formats.uff_responses import read_impulse_response_uff
from seatfem.structures.formats.writing import write_mesh
from seatfem.structures.shapes.flat import Flapper
from seatfem.study.scene.keys import scene_template
from seatfem.study.sweep.runner import Outcome, append, read_journal
from tests import universal_files
from tests.moving_block import block_modes, block_wave
from tests.steps import Store, run_command
from tests.uff_sets import function_set, mode_set, unit_set, write_sets

MESHES: Final = Path(__file__).parents[2] / "meshes"
Form = Literal["toml", "text", "bytes"]
SEAT: Final = impact.ModalGreens(
    2 * np.pi * np.array([2e3, 5.1e3, 9.3e3]),
    np.array([0.02, 0.01, 0.03]),
    np.array([[20.0], [16.0], [12.0]]),
    impact.Residual.relaxing(1e-8, 1e5),
    origin={"kind": "own"},
)
KEY: Final = "0123456789abcdef" * 4
DRAWN: Final = (
    *("annular", "ball", "bar", "block", "conical", "disc", "flapper", "plate", "ring_plate", "sheet", "stepped"),
    *("stopper", "timoshenko", "tip_mass"),
)
"""Kinds of bodies whose scenes to begin with need no file."""
BALL: Final = (
    '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
    '[contact]\nlaw = { kind = "spring", stiffness = "10 N/um" }\n'
)
RUN: Final = '[run]\nduration = "0.4 ms"\nfilter_width = "10 us"\ntime_step = "0.5 us"\n[accuracy]\ntarget = "5 %"\n'
SPRING: Final = '[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n'
REED: Final = (
    '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nwidth = "10 mm"\nthickness = "0.305 mm"\ndamping_ratio = 0.03\n'
    'n_modes = 4\nrelease = { tip_deflection = "1 mm" }\nmaterial = "steel"\n[contact]\nlaw = "signorini"\n'
)
COARSE: Final = 'material = "steel"\ngreens = { bandwidth = "50 kHz", tolerance = "5 %" }\n'
STRENGTH: Final = (
    'source = "invented"\ntemperature = "120 degC"\nspecimens = 30\nultimate = "1800 MPa"\nloading_ratio = 0\n'
    '[curve]\npoints = [["500 MPa", 1e5], ["400 MPa", 1e7], ["380 MPa", 1e9]]\nscatter = 0.25\nsurvival = "90 %"\n'
)
AT_NODE: Final = 'node = 7\ndirection = "+z"\n'
SCENES: Final = {
    "spring": SPRING + REED + RUN,
    "rod": '[seat]\nkind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "30 mm"\narea = "4 mm^2"\n'
    "damping_ratio = 0.1\n" + BALL + RUN,
    "life": SPRING + REED + RUN + '[life]\nstrength = "strength.toml"\nhours = 25000\nrpm = 3000\nblock = "run"\n',
    "greens": '[seat]\nkind = "greens"\nfile = "seat.h5"\n' + BALL + RUN,
    "matrices": '[seat]\nkind = "matrices"\nmass = "M%s"\nstiffness = "K%s"\ncontact = "port.csv"\nsystem = "SI"\n'
    'first_dof = 1\ndamping_ratio = 0.01\ngreens = { bandwidth = "50 kHz", tolerance = "5 %%" }\n',
    "modes": f'[seat]\nkind = "modes"\nfile = "modes.uff"\n{AT_NODE}system = "SI"\n' + BALL + RUN,
    "frf": '[seat]\nkind = "frf"\nfile = "frf.%s"\ntolerance = "5 %%"\n',
    "load": SPRING + REED + RUN + '[[load]]\npressure = { file = "p.csv" }\narea = "20 mm^2"\n',
    "mesh": '[seat]\nkind = "mesh"\nfile = "mesh%s"\ncontact = "%s"\nfixed = "%s"\n',
    "cad": '[seat]\nkind = "cad"\nfile = "part.step"\n' + COARSE + BALL + RUN,
    "sheet": SPRING + '[reed]\nkind = "sheet"\nfile = "reed.dxf"\nclamped = [["0 mm", "-4 mm"], ["0 mm", "4 mm"]]\n'
    'contact_at = ["25 mm", "0 mm"]\nthickness = "0.3 mm"\nrelease = { mode = 1, velocity = "-1 m/s" }\n' + RUN,
}


@dataclass(frozen=True)
class Sample:
    """A folder with sound files, of which one is damaged.

    Attributes:
        name: of the folder.
        target: the file that is damaged.
        form: how, besides byte by byte.
        read: a verb of the program ("draw": `run` up to the call of gmsh), or a function of the file's path.
        share: of the cases, relative to the others: less of those that gmsh reads.
    """

    name: str
    target: str
    form: Form
    read: str | Callable[[Path], object] = "run"
    share: float = 1.0


@cache
def build(folder: Path) -> dict[str, Sample]:
    """Write every sample into a folder of its own, unless they are there, and return them by name and target."""
    done = folder / "done"
    if not done.is_file():
        shutil.rmtree(folder, ignore_errors=True)
    found = {f"{sample.name}/{sample.target}": sample for sample in _samples(folder, write=not done.is_file())}
    done.touch()
    return found


def _samples(folder: Path, *, write: bool) -> Iterator[Sample]:
    def there(name: str, scene: str = "", **files: Callable[[Path], object]) -> None:
        if write:
            (folder / name).mkdir(parents=True)
            if scene:
                (folder / name / "scene.toml").write_text(scene, encoding="utf-8")
            for file, fill in files.items():
                fill(folder / name / file.replace("__", "."))

    for name in ("spring", "rod"):
        there(name, SCENES[name])
        yield Sample(name, "scene.toml", "toml", "run", 4.0)
    there("life", SCENES["life"], strength__toml=_text(STRENGTH))
    yield from (Sample("life", target, "toml", "run", 2.0) for target in ("scene.toml", "strength.toml"))
    for kind in DRAWN:
        lines = scene_template(kind, file="scene.toml").splitlines()
        there(kind, "\n".join(line for line in lines if line.strip() and not line.startswith("#")))
        yield Sample(kind, "scene.toml", "toml", "draw", 2.0)
    rod = {"young": 200e9, "density": 7850.0, "area": 1e-6, "length": 0.03}
    t, f = 1e-5 * np.arange(200), 25.0 * np.arange(4, 500)
    modal = impact.ModalGreens(SEAT.omega, SEAT.zeta, SEAT.shapes, impact.Residual.none())
    static = modal.static_compliance()
    kernels = {
        "modal": SEAT,
        "poles": impact.PoleGreens.from_modal(SEAT),
        "sampled": impact.SampledGreens(modal.impulse_response(t), 1e-5, tail="zero", static=static),
        "rod": impact.fixed_rod(**rod, damping_ratio=0.1),
    }
    for name, greens in kernels.items():
        there(f"greens-{name}", SCENES["greens"], seat__h5=partial(save_greens, greens))
        yield Sample(f"greens-{name}", "seat.h5", "bytes", "run", 4.0)
    for ending in (".mtx", ".npz", ".npy", ".mtx.gz"):
        there(
            f"matrices{ending}",
            SCENES["matrices"] % (ending, ending) + BALL + RUN,
            port__csv=_text("dof,weight\n12,0.5\n11,0.5\n"),
        )
        if write:
            _matrices(folder / f"matrices{ending}", ending)
        yield Sample(f"matrices{ending}", f"K{ending}", "text" if ending == ".mtx" else "bytes", "run", 2.0)
    yield Sample("matrices.mtx", "port.csv", "text")
    spring = impact.ModalGreens(SEAT.omega, SEAT.zeta, SEAT.shapes, impact.Residual.spring(1e-8))
    h, g = spring.transfer(2j * np.pi * f)[:, 0, 0], SEAT.impulse_response(t)
    there("frf-csv", SCENES["frf"] % "csv" + BALL + RUN, frf__csv=_table(f, h.real, h.imag, head=FRF))
    there("frf-uff", SCENES["frf"] % "uff" + AT_NODE + BALL + RUN, frf__uff=_universal(function_set(f, h)))
    there("modes", SCENES["modes"], modes__uff=_universal(*modes()))
    there("load", SCENES["load"], p__csv=_table(1e6 * t, 1e6 * g, head="time [us],pressure [bar]"))
    yield Sample("frf-csv", "frf.csv", "text", "run", 2.0)
    yield Sample("frf-uff", "frf.uff", "text", "run", 2.0)
    yield Sample("modes", "modes.uff", "text", "run", 2.0)
    yield Sample("load", "p.csv", "text", "run", 2.0)
    there(
        "series",
        g__csv=_table(1e6 * t, 1e6 * g, head="time [us],impulse_response [um/(N s)]"),
        p__csv=_table(1e6 * t, 1e6 * g, head="time [us],pressure [bar]"),
        g__uff=_universal(function_set(t, g, in_time=True)),
    )
    yield Sample("series", "g.csv", "text", read_impulse_response)
    yield Sample("series", "p.csv", "text", partial(read_time_series, quantity="pressure"))
    yield Sample("series", "g.uff", "text", partial(read_impulse_response_uff, ports={"contact": (7, "+z")}))
    yield from _meshes(there)
    there("cad", SCENES["cad"], part__step=lambda path: shutil.copy(MESHES / "stopper.step", path))
    yield Sample("cad", "part.step", "text", "greens", 0.3)
    there("sheet-dxf", SCENES["sheet"], reed__dxf=partial(write_outline, REED_SHAPE.drawn))
    yield Sample("sheet-dxf", "reed.dxf", "text", "draw", 2.0)
    yield from _own_files(there)


FRF: Final = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
REED_SHAPE: Final = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3)
CORNERS: Final = ((0.0, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02))
DECK: Final = (
    "*NODE\n"
    + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(CORNERS, 1))
    + "*ELEMENT, TYPE=C3D4, ELSET=all\n1, 1, 2, 3, 4\n*SURFACE, NAME=contact\n1, S1\n*SURFACE, NAME=fixed\n1, S2\n"
)


UNIVERSAL: Final = (
    universal_files.nodes(2411, CORNERS)
    + universal_files.elements(2412, (111, (1, 2, 3, 4)), (91, (1, 2, 3)), (91, (1, 2, 4)))
    + universal_files.groups(2467, contact=[(8, 2)], fixed=[(8, 3)])
)


def _meshes(there: Callable[..., None]) -> Iterator[Sample]:
    for ending, share in ((".inp", 2.5), (".bdf", 2.5), (".unv", 2.5), (".vtu", 1.5), (".msh", 0.3), (".med", 0.3)):
        names = ("PID 1", "PID 2") if ending == ".bdf" else ("contact", "fixed")
        fill = _text(UNIVERSAL) if ending == ".unv" else _text(DECK) if ending == ".inp" else _write
        scene = SCENES["mesh"] % (ending, *names) + COARSE + BALL + RUN
        there(f"mesh{ending}", scene, **{f"mesh__{ending[1:]}": fill})
        binary = ending in (".med", ".msh", ".vtu")
        yield Sample(f"mesh{ending}", f"mesh{ending}", "bytes" if binary else "text", "greens", share)


def _write(path: Path) -> None:
    deck = path.with_name("deck.inp")
    deck.write_text(DECK, encoding="utf-8")
    write_mesh(read_mesh(deck), path)
    deck.unlink()


def _own_files(there: Callable[..., None]) -> Iterator[Sample]:
    """What the program writes for itself: results, checkpoints, bodies in motion, entries of the store, journals."""
    there("results", result__h5=_results, march__h5=lambda path: save_checkpoint(march(100), path))
    yield Sample("results", "result.h5", "bytes", load_results, 3.0)
    yield Sample("results", "march.h5", "bytes", _march, 3.0)
    there(
        "moving", modes__h5=partial(save_moving, block_modes(refined=1)), wave__h5=partial(save_moving, block_wave(3))
    )
    yield from (Sample("moving", f"{name}.h5", "bytes", _body, 1.5) for name in ("modes", "wave"))
    there("store", **{KEY: lambda path: Store(path.parent).put(KEY, SEAT) and None, "journal__jsonl": _journal})
    yield Sample("store", f"{KEY}.h5", "bytes", _store, 1.5)
    yield Sample("store", "journal.jsonl", "text", read_journal)


def _text(text: str) -> Callable[[Path], object]:
    return lambda path: path.write_text(text, encoding="utf-8")


def _table(*columns: Any, head: str) -> Callable[[Path], object]:
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*map(np.ravel, columns), strict=True))
    return _text("\n".join([head, *rows]) + "\n")


def _universal(*sets: dict[str, Any]) -> Callable[[Path], object]:
    return lambda path: write_sets(path, unit_set(), *sets)


def modes() -> list[dict[str, Any]]:
    """Return the modes of `SEAT` as datasets 55."""
    columns = zip(SEAT.frequencies_hz, SEAT.zeta, SEAT.shapes[:, 0], strict=True)
    return [mode_set(k + 1, f, zeta, (0.0, 0.0, 0.0), (z, 3.0, 0.0)) for k, (f, zeta, z) in enumerate(columns)]


def _matrices(folder: Path, ending: str) -> None:
    n = 12
    off = sparse.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[1, -1])
    for name, matrix in (("K", 3e7 * (2 * sparse.eye_array(n) - off)), ("M", 1e-3 * (4 * sparse.eye_array(n) + off))):
        path = folder / f"{name}{ending}"
        if ending == ".npz":
            sparse.save_npz(path, sparse.csr_array(matrix))
        elif ending == ".npy":
            np.save(path, matrix.toarray())
        else:
            mmwrite(folder / f"{name}.mtx", sparse.coo_array(matrix), symmetry="symmetric", precision=17)
        if ending == ".mtx.gz":
            path.write_bytes(gzip.compress((folder / f"{name}.mtx").read_bytes(), mtime=0))


def march(steps: int = 0) -> ContactStepper:
    """Return a march that has done so many steps."""
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.Body(SEAT))
    stepper = ContactStepper(prepare(problem, dt=1e-6, duration=2e-4))
    stepper.advance(steps)
    return stepper


def _results(path: Path) -> None:
    result = impact.solve(march().prepared.problem, dt=1e-6, duration=2e-4)
    save_results(path, {"wave": result, "spring": result}, {"title": "a"})


def _journal(path: Path) -> None:
    for key in ("0123", "4567"):
        append(path, key, Outcome("done", "", 1.0, {"impulse_Ns": 1.0}))


def _march(path: Path) -> None:
    stepper = march()
    restore_checkpoint(stepper, path)
    stepper.advance(50)


def _store(path: Path) -> None:
    """Read an entry; a damaged one is as good as none."""
    greens = Store(path.parent).get(KEY)
    if greens is not None:
        greens.impulse_response(np.linspace(0.0, 1e-4, 10))


def _body(path: Path) -> None:
    """Read a body as a report does, whose script must be able to read the numbers."""

    def refuse(number: str) -> float:
        raise AssertionError(f"{number} is no JSON")

    text = body_figure(path.name, load_moving(path)).partition('<script type="application/json">')[2]
    assert json.loads(text.partition("</script>")[0], parse_constant=refuse)["labels"]


def warm_up(folder: Path, out: Path) -> None:
    """Compile loops once, before limits of memory and time stand."""
    for name in ("rod", "spring", "greens-modal", "matrices.npz"):
        run_command(["run", str(folder / name / "scene.toml"), "-o", str(out / name), "--quiet", "--no-pictures"])
