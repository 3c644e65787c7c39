"""Decks of a scene for CalculiX, of its seat and of a plate that lands on it, with our own answers beside them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

import impact
from impact.bodies.body import ModalState
from impact.files.csv_table import write_csv
from impact.files.safe_files import write_whole
from impact.greens import oscillator
from impact.notices import Progress, silent
from seatfem.structures.finite_elements import matrices, static_greens
from seatfem.structures.formats.calculix_deck import CalculixBody, calculix_body, landing
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds import elastic, structure
from seatfem.structures.lip import tilted
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.method import Method
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.modes import ConvergenceError, solve_modes
from seatfem.study.impacts.bodies import problem_of, solve_body
from seatfem.study.plan import Plan
from seatfem.study.scene import Scene

MODES: Final = 20  # modes of the frequency deck
PER_PULSE: Final = 40  # steps of the landing per width of the filter
SUBSTEPS: Final = 5  # our steps per step of the deck
MOST_STEPS: Final = 400  # most steps of the landing: ccx takes about a second for each
LEAD: Final = 2  # steps from the start of the deck to the first touch
MOST: Final = 150_000  # most unknowns of a seat on which ccx is to integrate in time

README: Final = """\
Decks for CalculiX (ccx), in SI units, and our own answers (docs/exchange.md). Run each by, e.g., ccx static.

mesh.inp       {deck.element} elements as the seat's run meshes it: materials, supports, the struck surface STRUCK, and
               node {deck.node} (set PATCH), whose component {deck.axis} is the mean normal displacement of STRUCK.
frequency.inp  *FREQUENCY, the lowest {modes} modes; ours: frequency.csv
static.inp     *STATIC, 1 N on all of STRUCK, {deck.share:g} of it on the model: U of PATCH [m]; ours: static.csv
contact.inp    {contact}
"""


def write_calculix(plan: Plan, folder: Path, progress: Progress = silent) -> Iterator[Path | str]:
    """Write the decks, our answers to them (CSV) and README.txt; yield the files, and a note if the deck of the landing
    is missing.

    Raises:
        ModelError: the seat has no finite elements, or its elements, supports or struck face have no place in a deck.
    """
    body = plan.scene.seat.elastic
    if body is None:
        raise ModelError(f"seat.kind = {plan.scene.seat.kind!r} has no finite elements; give a seat that is meshed")
    if body.struck_arc:
        raise ModelError("only an arc of the seat's ring is struck: a half section has none; remove seat.arc")
    if held := [support.kind for support in body.supports if support.kind != "sliding"]:
        raise ModelError(f"seat.supports: a {held[0]} support has no place in the deck; use clamped or sliding faces")
    model, deck = _seat(body, plan.method.seat, progress)
    frequencies = solve_modes(model, min(MODES, model.size), progress=progress).frequencies_hz.tolist()
    area = sum(port.area for port in model.ports.values())
    compliance = float(static_greens(model, 0.0).static_compliance()[0, 0])
    yield _lines(folder / "mesh.inp", deck.lines)
    yield _lines(folder / "frequency.inp", ["*INCLUDE, INPUT=mesh.inp", *deck.frequency(len(frequencies))])
    yield write_csv(folder / "frequency.csv", ["mode", "frequency [Hz]"], enumerate(frequencies, start=1))
    yield _lines(folder / "static.inp", ["*INCLUDE, INPUT=mesh.inp", *deck.static()])
    yield write_csv(folder / "static.csv", ["displacement [m]"], [[compliance]])
    try:
        words, files = _landing(plan, body, area, deck, folder, progress)
        yield from files
    except (ModelError, MeshingError, ConvergenceError) as reason:
        words = f"is not written: {reason}"
        yield f"no contact.inp: {reason}"
    write_whole(folder / "README.txt", README.format(deck=deck, modes=len(frequencies), contact=words).encode())
    yield folder / "README.txt"


def _seat(body: elastic.Elastic, method: Method, progress: Progress) -> tuple[SecondOrderModel, CalculixBody]:
    """Return our model of the seat, with its patch as one port, and its deck."""
    method = replace(method, rings=1, lip=None)
    mesh, level = body.meshes(method, progress)[0], body.elements_of(method)
    model, solids = matrices(body, mesh, level, progress), body.solids(regions_of(mesh))
    return model, calculix_body(model, solids, struck=body.struck_face, copies=body.copies.get(level, 1))


def _spring(scene: Scene) -> float:
    """Return the stiffness of the contact [N/m]. Raises `ModelError` for what the deck of a landing cannot hold."""
    if not isinstance(law := scene.contact.law.law(), impact.LinearSpring):
        raise ModelError(f"contact.law.kind = {scene.contact.law.kind!r}: ccx needs a stiffness; state a spring")
    left_out = {key: getattr(scene, key) for key in ("stopper", "load", "base", "wave", "spring")}
    left_out |= {each.table: each for each in scene.driven_by}
    left_out |= {f"contact.{key}": getattr(scene.contact, key) for key in ("film", "preload", "waviness")}
    left_out |= {"reed.curvature": structure.is_curved(scene.reed), "reed: a load": structure.is_loaded(scene.reed)}
    if keys := [key for key, value in left_out.items() if value]:
        raise ModelError(f"{keys[0]} has no place in the deck of a landing; remove it for the comparison")
    return law.stiffness


def _landing(
    plan: Plan, body: elastic.Elastic, area: float, deck: CalculixBody, folder: Path, progress: Progress
) -> tuple[str, Sequence[Path]]:
    """Write the deck of a plate that lands on the whole seat; return its paragraph of the README, and the files."""
    scene, method, mesh = plan.scene, plan.method, "mesh.inp"
    solved = scene.reed.solved(method.reed, mesh_error=False)
    stiffness, dt = _spring(scene) / area, scene.run.filter_width / PER_PULSE
    if deck.element.startswith("CAX") or deck.share != 1:
        mesh, deck = "whole.inp", _seat(body, replace(method.seat, level="3d"), progress)[1]
    if (unknowns := 3 * deck.node) > MOST:
        raise ModelError(f"seat.mesh: {unknowns} unknowns are more than ccx can march ({MOST}); state a larger size")
    if deck.centre is None:
        raise ModelError(f"seat.kind = {body.kind!r}: its struck face must be flat and face up along z; turn the part")
    seat = solve_body("seat", scene.seat, method.seat, scene.run.duration, progress, mesh_error=False)
    assert seat is not None
    striker = scene.reed.body(replace(solved.greens, zeta=np.zeros_like(solved.greens.zeta)))
    problem = problem_of(scene, striker, impact.Body(seat.greens))
    result = impact.solve(problem, dt=dt / SUBSTEPS, duration=scene.run.duration)
    force = result.force.reshape(len(result.time), -1).sum(axis=1)
    touched = np.flatnonzero(force > 0)
    if not touched.size:
        raise ModelError("run.duration: the reed does not reach the seat so soon; release it nearer, or watch longer")
    first = max(0, int(touched[0]) // SUBSTEPS - LEAD)
    steps = min((len(force) - 1) // SUBSTEPS - first, MOST_STEPS)
    state, omega, time = striker.modal_start(), solved.plate.modes.omega, dt * first
    cosine, sine = oscillator.decaying_pair(np.array([time]), omega, np.zeros(1))
    moved, speed = state.displacement, state.velocity
    state = ModalState(moved * cosine + speed * sine, speed * cosine - omega**2 * moved * sine)
    lip, tilt = method.seat.lip, (scene.contact.tilt, scene.contact.tilt_axis)
    lowest = 0.0 if lip is None else float(tilted(lip.lines_across(2), *tilt).min())
    places = solved.plate.mesh.points - solved.plate.sheet.shape.centre - scene.contact.offset
    gaps = scene.contact.gap - lowest + tilted(places, *tilt)
    under = deck.centre + np.column_stack([places, gaps])
    files = [] if mesh == "mesh.inp" else [_lines(folder / mesh, deck.lines)]
    lines = landing(deck, solved.plate, under, state, stiffness, steps, dt)
    files.append(_lines(folder / "contact.inp", [f"*INCLUDE, INPUT={mesh}", *lines]))
    rows = np.column_stack([result.time - time, force])[SUBSTEPS * first :: SUBSTEPS][: steps + 1]
    files.append(write_csv(folder / "contact.csv", ["time [s]", "force [N]"], rows.tolist()))
    return f"the reed (STRIKER) on {mesh}, {stiffness:.4g} Pa/m, from {time:.6g} s on; ours: contact.csv", files


def _lines(path: Path, lines: Sequence[str]) -> Path:
    write_whole(path, ("\n".join(lines) + "\n").encode("ascii"))
    return path
