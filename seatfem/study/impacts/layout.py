"""The drawing of a scene as data for `seatfem.pictures.layout`: bodies in their places, loads and motions in words."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from impact.quantities import enumeration, percent
from seatfem.pictures import scene_drawing
from seatfem.pictures.layout import NOMINAL, Action, Layout, Tilt, Way
from seatfem.structures.errors import ModelError
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.structure import is_curved
from seatfem.structures.lands import FaceLip
from seatfem.structures.outlines import BodyViews, Loops, covered_share, crossings, length_text, round_sizes
from seatfem.structures.rings import Division
from seatfem.study.scene import ContactGeometry, Scene, drives, files
from seatfem.study.scene.drives import Wave
from seatfem.study.scene.lips import COVERED
from seatfem.study.scene.wings import Drive
from seatfem.units import write_quantity

SAMPLES: Final = 1024  # instants of the run from which the range of a load is taken
SHOWN_ARCS: Final = 400
"""Most arcs whose borders are drawn."""


def layout_of(scene: Scene, division: Division | None = None) -> Layout:
    """Return bodies, dimensions, loads and notes of the scene's drawing.

    ``division``: a run's division of the lip into arcs; ``None``: as the scene states it.

    Raises:
        ModelError, GeometryError: the faces in a file cannot be found.
        MeshingError, OSError: gmsh cannot be run; a file is absent.
    """
    contact, reed, stopper = scene.contact, scene.reed, scene.stopper
    at = scene.geometry.own_place
    seen = reed.views_at(at).turned_over().moved(0.0, z=contact.gap)
    stated = division or Division(contact.ports or 1, contact.rings)
    if stated.arcs > 1 or scene.geometry.region() is not None:  # the contact is drawn on the struck face
        seen = replace(seen, contact=(), struck=())
    views, overlap = scene.seat.views(), scene.geometry.segments()
    if overlap is not None and overlap.is_part:
        met = tuple(np.concatenate([a, b[::-1]]) for a, b in overlap.lines_across(2))
        cut = [np.array([(x, 0.0) for x in ends]) for ends in crossings(met, 0.01 * np.ptp(met[0])).reshape(-1, 2)]
        views = replace(views, contact=met, struck=tuple(cut))
    bodies = {"seat": views.moved(*contact.offset), "reed": seen}
    if stopper is not None:
        along = 0.0 if stopper.at is None else reed.find_plan_distance(stopper.at, at)
        above = contact.gap + NOMINAL if seen.symbol else seen.heights[1]
        retainer = scene.geometry.retainer
        above_reed = stopper.body.views() if retainer is None else retainer.views(reed.views_at(at))
        bodies["stopper"] = above_reed.turned_over().moved(along, z=above + scene.geometry.stopper_gap)
    low, high = seen.extent
    ends, during = (float(low[0]), float(high[0])), np.linspace(0.0, scene.run.duration, SAMPLES)
    springs = [(spring.words, _spring_places(spring, reed, at)) for spring in scene.spring]
    actions = (
        *_reed_actions(reed, at, during, ends),
        *_load_actions(reed, scene.load, at, during, ends),
        *(Action(words, float(at[:, 0].min()), float(at[:, 0].max()), -1) for words, at in springs),
        *_other_actions(scene.wave, scene.base, scene.driven_by),
    )
    return Layout(
        title=scene.title or f"{seen.name} on {views.name}",
        bodies=bodies,
        gap=contact.gap,
        lift=0.0 if stopper is None else scene.geometry.stopper_gap_at_contact,
        start=_start(reed, at),
        actions=actions,
        springs=np.concatenate([np.zeros((0, 2)), *(places for _, places in springs)]),
        arcs=_arcs(scene.geometry, stated) + contact.offset,
        tilts=tuple(_tilts(scene.geometry, bodies, reed.views_at(at).contact)),
        notes=tuple(_notes(scene.geometry, bodies, stated, chosen=division is not None)),
        lands=tuple(_lands(scene.geometry)),
    )


def _tilts(geometry: ContactGeometry, bodies: Mapping[str, BodyViews], own: Loops) -> Iterator[Tilt]:
    """Yield the faces that are tilted; ``own``: the reed's face, which a stopper without one takes."""
    for role, table in (("seat", geometry.contact), ("stopper", geometry.stopper)):
        if table is not None and table.tilt:
            middle = bodies[role].origin[:2]
            face = bodies[role].contact or tuple(loop + middle for loop in own if role == "stopper")
            corners = np.concatenate(face or (np.array([middle]),))
            yield Tilt(role, bodies[role], table.tilt, table.tilt_axis, corners)


def facts_of(layout: Layout) -> str:
    """Return the main sizes in a sentence: "reed 32 x 12 x 0.3 mm over a lip of 9 to 11 mm diameter, gap 0"."""
    words = [f"{_reed_words(layout.reed)} over {_face_words(layout.seat)}", f"gap {length_text(layout.gap)}"]
    if (stopper := layout.bodies.get("stopper")) is not None:
        words.append(f"stopper at {length_text(layout.lift)} ({stopper.name})")
    return "; ".join([", ".join(words), *(action.words + action.detail for action in layout.actions)])


def cover_note(layout: Layout) -> str:
    """Return a note if the reed covers only a part of the struck face in plan; "" if it covers all."""
    share = covered_share(layout.seat, layout.reed)
    if share is None or share > COVERED:
        return ""
    return (
        f"in plan the reed covers {percent(share)} of the seat's struck face; it is computed as if it covered all of it"
    )


def _reed_words(reed: BodyViews) -> str:
    if reed.symbol:
        return f"reed ({reed.name})"
    (low, high), (bottom, top) = reed.extent, reed.heights
    if diameters := round_sizes(reed.plan):
        words = " to ".join(f"{1e3 * each:.4g}" for each in diameters)
        return f"reed ({reed.name}) of {words} mm diameter, {1e3 * (top - bottom):.4g} mm thick,"
    sides = " x ".join(f"{1e3 * side:.4g}" for side in (*(high - low), top - bottom))
    return f"reed ({reed.name}) {sides} mm"


def _face_words(views: BodyViews) -> str:
    if not views.contact:
        return f"the seat ({views.name})"
    if sizes := round_sizes(views.contact):
        words = " and ".join(
            " to ".join(f"{1e3 * each:.4g}" for each in sizes[k : k + 2]) for k in range(0, len(sizes), 2)
        )
        face = "struck disc" if len(sizes) == 1 else "lip" if len(sizes) == 2 else "lands"
        return f"{'' if face == 'lands' else 'a '}{face} of {words} mm diameter"
    corners = np.concatenate(views.contact)
    x, y = 1e3 * np.ptp(corners, axis=0)
    return f"a struck face of {x:.4g} x {y:.4g} mm"


def _start(reed: Structure, at: float) -> Array:
    """Return (n, 2) position and deflection [m] of a beam that is released from a deflected shape, else (0, 2)."""
    shape = reed.start_shape()
    return shape - np.array([at, 0.0]) if np.any(shape[:, 1]) else np.zeros((0, 2))


def _spring_places(spring: drives.ValveSpring, reed: Structure, at: float) -> Array:
    """Return the (n, 2) places at which valve springs are drawn [m]."""
    if spring.at is not None:
        return np.array([(reed.find_plan_distance(spring.at, at), 0.0)])
    return reed.spring_points if spring.places is None else spring.places


def _arcs(geometry: ContactGeometry, division: Division) -> Array:
    """Return the (n, 2, 2) end points of the lines between arcs of the lip [m]."""
    if not 1 < division.arcs <= SHOWN_ARCS:
        return np.zeros((0, 2, 2))
    lip = geometry.struck(division.arcs, division.rings)
    if lip is None:
        return np.zeros((0, 2, 2))
    one, other = lip.cuts(np.arange(division.arcs) / division.arcs)
    return np.stack([one, other], axis=1)


def _lands(geometry: ContactGeometry) -> Iterator[tuple[str, float, float]]:
    """Yield the name and the centre of each of several ports beside each other [m]; none of lands about one centre."""
    points, region = geometry.port_points(), geometry.region()
    if isinstance(region, FaceLip) and len(points) == len(region.face.names):
        for name, port in zip(region.face.names, points, strict=True):
            x, y = port.mean(axis=0).tolist()
            yield name, x, y


def _other_actions(
    waves: Sequence[Wave], bases: Sequence[drives.Base], drives_of_wings: Sequence[Drive]
) -> Iterator[Action]:
    """Yield incoming waves, base motions, and what wings do."""
    for wave in waves:
        peak = float(np.abs(wave.course().value).max())
        yield Action(f"a wave of strain up to {peak:.3g} comes along the {wave.of}", 0.0, 0.0, 0)
    for base in bases:
        yield Action(f"the base of the {base.of} moves as in a file", 0.0, 0.0, 0)
    for each in drives_of_wings:
        yield Action(*each.label, 0)


def _reed_actions(reed: Structure, at: float, during: Array, ends: tuple[float, float]) -> Iterator[Action]:
    """Yield the motion and the loads that the table [reed] states."""
    if (pressure := getattr(reed, "pressure", None)) is not None:
        radius = getattr(reed, "pressure_radius", None)
        yield _course("pressure", pressure, during, *(ends if radius is None else (-radius, radius)))
    for name in ("point_force", "force"):
        if (force := getattr(reed, name, None)) is not None:
            place = reed.find_plan_distance(getattr(force, "at", None) or at, at)
            yield _course("force", force, during, place, place)
    if (gravity := getattr(reed, "gravity", None)) is not None:
        yield _value("gravity", gravity, "acceleration", ends)
    if (velocity := getattr(reed, "velocity", None)) is not None:
        yield _value("velocity", velocity, "velocity", (0.0, 0.0))
    yield from _release(reed)


def _load_actions(
    reed: Structure, loads: Sequence[drives.ExternalLoad], at: float, during: Array, ends: tuple[float, float]
) -> Iterator[Action]:
    for load in loads:
        if load.pressure is not None:
            assert load.area is not None
            half = math.sqrt(max(load.area.area) / math.pi)
            areas = " to ".join(f"{1e6 * each:.4g}" for each in sorted({min(load.area.area), max(load.area.area)}))
            yield _course("pressure", load.pressure, during, -half, half, f" on {areas} mm²", load.area(0.0))
        elif load.force is not None:
            place = reed.find_plan_distance(load.at or at, at) if load.point is None else load.point[0]
            yield _course("force", load.force, during, place, place)
        elif load.gravity is not None:
            yield _value("gravity", load.gravity, "acceleration", ends)
        elif load.base_motion is not None:
            yield _course("acceleration of the frame", load.base_motion, during, *ends)


def _release(reed: Any) -> Iterator[Action]:
    """Yield the initial deflection or modal velocity of the reed."""
    release = getattr(reed, "release", None)
    deflection = getattr(reed, "deflection", None)
    if release is None:
        if isinstance(deflection, float):
            yield _value("deflected at the start", deflection, "length", (0.0, 0.0))
        return
    mode = getattr(release, "mode", None)
    velocity = getattr(release, "velocity", None)
    if velocity is not None:
        yield _value(f"start in mode {mode}, velocity", velocity, "velocity", (0.0, 0.0))
    for key, words in (("tip_deflection", "released from"), ("deflection", "released from")):
        value = getattr(release, key, None)
        if value is not None:
            yield Action(f"{words} {length_text(value)}{release.where}", 0.0, 0.0, _sign(value))
    if getattr(release, "field", None) is not None:
        yield Action(f"starts as in {release.field.name}", 0.0, 0.0, 0)


def _sign(value: float) -> Way:
    return -1 if value < 0 else 1 if value > 0 else 0


def _value(words: str, value: float, dimension: str, ends: tuple[float, float]) -> Action:
    return Action(f"{words} {write_quantity(abs(value), dimension, 4)}", *ends, _sign(value))


def _course(
    words: str, course: Any, during: Array, low: float, high: float, more: str = "", area: float = 0.0
) -> Action:
    """Return a load in words: its constant value, or its range at the instants ``during`` and its file.

    ``area``: area of a pressure on the closed reed [m^2], for the forces in the detail.
    """
    dimension, values = type(course).quantity, np.asarray(course.course(during))
    ends = dict.fromkeys((float(values.min()), float(values.max())))
    forces = " to ".join(dict.fromkeys(write_quantity(area * each, "force", 3) for each in ends))
    detail = f": {forces} on the closed reed, positive off its seat" if area else ""
    if course.value is not None:
        size = write_quantity(abs(course.value), dimension, 4)
        return Action(f"{words} {size}{more}", low, high, _sign(course.value), detail)
    size = " to ".join(write_quantity(each, dimension, 3) if each else "0" for each in ends)
    return Action(f"{words} {size}{more}", low, high, 0, f" ({course.file.name}){detail}")


def _notes(
    geometry: ContactGeometry, bodies: Mapping[str, BodyViews], division: Division, *, chosen: bool
) -> Iterator[str]:
    """Yield notes on properties that the views do not show."""
    contact, reed, stopper = geometry.contact, geometry.reed, geometry.stopper
    yield from (f"the {role} {bodies[role].note}" for role in ("seat", "reed") if bodies[role].note)
    if division.count > 1:
        rings = f" x {division.rings} rings" if division.rings > 1 else ""
        lip = None if division.arcs == 1 else geometry.struck(division.arcs)
        on = "" if lip is None or len(lip.names) < 2 else f" on {enumeration(lip.names)}"
        yield f"contact in {division.arcs} segments{rings}{on}"
    elif not chosen and geometry.usual_ports > 1:
        yield "contact along the struck face, in as many segments as a run chooses"
    if contact.tilt:
        axis = math.degrees(contact.tilt_axis)
        tilt = math.degrees(contact.tilt)
        yield f"lip tilted {tilt:.3g}° about the direction {axis:.3g}° from the reed's axis"
    if contact.waviness:
        yield "the lip is wavy (contact.waviness)"
    if is_curved(reed):
        yield "the reed is curved without stress (reed.curvature), drawn flat"
    if contact.preload:
        yield "starts pressed on its seat (preload)"
    if stopper is not None and stopper.profile is not None:
        yield "the retainer's face is drawn to scale, its distance from the reed is not"
    if stopper is not None and stopper.parts != Division():
        try:
            known = geometry.stopper_lip() is not None
        except ModelError:
            known = False
        if known:
            leans = f", tilted {math.degrees(stopper.tilt):.3g}°" if stopper.tilt else ""
            yield f"stopper contact in {stopper.parts.arcs} segments{leans}"


DRAWING: Final = "drawing.png"


def draw_scene(scene: Scene, path: Path, division: Division | None = None) -> Layout:
    """Draw a scene in section and plan to a file, .png, .svg or .pdf, written whole or not at all; return its layout.

    Raises:
        SceneError: a file cannot be read, or the bodies as placed cannot meet.
        PictureError: matplotlib is missing, or cannot write this format.
        Also what `layout_of` raises.
    """
    files.check_files(scene)
    layout = layout_of(scene, division)
    scene_drawing.draw_layout(layout, path)
    return layout
