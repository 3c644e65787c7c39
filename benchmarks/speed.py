"""How fast the march and studies are: docs/performance.md, from the tables that this script leaves in results/.

    python benchmarks/speed.py [march | costs | studies | precision ...]

measures the tables named, by default all; others stay as they were found. Some minutes of a processor that has nothing
else to do.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time
from typing import Final

import numpy as np
import skfem
from numba import njit
from table import RESULTS, Table, best, in_words, publish

import impact
from impact.march.history import BLOCK, MEASURED, BlockedSum, Poles
from impact.march.prepared import Prepared, prepare
from impact.march.stepper import ContactStepper
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import Material, SecondOrderModel
from seatfem.structures.store import VARIABLE
from seatfem.study.scene import load_scene
from seatfem.study.sweep.cases import PILOTS, chosen
from seatfem.study.sweep.outcome import Outcome, carry_out
from seatfem.study.sweep.side_by_side import side_by_side
from seatfem.study.sweep.table import settings

DT: Final = 1e-6
STEPS: Final = 100_000
SLEEVE: Final = Path(__file__).parents[1] / "examples" / "flapper_on_peek_sleeve.toml"
PAGE: Final = Path(__file__).parents[1] / "docs" / "performance.md"
ROUNDS, SCENES, LANES = 4, 20, 64  # of a study
HEAD: Final = """# Performance

How long a run takes is what `seatfem plan` predicts ([predicted and measured](predicted.md)). This page is for
maintainers: written by `python benchmarks/speed.py` from the tables that it leaves in `benchmarks/results/`. Ratios
carry over to other machines, times do not.

`make history` measures the main parts against a kernel of NumPy beside them, commit by commit:

![Main parts over a kernel of NumPy, by commit](images/history.png)
"""


def modal_seat(modes: int, ports: int = 1) -> impact.ModalGreens:
    """Return random modes between 1 kHz and 80 kHz, 1 % damping, with a passive exponential residual."""
    rng = np.random.default_rng(modes)
    omega = np.sort(rng.uniform(6e3, 5e5, modes))
    residual = impact.Residual.exponential(1e-8 * np.eye(ports), 1e-3 * np.eye(ports))
    names = tuple(str(k) for k in range(ports))
    return impact.ModalGreens(omega, np.full(modes, 0.01), rng.normal(size=(modes, ports)), residual, names)


def throw(poles: int, ports: int = 1) -> impact.ContactProblem:
    """Return a rigid mass that meets a modal seat at some ports, with ``poles`` poles in all."""
    seat = impact.Body(modal_seat(poles - 1 - ports, ports))
    contacts = [impact.Contact(seat, port=k, gap=1e-4, law=impact.Hertz(stiffness=1e9)) for k in range(ports)]
    return impact.ContactProblem(impact.rigid_mass(mass=0.01, velocity=-1.0), contacts=contacts)


def throw_on_rod(steps_per_pass: int = 1000) -> impact.ContactProblem:
    """Return a rigid mass on an undamped rod, which has no poles but exact step weights."""
    rod = impact.fixed_rod(young=2e11, density=7850.0, area=1e-4, length=5047.5 * DT * steps_per_pass)
    return impact.ContactProblem(impact.rigid_mass(mass=0.01, velocity=-1.0), impact.Body(rod))


def block(cells: int) -> SecondOrderModel:
    """Return 20 x 21 x 8 mm of steel in quadratic tetrahedra."""
    sides = ((20e-3, cells), (21e-3, cells), (8e-3, cells // 2))
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, a, n + 1) for a, n in sides))
    named = {"contact": lambda x: x[2] > 8e-3 - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(named), Material(200e9, 0.3, 7850.0), order=2)


@njit(fastmath=True)
def stream(rows, q, p, steps):  # type: ignore[no-untyped-def]
    """Read what the recursion reads, write what it writes, add what must be added to use it."""
    a, b, c, d, e = rows[0], rows[1], rows[2], rows[3], rows[4]
    for _ in range(steps):
        for k in range(q.size):
            q[k] = q[k] + a[k] + b[k]
            p[k] = p[k] + c[k] + d[k] + e[k]


def march_table() -> Table:
    """Return the time per pole and step, beside a loop that only moves the same memory."""
    rows = []
    for poles in (10, 50, 100, 400, 1000):
        prepared = prepare(throw(poles), DT, STEPS * DT, engine="poles")
        ContactStepper(prepared).advance(10)
        coefficients, q, p = prepared.poles.folded(), np.zeros(poles), np.zeros(poles)
        stream(coefficients, q, p, 10)
        march, moved = np.inf, np.inf
        for _ in range(15):  # interleaved, so that both see the same machine
            stepper = ContactStepper(prepared)
            march = min(march, best(lambda s=stepper: s.advance(STEPS), 1))
            moved = min(moved, best(lambda r=coefficients, q=q, p=p: stream(r, q, p, STEPS), 1))
        scale = 1e9 / STEPS / poles
        rows.append((str(poles), f"{march * scale:.2f}", f"{moved * scale:.2f}", f"{march / moved:.1f}"))
    notes = (
        f"A rigid mass on a modal seat with a Hertz law, one core, {STEPS} steps, the shortest of 15 interleaved runs.",
        "Aim at 400 poles: at most 0.6 ns per pole and step, within 3 times the streaming loop.",
    )
    columns = ("poles", "march, ns per pole and step", "streaming loop, ns", "ratio")
    return Table("Pole recursion", notes, columns, tuple(rows))


def march_seconds(prepared: Prepared, repeats: int = 7) -> float:
    """Return the shortest time of a whole march [s]."""
    ContactStepper(prepared).advance(10)
    return best(lambda: ContactStepper(prepared).advance(prepared.steps), repeats)


def pole_costs(n: int = 20_000) -> tuple[float, float]:
    """Return the time of a pole's step with one contact, and what each further contact adds [s]."""

    def slope(contacts: int) -> float:
        few, many = (march_seconds(prepare(throw(k, contacts), DT, n * DT)) for k in (100, 500))
        return (many - few) / 400 / n

    one, two, four = slope(1), slope(2), slope(4)
    return one, ((two - one) + (four - one) / 3) / 2


def fft_costs(n: int = 1 << 19) -> tuple[float, float, float]:
    """Return the times of a transform, a product and a call, each on its own [s]."""
    rng = np.random.default_rng(0)

    def folding(n: int, block: int) -> float:
        weights, force, rest = rng.normal(size=(1, 1, n)), np.ones((1, n)), np.zeros(1)

        def run() -> None:
            blocked = BlockedSum(weights, block)
            for done in range(1, n // block):
                blocked.fold(force, rest, done)

        return best(run, 5)

    call = folding(4096, 4) / (4096 / 4)
    spectra, past = rng.normal(size=(4, 4, 1 << 14)) + 0j, rng.normal(size=(4, 1 << 14)) + 0j
    product = best(lambda: np.einsum("cdf,df->cf", spectra, past), 20) / 16 / (1 << 14)
    levels = [BLOCK << i for i in range(int(math.log2(n / BLOCK)))]
    rest_of_it = folding(n, BLOCK) - n / BLOCK * call - n / 2 * len(levels) * product
    return rest_of_it / (n / 2) / sum(math.log2(2 * size) for size in levels), product, call


def costs_table() -> Table:
    """Return the constants of the cost model beside those in use."""
    poles, steps, direct = 4000, 1_000_000, 20_000
    greens = modal_seat(poles)
    seen, own = Poles.from_bodies([(greens, np.ones((1, 1)))], DT, 1), greens.step_matrix(DT)
    measured = dict(zip(("pole", "pole_contact"), pole_costs(), strict=True))
    measured["weight"] = best(lambda: seen.weights(own, steps), 2) / steps / poles
    whole = march_seconds(prepare(throw_on_rod(), DT, direct * DT, engine="direct"), 5)
    measured["multiply"] = whole / (direct**2 / 2)
    measured |= zip(("transform", "product", "call"), fft_costs(), strict=True)
    rows = [(name, f"{1e9 * value:.3g}", f"{1e9 * getattr(MEASURED, name):.3g}") for name, value in measured.items()]
    notes = ("Constants of `impact.march.history.CostModel` [ns], by which the program chooses between poles and FFT.",)
    return Table("Cost model", notes, ("constant", "measured in this run", "in use"), tuple(rows))


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
    first = carry_out(SLEEVE, scenes[0], ROUNDS, {}, leads=True, stress=False)
    others = [carry_out(SLEEVE, each, ROUNDS, first.start, leads=True, stress=False) for each in scenes[1:]]
    return dict(chosen([each.start for each in (first, *others) if each.start]))


def studies_table() -> Table:
    """Return the processor time of scenes of a study, planned alone, begun as the first ones ended, side by side."""
    alone, after, rounds = list[float](), list[float](), {"alone": list[float](), "after": list[float]()}

    def run(seconds: list[float], name: str, changed: dict[str, object], start: dict[str, object]) -> None:
        begin = process_time()
        found: Outcome = carry_out(SLEEVE, changed, ROUNDS, start, stress=False)
        seconds.append(process_time() - begin)
        rounds[name].append(float(found.summary["accuracy_rounds"]))  # type: ignore[arg-type]

    with tempfile.TemporaryDirectory() as folder:
        os.environ[VARIABLE] = str(Path(folder) / "store")
        scenes = reeds(SCENES + PILOTS + 1)
        start = first_scenes(scenes[: PILOTS + 1])
        for changed in scenes[PILOTS + 1 :]:  # in turn, so that other programs slow both alike
            run(alone, "alone", {**changed, **start["seat"]}, {})  # type: ignore[dict-item]
            run(after, "after", {**changed}, start)
        contact = [{k: v for k, v in each.items() if k != "reed.thickness"} for each in reeds(LANES)]
        more = dict(settings(load_scene(SLEEVE)))
        start = first_scenes([{**each, **more} for each in contact[: PILOTS + 1]])
        side_by_side(SLEEVE, more, contact[:1], 1, start, ())  # compiled
        begin = process_time()
        side_by_side(SLEEVE, {**contact[0], **more}, contact, 1, start, ())
        lanes = [(process_time() - begin) / LANES]
    ways = {"planned by itself": alone, "begun as the first ones ended": after, "side by side, measures alone": lanes}
    counts = [*(f"{np.mean(each):.2f}" for each in rounds.values()), ""]
    rows = tuple(
        (name, f"{np.mean(spent):.3g}", number, f"{500 * np.mean(spent):.0f}")
        for (name, spent), number in zip(ways.items(), counts, strict=True)
    )
    notes = (f"{SCENES} scenes of the PEEK sleeve with a seat on file, in turn; with error bars but for the last row.",)
    columns = ("a scene", "processor time [s]", "rounds", "a thousand on two cores [s]")
    return Table("Scenes of a study", notes, columns, rows)


REDUCED: Final = """
import sys
from pathlib import Path
from time import process_time
import numpy as np
from speed import block
from seatfem.structures import method
from seatfem.structures.method import Aims
from seatfem.structures.reduction import krylov
method.SINGLE_FROM = 0 if sys.argv[1] == "single" else 10**9
model = block(int(sys.argv[2]))
aims, damping = Aims(3e5, 6e-5, 0.01), model.damping.plus(0.02)
shift, load = aims.band, model.port_matrix
start = process_time()
factor = krylov.Here(model, "auto").factorize(shift**2, allowed=method.allowed_error(model.size, aims.tolerance))
after = process_time()
for _ in range(5):
    factor.solve(load)
solved = process_time()
del factor
begun = process_time()
greens = krylov.Krylov().reduce(model, damping, aims).greens
seconds = process_time() - begun
memory = int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0])
g = greens.filtered(np.linspace(0, aims.duration, 1000), aims.width).ravel()
print(model.size, after - start, (solved - after) / 5, seconds, memory / 1e6, greens.origin["vectors"], *g)
"""
"""A reduction in its own process: precision and cells; unknowns, seconds of factor, solve and all, GB, vectors, g."""


def precision_table() -> Table:
    """Return time and memory of reductions by factors in double and in single precision, in turn."""
    rows = []
    for cells in (12, 18):
        taken: dict[str, list[np.ndarray]] = {"double": [], "single": []}
        for _ in range(2):  # interleaved, so that both see the same machine
            for precision, runs in taken.items():
                command = [sys.executable, "-c", REDUCED, precision, str(cells)]
                done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent)
                runs.append(np.array(done.stdout.split(), dtype=float))
        double, single = (np.min(runs, axis=0)[:6] for runs in taken.values())
        one, other = taken["double"][0][6:], taken["single"][0][6:]
        apart = np.abs(one - other).max() / np.abs(one).max()
        pairs = [f"{a:.3g} / {b:.3g}" for a, b in zip(double[1:5], single[1:5], strict=True)]
        rows.append((f"{double[0]:.0f}", *pairs, f"{double[5]:.0f} / {single[5]:.0f}", f"{apart:.0e}"))
    notes = (
        "A block of quadratic tetrahedra, 300 kHz, 60 us, 2 % damping, tolerance 1 %: double / single precision, one",
        "thread, the shorter of 2 interleaved processes; memory is that of the whole process.",
    )
    columns = ("unknowns", "factor [s]", "one solve [s]", "reduction [s]", "memory [GB]", "vectors", "g apart by")
    return Table("Factors in single precision", notes, columns, tuple(rows))


TABLES: Final = {
    "studies": studies_table,
    "march": march_table,
    "costs": costs_table,
    "precision": precision_table,
}


def write_page() -> None:
    """Write the page from the tables on file."""
    parts = [HEAD]
    for name in TABLES:
        values = json.loads((RESULTS / f"speed_{name}.json").read_text(encoding="utf-8"))
        about = in_words(values.pop("machine"))
        parts.append(f"{Table(**values).markdown()}\nMeasured on {about}.\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


def main(names: list[str]) -> None:
    """Measure what is asked for, and write the page."""
    for name in names or TABLES:
        publish(f"speed_{name}", TABLES[name]())
    write_page()


if __name__ == "__main__":
    main(sys.argv[1:])
