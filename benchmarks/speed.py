"""What a user waits for, and how studies and factors grow: docs/performance.md, from the tables that this script
leaves in results/.

    python benchmarks/speed.py [waits | studies | priced_lives | growth ...]

measures the tables named, by default all; others stay as they were found. Some minutes of a processor that has nothing
else to do.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time
from typing import Final

import numpy as np
import skfem
from long_runs import long_runs_table
from priced_lives import priced_lives_table
from table import RESULTS, Table, describe_machine, publish, timed
from whole_runs import whole_runs_table

from seatfem.structures.cache import VARIABLE
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import Material, SecondOrderModel
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import load_scene
from seatfem.study.sweep.cases import PILOTS, chosen
from seatfem.study.sweep.runner import Outcome, carry_out
from seatfem.study.sweep.side_by_side import side_by_side
from seatfem.study.sweep.table import find_common_changes

ROOT: Final = Path(__file__).parents[1]
SLEEVE: Final = ROOT / "examples" / "flapper_on_peek_sleeve.toml"
PAGE: Final = ROOT / "docs" / "performance.md"
MASS: Final = ROOT / "tests" / "contracts" / "mass_on_spring.toml"
SCENES, LANES = 20, 64  # of a study
HEAD: Final = """# Performance

`seatfem plan` estimates the time of a run after a few seconds. This page is for maintainers;
`python benchmarks/speed.py` writes it from the tables that it saves in `benchmarks/results/`. Ratios are valid for
other machines, times are not; other programs ran beside whole runs, waits and studies. Comparison with other programs:
[peers](peers.md).

`make history` measures the main parts relative to a kernel of NumPy, commit by commit:

![Main parts over a kernel of NumPy, by commit](images/history.png)
"""


BARE: Final = ("-c", "import numpy, scipy.linalg, h5py, numba, pydantic")
ERRANDS: Final = (  # what it is, its arguments, how often it is timed, its limit
    ("a wrong key", ("run", "wrong.toml"), 3, "1 time"),
    ("a mass on a spring, first after installation", ("run", "mass.toml", "--no-pictures"), 1, ""),
    ("the same again", ("run", "mass.toml", "--no-pictures"), 3, "1.6 times"),
    ("demo without pictures, first after installation", ("demo", "--no-pictures"), 1, "15 s"),
    ("the same again", ("demo", "--no-pictures"), 2, "2.5 s"),
    ("the same with pictures", ("demo",), 2, "5 s"),
)


def waits_table() -> Table:
    """Return the processor time of whole processes, with a cache of compiled code and a store that are empty at first,
    over that of the imports without which nothing runs."""
    rows, bare = [], list[float]()
    with tempfile.TemporaryDirectory() as folder:
        env = os.environ | {"NUMBA_CACHE_DIR": f"{folder}/numba", VARIABLE: f"{folder}/store", "NUMBA_NUM_THREADS": "1"}
        env |= {"PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": f"{folder}/bytecode", "PYTHONDONTWRITEBYTECODE": ""}
        compiled = [sys.executable, "-m", "compileall", "-q", str(ROOT / "seatfem"), str(ROOT / "impact")]
        subprocess.run(compiled, env=env, check=True)  # as an installation leaves it
        scene = MASS.read_text(encoding="utf-8")
        for name, text in (("wrong", scene.replace("stiffness", "stifness")), ("mass", scene)):
            Path(folder, f"{name}.toml").write_text(text, encoding="utf-8")

        def whole(*arguments: str) -> float:
            command = [sys.executable, *arguments]
            return timed(lambda: subprocess.run(command, cwd=folder, env=env, capture_output=True, check=False))[1]

        for errand, arguments, count, limit in ERRANDS:
            taken = []
            for _ in range(count):  # in turn, so that both see the same machine
                bare.append(whole(*BARE))
                taken.append(whole("-m", "seatfem", *arguments))
            rows.append((errand, f"{min(taken):.3g}", f"{min(taken) / min(bare[-count:]):.2g}", limit))
    notes = (
        f"Processor time of whole processes, one thread; the imports of numpy, scipy.linalg, h5py, numba and pydantic "
        f"alone took {min(bare):.2g} s. Limits: over these, or of wall time on an idle machine.",
    )
    return Table("What a user waits for", notes, ("task", "processor time [s]", "over imports", "limit"), tuple(rows))


def block(cells: int) -> SecondOrderModel:
    """Return 20 x 21 x 8 mm of steel in quadratic tetrahedra."""
    sides = ((20e-3, cells), (21e-3, cells), (8e-3, cells // 2))
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, a, n + 1) for a, n in sides))
    named = {"contact": lambda x: x[2] > 8e-3 - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(named), Material(200e9, 0.3, 7850.0), order=2)


def reeds(count: int) -> list[dict[str, object]]:
    """Return scenes that differ in reed, release and gap."""
    rng = np.random.default_rng(1)
    return [
        {
            "reed.thickness": f"{rng.normal(0.4, 0.004):.6f} mm",
            "reed.release.tip_deflection": f"{rng.normal(1, 0.05):.6f} mm",
            "contact.gap": f"{rng.uniform(0, 0.1):.6f} mm",
        }
        for _ in range(count)
    ]


def first_scenes(scenes: list[dict[str, object]]) -> dict[str, object]:
    """Return what scenes after these begin with."""
    first = carry_out(SLEEVE, scenes[0], MOST_ROUNDS, {}, leads=True, stress=False)
    others = [carry_out(SLEEVE, each, MOST_ROUNDS, first.start, leads=True, stress=False) for each in scenes[1:]]
    return dict(chosen([each.start for each in (first, *others) if each.start]))


def studies_table() -> Table:
    """Return the processor time of scenes of a study: begun by themselves, as the first ones ended, side by side."""
    alone, after, carried = list[float](), list[float](), list[float]()
    rounds = {"alone": list[float](), "after": list[float]()}

    def run(seconds: list[float], name: str, changed: dict[str, object], start: dict[str, object]) -> None:
        begin = process_time()
        found: Outcome = carry_out(SLEEVE, changed, MOST_ROUNDS, start, carried=not name, stress=False)
        seconds.append(process_time() - begin)
        if name:
            rounds[name].append(float(found.summary["accuracy_rounds"]))  # type: ignore[arg-type]

    with tempfile.TemporaryDirectory() as folder:
        os.environ[VARIABLE] = str(Path(folder) / "store")
        scenes = reeds(SCENES + PILOTS + 1)
        start = first_scenes(scenes[: PILOTS + 1])
        for changed in scenes[PILOTS + 1 :]:  # in turn, so that other programs slow both alike
            run(alone, "alone", {**changed, **start["seat"]}, {})  # type: ignore[dict-item]
            run(after, "after", {**changed}, start)
            run(carried, "", {**changed}, start)
        contact = [{k: v for k, v in each.items() if k != "reed.thickness"} for each in reeds(LANES)]
        more = dict(find_common_changes(load_scene(SLEEVE), in_parallel=True))
        start = first_scenes([{**each, **more} for each in contact[: PILOTS + 1]])
        side_by_side(SLEEVE, more, contact[:1], 1, start, ())  # compiled
        begin = process_time()
        side_by_side(SLEEVE, {**contact[0], **more}, contact, 1, start, ())
        lanes = [(process_time() - begin) / LANES]
    ways = {"begun by itself": alone, "begun as the first ones ended": after, "so, with error bars of others": carried}
    ways |= {"side by side, measures alone": lanes}
    counts = [*(f"{np.mean(each):.2f}" for each in rounds.values()), "", ""]
    rows = tuple(
        (name, f"{np.mean(spent):.3g}", number, f"{500 * np.mean(spent):.0f}")
        for (name, spent), number in zip(ways.items(), counts, strict=True)
    )
    bars = "with error bars of their own but for the last two rows"
    notes = (f"{SCENES} scenes of the PEEK sleeve with a seat on file, in turn; {bars}.",)
    columns = ("a scene", "processor time [s]", "rounds", "a thousand on two cores [s]")
    return Table("Scenes of a study", notes, columns, rows)


REDUCED: Final = """
import sys
from pathlib import Path
from time import process_time
import numpy as np
from speed import block
from table import best
from seatfem.structures import method
from seatfem.structures.method import Aims
from seatfem.structures.reduction import krylov
way, cells = sys.argv[1:]
method.SINGLE_FROM = 10**9 if way == "double" else 0
method.ITERATED_FROM = 0 if way == "two grids" else 10**9
block(4)
start = process_time()
model = block(int(cells))
assembled = process_time()
aims, damping = Aims(3e5, 6e-5, 0.01), model.damping.plus(0.02)
greens = krylov.Krylov().reduce(model, damping, aims).greens
reduced = process_time()
memory = int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]) / 1e6
alone = sum(each.data.nbytes + each.indices.nbytes for each in (model.K, model.M)) / 1e9
load = model.port_matrix[:, 0]
product = best(lambda: model.K @ load)
start_of_basis = process_time()
factor = krylov.begin_basis(model, aims.band, 100, "auto", 0.01).factor
made = process_time()
solve = best(lambda: factor.solve(model.M @ load), 3)
g = greens.filtered(np.linspace(0, aims.duration, 1000), aims.width).ravel()
whole = assembled - start, made - start_of_basis - solve, solve, solve / product, reduced - assembled, memory, alone
print(model.size, greens.origin["vectors"], *whole, *g)
"""
"""A reduction in its own process: way and cells; unknowns, vectors, seconds of assembly, factor and solve, the last in
products with K, seconds of the reduction, GB of the process, of K and M, and g."""
WAYS: Final = ("double", "single", "two grids")
SIZES: Final = ((18, WAYS, 2), (24, WAYS, 1), (44, WAYS[2:], 1))  # cells, ways, runs of each


def growth_table() -> Table:
    """Return time and memory of reductions by their ways to solve, in turn, up to a million unknowns."""
    rows = []
    for cells, ways, count in SIZES:
        taken: dict[str, list[np.ndarray]] = {way: [] for way in ways}
        for _ in range(count):  # interleaved, so that all see the same machine
            for way, runs in taken.items():
                command = [sys.executable, "-c", REDUCED, way, str(cells)]
                done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent)
                runs.append(np.array(done.stdout.split(), dtype=float))
        exact = taken[ways[0]][0][9:]
        for way, runs in taken.items():
            least, g = np.min(runs, axis=0), runs[0][9:]
            apart = f"{np.abs(g - exact).max() / np.abs(exact).max():.0e}" if way != ways[0] else ""
            rows.append((f"{least[0]:.0f}", way, f"{least[1]:.0f}", *(f"{x:.3g}" for x in least[2:9]), apart))
    notes = (
        "A block of quadratic tetrahedra, 300 kHz, 60 us, 2 % damping, tolerance 1 %: factors in double and in single",
        "precision, and conjugate gradients on two grids, which the program takes from 100,000 unknowns a port on; it",
        "takes single precision from 20,000 on. One thread, the shorter of 2 interleaved processes, of the largest two",
        "sizes once; factors are left out of the last: by their growth they would take more than five minutes and 10",
        "GB. *Setup*: the factor, of two grids that of the coarse one. Limits: of time, a product with K, which is as",
        "fast as memory; of memory, K and M alone, where the process holds Python and the mesh, too.",
    )
    columns = ("unknowns", "solved by", "vectors", "assembly [s]", "setup [s]", "one solve [s]")
    columns += ("in products with K", "reduction [s]", "memory [GB]", "K and M alone [GB]", "g apart by")
    return Table("Growth", notes, columns, tuple(rows))


TABLES: Final = {
    "waits": waits_table,
    "studies": studies_table,
    "whole_runs": whole_runs_table,
    "priced_lives": priced_lives_table,
    "long_runs": long_runs_table,
    "growth": growth_table,
}


def write_page() -> None:
    """Write the page from the tables on file."""
    parts = [HEAD]
    for name in TABLES:
        if not (file := RESULTS / f"speed_{name}.json").is_file():  # not measured yet
            continue
        values = json.loads(file.read_text(encoding="utf-8"))
        about = describe_machine(values.pop("machine"))
        parts.append(f"{Table(**values).markdown()}\nMeasured on {about}.\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


def main(names: list[str]) -> None:
    """Measure what is asked for, and write the page."""
    for name in names or TABLES:
        publish(f"speed_{name}", TABLES[name]())
    write_page()


if __name__ == "__main__":
    main(sys.argv[1:])
