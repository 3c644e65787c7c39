"""The seat of a scene as decks for CalculiX, with our own answers on the same mesh beside them."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

import impact
from impact.files.atomic import whole_file, write_whole
from impact.greens.base import Array, GreensFunction
from impact.progress import Progress, silent
from seatfem.structures.discretise import matrices, supports_of
from seatfem.structures.formats.calculix_deck import CalculixBody, calculix_body
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import solve_modes
from seatfem.study.planning.plan import Plan
from seatfem.study.scene import Scene

MODES: Final = 20
PER_PULSE: Final = 40  # steps of direct dynamics
PULSES: Final = 2  # widths that the transient lasts
MOST_STEPS: Final = 2000
TOLERANCE: Final = 1e-3  # of our Green's function beside the decks

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
CONTACT: Final = """\
contact.inp      *DYNAMIC, DIRECT: a rigid flat striker of {mass:g} kg at {velocity:g} m/s, *SURFACE BEHAVIOR,
                 PRESSURE-OVERCLOSURE=LINEAR, {stiffness:.4g} Pa/m ({why});
                 U and V of the striker, set HEAVY.                  ours: contact.csv
                 Ours presses on the patch uniformly, theirs as a rigid flat face does.
"""


class DeckError(ValueError):
    """A seat that no deck can be written of; the message names the reason and the remedy."""


@dataclass(frozen=True)
class _Seat:
    """What is written: the deck's body, our undamped model and its Green's function."""

    deck: CalculixBody
    model: SecondOrderModel
    greens: GreensFunction


def write_calculix(plan: Plan, folder: Path, progress: Progress = silent) -> Iterator[Path | str]:
    """The decks, our answers to them (CSV) and README.txt; a note of what is left out.

    Raises:
        DeckError: a seat that is no mesh of ours. ModelError: elements or supports that decks do not have.
    """
    width = plan.scene.run.filter_width
    dt = width / PER_PULSE
    seat = _seat(plan, width, progress)
    deck = seat.deck
    yield _lines(folder / "mesh.inp", deck.lines)
    found = solve_modes(seat.model, min(MODES, seat.model.size), progress=progress).frequencies_hz
    yield _deck(folder / "frequency.inp", deck.frequency(len(found)))
    yield csv_table(folder / "frequency.csv", ["mode", "frequency [Hz]"], enumerate(found.tolist(), start=1))
    yield _deck(folder / "transient.inp", deck.transient(width, PULSES * width, dt))
    times = dt * np.arange(1, PULSES * PER_PULSE + 1)
    moved = np.ravel(seat.greens.filtered(times, width))
    head = ["time [s]", "displacement per impulse [m/(N s)]"]
    yield csv_table(folder / "transient.csv", head, zip(times.tolist(), moved.tolist(), strict=True))
    try:
        told, files = _contact(plan.scene, seat, dt, folder)
        yield from files
    except (DeckError, ModelError) as reason:
        told = f"contact.inp      is not written: {reason}\n"
        yield f"no contact.inp: {reason}"
    share = "" if deck.share == 1 else f"\n{17 * ' '}What is modelled bears {deck.share:g} of the whole load."
    about = {"node": deck.node, "axis": deck.axis, "modes": len(found), "width": width, "steps": PER_PULSE}
    text = README.format(element=deck.element, share=share, contact=told, **about)
    write_whole(folder / "README.txt", text.encode())
    yield folder / "README.txt"


def _seat(plan: Plan, width: float, progress: Progress) -> _Seat:
    body, method = plan.scene.seat, plan.method.seat
    if not isinstance(body, Elastic):
        raise DeckError(f"seat.kind = {body.kind!r} has no finite elements to write a deck of; take one that has")
    if body.struck_arc is not None:
        raise DeckError("only an arc of the seat's ring is struck: a half section has none; remove seat.arc")
    if held := [support.kind for support in body.supports if support.kind != "sliding"]:
        raise DeckError(f"seat.supports: a {held[0]} support has no place in the deck; use clamped or sliding faces")
    assert not supports_of(body)
    method = replace(method, rings=1, lip=None)
    mesh, _ = body.meshes(method, progress)
    level = body.elements_of(method)
    model = matrices(body, mesh, level, progress)
    undamped = SecondOrderModel(model.M, None, model.K, model.ports, model.dofs)
    copies = body.copies.get(level, 1)
    deck = calculix_body(model, body.solids(regions_of(mesh)), struck=body.struck_face, copies=copies)
    greens = greens_function(
        undamped,
        bandwidth=max(method.bandwidth or 0.0, 2 / width),
        duration=MOST_STEPS * width / PER_PULSE,
        tolerance=TOLERANCE,
        progress=progress,
    )
    return _Seat(deck, undamped, greens)


def _contact(scene: Scene, seat: _Seat, dt: float, folder: Path) -> tuple[str, Sequence[Path]]:
    """The words about contact.inp, and its files. Raises `DeckError` of what it cannot hold."""
    mass, velocity = _striker(scene)
    law = scene.contact.law.law()
    area = next(iter(seat.model.ports.values())).area
    assert area is not None
    if isinstance(law, impact.LinearSpring):
        stiffness, why = law.stiffness / area, "contact.law, over the patch's area"
    elif isinstance(law, impact.Signorini):
        solids = (scene.seat.material, *scene.seat.materials.values()) if isinstance(scene.seat, Elastic) else ()
        stiffness = max(one.solid.density * float(one.solid.c_p_along([0.0, 0.0, 1.0])) for one in solids) / dt
        why = "in place of a rigid contact: rho c_p over the time step"
    else:
        raise DeckError(f"contact.law.kind = {scene.contact.law.kind!r}: decks know spring and signorini")
    touch = impact.Contact(impact.Body(seat.greens), law=impact.LinearSpring(stiffness * area))
    problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=velocity), contacts=[touch])
    result = impact.solve(problem, dt=dt / 5, duration=min(scene.run.duration, MOST_STEPS * dt))
    groups = impact.measures.contact_groups(result)
    ends = float(result.time[-1]) if not len(groups) else 1.2 * float(groups[0, 1])
    duration = dt * max(1, math.ceil(min(ends, float(result.time[-1])) / dt))
    path = folder / "contact.inp"
    _deck(path, seat.deck.contact(mass, velocity, stiffness, duration, dt))
    there = slice(0, round(duration / result.dt), 5)
    force = result.force[there]
    speeds = velocity + np.concatenate([[0.0], np.cumsum(result.force)])[there] * result.dt / mass
    head = ["time [s]", "velocity of the striker [m/s]", "force [N]"]
    rows = zip(*(column.tolist() for column in _alike(result.time[there], speeds, force)), strict=True)
    told = CONTACT.format(mass=mass, velocity=velocity, stiffness=stiffness, why=why)
    return told, (path, csv_table(folder / "contact.csv", head, rows))


def _striker(scene: Scene) -> tuple[float, float]:
    """Mass [kg] and velocity [m/s] of a rigid striker in free flight that meets the seat's face and nothing else."""
    greens = scene.reed.closed_form()
    free = None if greens is None else greens.modal
    if free is None or free.omega.tolist() != [0.0]:
        raise DeckError(f"reed.kind = {scene.reed.kind!r}: must be a mass with a velocity (rigid_mass)")
    contact = scene.contact
    others = {
        "stopper": scene.stopper, "load": scene.load, "base": scene.base, "gas": scene.gas,
        "contact.film": contact.film, "contact.gap": contact.gap, f"contact.{contact.uneven}": contact.uneven,
    }  # fmt: skip
    if there := [key for key, value in others.items() if value]:
        raise DeckError(f"{there[0]}: remove it, the deck is of a mass that meets a flat face")
    return 1.0 / float(free.inverse_mass()[0, 0]), scene.reed.body(free).velocity


def _alike(*columns: Array) -> Iterator[Any]:
    length = min(len(column) for column in columns)
    return (np.asarray(column[:length]) for column in columns)


def _deck(path: Path, steps: Sequence[str]) -> Path:
    return _lines(path, ["*INCLUDE, INPUT=mesh.inp", *steps])


def _lines(path: Path, lines: Sequence[str]) -> Path:
    write_whole(path, ("\n".join(lines) + "\n").encode("ascii"))
    return path


def csv_table(path: Path, heads: Sequence[str], rows: Any) -> Path:
    """Write a table with its heads; whole or absent."""
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows(rows)
    return path
