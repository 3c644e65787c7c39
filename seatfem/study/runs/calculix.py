"""The seat of a scene as decks for CalculiX, with our own answers on the same mesh beside them."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from impact.files.csv_table import write_csv
from impact.files.safe_files import write_whole
from impact.greens.base import GreensFunction
from impact.notices import Progress, silent
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.model import ModelError
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import ConvergenceError, solve_modes
from seatfem.study.planning.plan import Plan
from seatfem.study.runs import calculix_contact

MODES: Final = 20  # modes of the frequency deck
PER_PULSE: Final = 40  # steps of direct dynamics per width of the Hann pulse
PULSES: Final = 2  # duration of the transient, in widths of the pulse

README: Final = """\
Decks for CalculiX (ccx), in SI units, and our own answers on the very same mesh: seatfem export --to calculix.

mesh.inp         {element} elements as the seat's run meshes it; materials, supports, node sets, the surface STRUCK.
                 Component {axis} of node {node} (set PATCH) is the patch's mean normal displacement, and a force on
                 it is spread over the patch as consistent nodal forces (*EQUATION).{share}
frequency.inp    *FREQUENCY, the lowest {modes} modes.
                 ours: frequency.csv
transient.inp    *DYNAMIC, DIRECT, ALPHA=0: a unit Hann pulse of T = {width:g} s on the patch, (1 - cos(2 pi t/T))/T,
                 {steps} steps a pulse; U of set PATCH [m/(N s)].
                 ours: transient.csv
{contact}
Run each by, e.g., ccx frequency; what is asked for is printed to the .dat file.

No deck has damping, and our answers beside them have none either, whatever the scene states. What remains between both:
CalculiX integrates the mass of a C3D10 by four points, we exactly (some 0.1 %); C3D20 and CAX8 lack the nodes inside
faces that our hexahedra and quadrilaterals have, and our hexahedra have a nodal mass (some 1 %, less on finer meshes);
from poisson = 0.45 on we project the change of volume, which CalculiX does not; direct dynamics lags
behind by its time step, by some 1 % at the end of the pulse and more later: halve the step to see it.
"""


def write_calculix(plan: Plan, folder: Path, progress: Progress = silent) -> Iterator[Path | str]:
    """Write the decks, our answers to them (CSV) and README.txt; yield the files, and a note if the contact deck is
    missing. Modes and response are computed before anything is written.

    Raises:
        DeckError: the seat has no finite elements. ModelError: its elements or supports have no place in a deck.
    """
    width = plan.scene.run.filter_width
    dt = width / PER_PULSE
    seat = calculix_contact.deck_seat(plan, progress)
    deck = seat.deck
    frequencies = solve_modes(seat.model, min(MODES, seat.model.size), progress=progress).frequencies_hz
    times = dt * np.arange(1, PULSES * PER_PULSE + 1)
    band = max(seat.method.bandwidth or 0.0, 2 / width)
    greens = greens_function(
        seat.model,
        bandwidth=band,
        duration=calculix_contact.MOST_STEPS * dt,
        tolerance=calculix_contact.TOLERANCE,
        progress=progress,
    )
    yield _lines(folder / "mesh.inp", deck.lines)
    yield _deck(folder / "frequency.inp", deck.frequency(len(frequencies)))
    yield write_csv(folder / "frequency.csv", ["mode", "frequency [Hz]"], enumerate(frequencies.tolist(), start=1))
    yield _deck(folder / "transient.inp", deck.transient(width, PULSES * width, dt))
    head = ["time [s]", "displacement per impulse [m/(N s)]"]
    displacement = np.ravel(greens.filtered(times, width))
    yield write_csv(folder / "transient.csv", head, zip(times.tolist(), displacement.tolist(), strict=True))
    try:
        words, files = _contact(plan, seat, greens, dt, folder, progress)
        yield from files
    except (calculix_contact.DeckError, ModelError, MeshingError, ConvergenceError) as reason:
        words = f"contact.inp      is not written: {reason}\n"
        yield f"no contact.inp: {reason}"
    share = "" if deck.share == 1 else f"\n{17 * ' '}The model carries {deck.share:g} of the whole load."
    numbers = {"node": deck.node, "axis": deck.axis, "modes": len(frequencies), "width": width, "steps": PER_PULSE}
    text = README.format(element=deck.element, share=share, contact=words, **numbers)
    write_whole(folder / "README.txt", text.encode())
    yield folder / "README.txt"


def _contact(
    plan: Plan, seat: calculix_contact.DeckSeat, greens: GreensFunction, dt: float, folder: Path, progress: Progress
) -> tuple[str, Sequence[Path]]:
    """Write contact.inp; return its paragraph of the README, and the files. Raises `DeckError`, `ModelError`."""
    mesh, files = "mesh.inp", list[Path]()
    if plan.scene.reed.thin_plate is not None:
        calculix_contact.check_landing(plan)
        whole = calculix_contact.whole_seat(plan, progress)
        if seat.deck.plane or seat.deck.share != 1:
            mesh = "whole.inp"
            files.append(_lines(folder / mesh, whole.deck.lines))
        contact = calculix_contact.of_plate(plan, whole, dt, mesh)
    else:
        contact = calculix_contact.of_mass(plan, seat, greens, dt)
    rows = zip(*(column.tolist() for column in contact.answer.values()), strict=True)
    files.append(_deck(folder / "contact.inp", contact.lines, mesh))
    return contact.told, [*files, write_csv(folder / "contact.csv", list(contact.answer), rows)]


def _deck(path: Path, steps: Sequence[str], mesh: str = "mesh.inp") -> Path:
    return _lines(path, [f"*INCLUDE, INPUT={mesh}", *steps])


def _lines(path: Path, lines: Sequence[str]) -> Path:
    write_whole(path, ("\n".join(lines) + "\n").encode("ascii"))
    return path
