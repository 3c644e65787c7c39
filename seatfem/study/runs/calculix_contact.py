"""Decks of a scene for CalculiX, of its seat and of its contact, with our own results on the same mesh for
comparison."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

import impact
from impact.after.result import as_one
from impact.bodies.body import ModalState
from impact.files.csv_table import write_csv
from impact.files.safe_files import write_whole
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunction
from impact.notices import Progress, silent
from seatfem.structures import lands, sheets
from seatfem.structures.finite_elements import AnyMesh, matrices, supports_of
from seatfem.structures.formats.calculix_deck import (
    CalculixBody,
    Integers,
    PlateStriker,
    calculix_body,
    check_patch,
    mass_contact,
    plate_contact,
)
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds import Structure, elastic, structure
from seatfem.structures.lip import AnyLip, tilted
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.mesh.plane_meshes import CLAMPED
from seatfem.structures.method import Aims, Method
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.lip_modes import face_greens
from seatfem.structures.reduction.modes import ConvergenceError, solve_modes
from seatfem.structures.rings import Division
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.planning.plan import Plan
from seatfem.study.scene import Scene
from seatfem.study.scene.laws import ContactLaw

MOST: Final = 150_000  # most unknowns of a seat whose contact ccx is to integrate in time
CHORDS: Final = 720  # chords by which a full circle is approximated


class DeckError(ValueError):
    """No deck can hold what the plan asks for; the message names the key, the reason and the remedy."""


@dataclass(frozen=True, eq=False)
class DeckSeat:
    """The seat as a deck of CalculiX, and our model of it.

    Attributes:
        deck: mesh, materials and supports of the deck.
        model: our undamped matrices; the ports are the patch, or the parts of ``lip``.
        method: method by which the seat was meshed.
        lip: the struck face divided into arcs; ``None`` where it is struck all around at once.
    """

    deck: CalculixBody
    model: SecondOrderModel
    method: Method
    lip: lands.FaceLip | None = None

    @property
    def area(self) -> float:
        """Return the area of the patch on its mesh [m^2]."""
        return sum(port.area or math.nan for port in self.model.ports.values())

    @property
    def centre(self) -> Array:
        """Return the centroid (3,) of a flat patch that faces up along z [m]."""
        assert self.model.dofs is not None
        weights = sum((port.area or 0.0) * self.model.expand(port.vector)[2] for port in self.model.ports.values())
        return np.asarray(self.model.dofs.points @ weights / self.area)


def deck_seat(plan: Plan, progress: Progress) -> DeckSeat:
    """Return the seat on the mesh of the run, with its patch as one port. Raises `DeckError`, `ModelError` if no deck
    can hold it."""
    body = _body(plan)
    method = replace(plan.method.seat, rings=1, lip=None)
    return _of_mesh(body, body.meshes(method, progress)[0], method, None, progress)


def whole_seat(plan: Plan, progress: Progress) -> DeckSeat:
    """Return the whole seat in three dimensions, its patch divided as in the run. Raises as `deck_seat`."""
    body, division = _body(plan), plan.method.seat.division
    method = replace(plan.method.seat, level="3d", rings=1, lip=None)
    mesh, _ = body.meshes(method, progress)
    if (unknowns := 3 * mesh.quality.nodes) > MOST:
        raise DeckError(
            f"seat.mesh: the whole seat has {unknowns} unknowns in space (limit {MOST}), too many for ccx to march; "
            "state a larger seat.mesh.size and contact_size"
        )
    if division.arcs == 1:
        return _of_mesh(body, mesh, method, None, progress, division.rings)
    return _of_mesh(body, mesh, method, _as_face(body.lip(division.arcs, division.rings)), progress)


def _as_face(lip: AnyLip | None) -> lands.FaceLip:
    """Return the struck ring of a body of revolution as a general `FaceLip`."""
    assert lip is not None
    if isinstance(lip, lands.FaceLip):
        return lip
    edges = np.concatenate(lip.edge_lines(CHORDS))
    land = lands.land_of(np.concatenate([edges, np.zeros((*edges.shape[:2], 1))], axis=2), (0.0, 0.0, 1.0))
    return lands.face_lip(land, lip.arcs, lip.rings)


def _body(plan: Plan) -> elastic.Elastic:
    body = plan.scene.seat.elastic
    if body is None:
        raise DeckError(
            f"seat.kind = {plan.scene.seat.kind!r} has no finite elements to write a deck of; give one that is meshed"
        )
    if body.struck_arc is not None:
        raise DeckError("only an arc of the seat's ring is struck: a half section has none; remove seat.arc")
    if held := [support.kind for support in body.supports if support.kind != "sliding"]:
        raise DeckError(f"seat.supports: a {held[0]} support has no place in the deck; use clamped or sliding faces")
    assert not supports_of(body)
    return body


def _of_mesh(
    body: elastic.Elastic, mesh: AnyMesh, method: Method, lip: lands.FaceLip | None, progress: Progress, rings: int = 1
) -> DeckSeat:
    level = body.elements_of(method)
    model = matrices(body, mesh, level, progress, rings=rings, lip=lip)
    undamped = SecondOrderModel(model.M, None, model.K, model.ports, model.dofs)
    copies = body.copies.get(level, 1)
    deck = calculix_body(model, body.solids(regions_of(mesh)), struck=body.struck_face, copies=copies)
    return DeckSeat(deck, undamped, method, lip)


MOST_STEPS: Final = 2000  # most steps of a deck
TOLERANCE: Final = 1e-3  # relative error of our Green's functions that the decks are compared with
SUBSTEPS: Final = 5  # our steps per step of the deck
LEAD: Final = 2  # steps from the start of the deck to the first touch
DECK_IN_IMPACT_DURATIONS: Final = 1.2  # end of the deck after the first touch, in durations of the first impact
FLIGHT_BLOCK: Final = 1000  # steps of a flight that are evaluated in one array
TOUCH_PLACES: Final = (4, 4)  # places along and across each part of a lip where a plate may touch first

MASS: Final = """\
contact.inp      *DYNAMIC, DIRECT: a rigid flat striker of {mass:g} kg at {velocity:g} m/s, *SURFACE BEHAVIOR,
                 PRESSURE-OVERCLOSURE=LINEAR, {stiffness:.4g} Pa/m ({why});
                 U and V of the striker, set HEAVY.                  ours: contact.csv
                 Ours presses on the patch uniformly, theirs as a rigid flat face does.
"""
PLATE: Final = """\
contact.inp      *DYNAMIC, DIRECT: the reed, {cells} elements C3D20R (set STRIKER) on the mesh of our plate, lands on
                 the whole seat ({mesh}), *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR,
                 {stiffness:.4g} Pa/m ({why}).
                 It starts {start:+.6g} s from the start of the scene, just above the seat, with the displacements and
                 velocities (*INITIAL CONDITIONS) that our modes have then. Printed: total force on the surface STRUCK.
                 BALLAST flies away from the bodies and has most of the energy: without it ccx stops, as its energy
                 balance does not count the springs of the contact correctly.
                                                                     ours: contact.csv
                 Ours presses uniformly on each of {ports} parts of the patch, with the {modes} modes of the reed below
                 {band:g} Hz; theirs has all that its mesh carries, so compare forces filtered as contact.csv has them.
"""


@dataclass(frozen=True)
class ContactDeck:
    """Content of a contact deck: its lines after the mesh, the columns of our answer, and the README's paragraph."""

    lines: Sequence[str]
    answer: dict[str, Array]
    told: str


def of_mass(plan: Plan, seat: DeckSeat, greens: GreensFunction, dt: float) -> ContactDeck:
    """Return the deck of a rigid mass in free flight. Raises `DeckError`, `ModelError` for what no deck can hold."""
    scene = plan.scene
    mass, velocity = _mass(scene.reed)
    _refuse(scene, {"contact.gap": scene.contact.gap, f"contact.{scene.contact.uneven}": scene.contact.uneven})
    stiffness, why = _stiffness(scene.contact.law, scene.seat, seat.area, dt)
    touch = impact.Contact(impact.Body(greens), law=impact.LinearSpring(stiffness * seat.area))
    problem = impact.ContactProblem(impact.rigid_mass(mass=mass, velocity=velocity), contacts=[touch])
    result = impact.solve(problem, dt=dt / SUBSTEPS, duration=min(scene.run.duration, MOST_STEPS * dt))
    duration = _deck_duration(result, dt)
    steps = slice(0, round(duration / result.dt) + 1, SUBSTEPS)
    speeds = velocity + np.cumsum(result.force) * result.dt / mass
    answer = {
        "time [s]": result.time[steps],
        "velocity of the striker [m/s]": speeds[steps],
        "force [N]": result.force[steps],
    }
    words = MASS.format(mass=mass, velocity=velocity, stiffness=stiffness, why=why)
    return ContactDeck(list(mass_contact(seat.deck, mass, velocity, stiffness, duration, dt)), answer, words)


def check_landing(plan: Plan) -> None:
    """Raise `DeckError` for a scene of a plate that no deck can hold."""
    scene = plan.scene
    _refuse(scene, {"contact.waviness": scene.contact.waviness, "reed.curvature": structure.is_curved(scene.reed)})
    if structure.is_loaded(scene.reed):
        raise DeckError("reed: a deck holds none of its loads; remove pressure, gravity and forces from [reed]")


def of_plate(plan: Plan, seat: DeckSeat, dt: float, mesh: str) -> ContactDeck:
    """Return the deck of a plate that lands on the whole seat. Raises as `of_mass`."""
    scene, reed, lip = plan.scene, plan.scene.reed.thin_plate, seat.lip
    assert reed is not None
    check_patch(seat.deck)
    plate = sheets.plate_modes(reed.sheet(plan.method.reed.bandwidth))
    width, offset = scene.run.filter_width, scene.contact.offset
    lips = reed.lips(None if lip is None else replace(lip, offset=offset))
    greens = plate.greens(lips, 0.0)
    striker = reed.body(replace(greens, zeta=np.zeros_like(greens.zeta)))
    stiffness, why = _stiffness(scene.contact.law, scene.seat, seat.area, dt)
    above = 0.0 if lip is None else tilted(lip.lines_across(2), scene.contact.tilt, scene.contact.tilt_axis).min()

    def gap(points: Array) -> Array:
        """Return the gaps under the undeformed plate [m], at positions relative to the lip's centre."""
        return np.asarray(scene.contact.gap - above + tilted(points, scene.contact.tilt, scene.contact.tilt_axis))

    places = (lip or reed.own_lip).cells(*TOUCH_PLACES)[0].reshape(-1, 2)
    centre = np.asarray(plate.sheet.shape.centre) + offset
    shapes = np.column_stack([plate.shape_at(one, centre + places) for one in np.eye(len(plate.modes.omega))])
    state, omega = striker.modal_start(), plate.modes.omega
    first = _first_touch(scene.run.duration, state, omega, shapes, gap(places), dt) - LEAD
    at_start = ModalState(*(one[:, 0] for one in _moved(state, omega, np.array([dt * first]))))
    layer = PlateStriker(
        replace(plate.mesh, points=plate.mesh.points - centre + seat.centre[:2]),
        plate.sheet.weighed(plate.mesh),
        reed.thickness,
        plate.mesh.lines.get(CLAMPED, np.zeros(0, dtype=np.int64)),
        seat.centre[2] + gap(plate.mesh.points - centre),
        plate.field(at_start.displacement),
        plate.field(at_start.velocity),
    )
    ours, _ = face_greens(seat.model, Aims(max(seat.method.bandwidth or 0.0, 2 / width), MOST_STEPS * dt, TOLERANCE))
    problem = problem_of(scene, replace(striker, velocity=0.0, state=at_start), impact.Body(ours))
    problem = _with_springs(problem, stiffness * seat.area)
    duration = min(scene.run.duration - dt * first, MOST_STEPS * dt)
    result = as_one(impact.solve(problem, dt=dt / SUBSTEPS, duration=duration), Division.from_greens(ours).shares)
    duration = _deck_duration(result, dt)
    steps = slice(0, round(duration / result.dt) + 1, SUBSTEPS)
    answer = {
        "time [s]": result.time[steps],
        "force [N]": result.force[steps],
        f"force, mean over {1e6 * width:g} us [N]": impact.measures.filtered_force(result, width)[steps],
    }
    words = PLATE.format(
        mesh=mesh, cells=len(plate.mesh.cells), stiffness=stiffness, why=why, start=dt * first,
        ports=len(problem.contacts), modes=len(omega), band=sheets.CUTOFF * plate.sheet.bandwidth,
    )  # fmt: skip
    return ContactDeck(list(plate_contact(seat.deck, layer, stiffness, duration, dt)), answer, words)


def _mass(reed: Structure) -> tuple[float, float]:
    """Return mass [kg] and velocity [m/s] of a rigid striker in free flight."""
    greens = reed.closed_form()
    free = None if greens is None else greens.modal
    if free is None or free.omega.tolist() != [0.0]:
        raise DeckError(
            f"reed.kind = {reed.kind!r}: contact is written for a mass with a velocity (rigid_mass) and "
            "for plates (flapper, sheet, disc, ring_plate); strike with one of these"
        )
    return 1.0 / float(free.inverse_mass()[0, 0]), reed.body(free).velocity


def _refuse(scene: Scene, also: dict[str, object]) -> None:
    """Raise `DeckError` for scene keys that a deck cannot represent."""
    drives = {"load": scene.load, "base": scene.base, "wave": scene.wave, "gas": scene.gas, "spring": scene.spring}
    parts = {"stopper": scene.stopper, **drives}
    contact = {"contact.film": scene.contact.film, "contact.preload": scene.contact.preload}
    if keys := [key for key, value in {**parts, **contact, **also}.items() if value]:
        raise DeckError(f"{keys[0]}: has no place in the deck of an impact; remove it for the comparison")


def _stiffness(stated: ContactLaw, seat: Structure, area: float, dt: float) -> tuple[float, str]:
    """Return the contact stiffness per area [Pa/m], and its origin in words."""
    law = stated.law()
    if isinstance(law, impact.LinearSpring):
        return law.stiffness / area, "contact.law, over the patch's area"
    if isinstance(law, impact.Signorini):
        body = seat.elastic
        assert body is not None
        solids = (one.solid for one in (body.material, *body.materials.values()))
        stiffest = max(one.density * float(one.c_p_along([0.0, 0.0, 1.0])) for one in solids)
        return stiffest / dt, "in place of a rigid contact: rho c_p over the time step"
    raise DeckError(f"contact.law.kind = {stated.kind!r}: state spring or signorini")


def _with_springs(problem: impact.ContactProblem, stiffness: float) -> impact.ContactProblem:
    """Return the problem with the ``stiffness`` [N/m] divided over springs in its contacts, by their shares of area."""
    shares = Division.from_greens(problem.target.greens).shares
    springs = (impact.LinearSpring(stiffness * float(share)) for share in shares)
    return replace(
        problem, contacts=tuple(replace(one, law=law) for one, law in zip(problem.contacts, springs, strict=True))
    )


def _moved(state: ModalState, omega: Array, time: Array) -> tuple[Array, Array]:
    """Return coordinates and velocities (m, n) of m free, undamped modes at n times."""
    w, first, speed = omega[:, None], state.displacement[:, None], state.velocity[:, None]
    cosine, sine = oscillator.decaying_pair(time, w, np.zeros(1))
    return first * cosine + speed * sine, speed * cosine - w**2 * first * sine


def _first_touch(duration: float, state: ModalState, omega: Array, shapes: Array, gaps: Array, dt: float) -> int:
    """Return the last step before the plate first touches the seat; where it touches at the start already, its free
    motion is followed backwards, and the step is negative."""

    def is_open(steps: Integers) -> NDArray[np.bool_]:
        moved, _ = _moved(state, omega, np.asarray(dt * steps, dtype=np.float64))
        return np.asarray((shapes @ moved + gaps[:, None]).min(axis=0) > 0)

    forwards = bool(is_open(np.zeros(1, dtype=np.int64))[0])
    last = math.ceil(duration / dt) if forwards else MOST_STEPS
    for first in range(0, last, FLIGHT_BLOCK):
        steps = np.arange(first, min(first + FLIGHT_BLOCK, last) + 1)
        ends = is_open(steps if forwards else -steps) != forwards
        if ends.any():
            step = int(steps[ends.argmax()])
            return step - 1 if forwards else -step
    if forwards:
        raise DeckError(
            f"reed: it does not reach the seat within run.duration = {duration:g} s by itself; release it "
            "towards the seat (release, deflection or velocity), or watch longer"
        )
    raise DeckError(
        f"reed: it is not free of the seat {MOST_STEPS} steps of the deck before its start either; increase "
        "contact.gap, or reduce contact.tilt"
    )


def _deck_duration(result: impact.ImpactResult, dt: float) -> float:
    """Return the duration of the deck [s] in whole steps: until `DECK_IN_IMPACT_DURATIONS` after the first touch."""
    groups = impact.measures.contact_groups(result)
    last = float(result.time[-1])
    ends = min(last, float(groups[0, 0] + DECK_IN_IMPACT_DURATIONS * np.diff(groups[0])[0])) if len(groups) else last
    return dt * max(1, math.ceil(ends / dt * (1 - 1e-12)))


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
CalculiX integrates the mass of a C3D10 by four points, we exactly (some 0.1 %); C3D20 lack the nodes inside faces that
our hexahedra have, which have a nodal mass (some 1 %, less on finer meshes);
from poisson = 0.45 on we project the change of volume, which CalculiX does not; direct dynamics lags
behind by its time step, by some 1 % at the end of the pulse and more later: halve the step to see it.
"""


def write_calculix(plan: Plan, folder: Path, progress: Progress = silent) -> Iterator[Path | str]:
    """Write the decks, our answers to them (CSV) and README.txt; yield the files, and a note if the contact deck is
    missing. Modes and response are computed before anything is written.

    Raises:
        DeckError: the seat has no finite elements, or is struck on an arc of its ring.
        ModelError: its elements or supports have no place in a deck.
    """
    width = plan.scene.run.filter_width
    dt = width / PER_PULSE
    seat = deck_seat(plan, progress)
    deck = seat.deck
    frequencies = solve_modes(seat.model, min(MODES, seat.model.size), progress=progress).frequencies_hz
    times = dt * np.arange(1, PULSES * PER_PULSE + 1)
    band = max(seat.method.bandwidth or 0.0, 2 / width)
    greens = greens_function(
        seat.model,
        bandwidth=band,
        duration=MOST_STEPS * dt,
        tolerance=TOLERANCE,
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
    except (DeckError, ModelError, MeshingError, ConvergenceError) as reason:
        words = f"contact.inp      is not written: {reason}\n"
        yield f"no contact.inp: {reason}"
    share = "" if deck.share == 1 else f"\n{17 * ' '}The model carries {deck.share:g} of the whole load."
    numbers = {"node": deck.node, "axis": deck.axis, "modes": len(frequencies), "width": width, "steps": PER_PULSE}
    text = README.format(element=deck.element, share=share, contact=words, **numbers)
    write_whole(folder / "README.txt", text.encode())
    yield folder / "README.txt"


def _contact(
    plan: Plan, seat: DeckSeat, greens: GreensFunction, dt: float, folder: Path, progress: Progress
) -> tuple[str, Sequence[Path]]:
    """Write contact.inp; return its paragraph of the README, and the files. Raises `DeckError`, `ModelError`."""
    mesh, files = "mesh.inp", list[Path]()
    if plan.scene.reed.thin_plate is not None:
        check_landing(plan)
        whole = whole_seat(plan, progress)
        if seat.deck.plane or seat.deck.share != 1:
            mesh = "whole.inp"
            files.append(_lines(folder / mesh, whole.deck.lines))
        contact = of_plate(plan, whole, dt, mesh)
    else:
        contact = of_mass(plan, seat, greens, dt)
    rows = zip(*(column.tolist() for column in contact.answer.values()), strict=True)
    files.append(_deck(folder / "contact.inp", contact.lines, mesh))
    return contact.told, [*files, write_csv(folder / "contact.csv", list(contact.answer), rows)]


def _deck(path: Path, steps: Sequence[str], mesh: str = "mesh.inp") -> Path:
    return _lines(path, [f"*INCLUDE, INPUT={mesh}", *steps])


def _lines(path: Path, lines: Sequence[str]) -> Path:
    write_whole(path, ("\n".join(lines) + "\n").encode("ascii"))
    return path
