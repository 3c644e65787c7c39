"""Limits of the theory or the data behind a scene, and simpler models of its contact."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import impact
from impact import measured, measures, notices, quantities
from impact.after.measures import film_force_peak
from impact.after.result import ImpactResult
from impact.greens.base import GreensFunction
from seatfem.structures.kinds import Structure
from seatfem.structures.rings import Division, as_a_whole
from seatfem.study.impacts.contact import run_contacts
from seatfem.study.impacts.touches import Touches
from seatfem.study.scene import ContactGeometry, Scene
from seatfem.study.scene.contact import Stopper
from seatfem.study.scene.drives import ExternalLoad
from seatfem.study.scene.problems import in_role
from seatfem.units import write_quantity

SAMPLES: Final = 4096  # instants of a run at which the largest pressure is taken
POINTS: Final = 720  # points around a lip
COVERED: Final = 0.95  # share of a lip above which a beam counts as covering it
THICKEST_GAS: Final = 1e-4
"""Viscosity [Pa s] above which a fluid is a liquid."""


def validity_advice(
    geometry: ContactGeometry,
    filter_width: float,
    seat: GreensFunction | None = None,
    reed: GreensFunction | None = None,
) -> tuple[notices.Advice, ...]:
    """Return advice where the run exceeds the limits of its theory or of its data; ``filter_width`` [s]."""
    flat = geometry.reed.slender or geometry.reed.thin_plate
    misfits, bands = list[notices.Advice](), list[notices.Advice]()
    for role, structure, greens in (("seat", geometry.seat, seat), ("reed", geometry.reed, reed)):
        if greens is None:
            continue
        band = (fit := fit_of(greens)).highest
        misfits += [] if structure.measured is None else _misfits(role, fit)
        if band is None or filter_width >= 1 / band:
            continue
        passed, least = (write_quantity(width, "time", 3) for width in (filter_width, 1 / band))
        bands.append(
            notices.Advice(
                "1/run.filter_width over the measured band",
                1 / (filter_width * band),
                1.0,
                f"the {role} was measured up to {write_quantity(band, 'frequency', 4)}; a filter of {passed} passes "
                "higher frequencies, which are guessed and not part of the uncertainty",
                f"use run.filter_width >= {least}, or measure to higher frequencies",
            )
        )
    return (*(() if flat is None else flat.limits()), *misfits, *bands)


def film_notes(geometry: ContactGeometry, result: ImpactResult) -> tuple[str, ...]:
    """Return the note that a gas would give way under the largest force of its film."""
    if (keys := geometry.contact.film) is None or keys.viscosity > THICKEST_GAS:
        return ()
    film = keys.on_ring(geometry.seat.lip_face.ring)
    bars = film_force_peak(result) / film.tension * keys.tension_limit / 1e5
    if bars <= 1:
        return ()
    return (
        f"contact.film: its mean pressure reaches {bars:.3g} bar. A gas, as viscosity = {keys.viscosity:g} Pa s says, "
        "would be compressed: the film's force is an upper bound, and the truth lies between this run and the one "
        "without the film (without_film_ in summary.json)",
    )


def covered_notes(geometry: ContactGeometry) -> tuple[str, ...]:
    """Return that a beam covers only a part of the lip that it strikes, which the model presses all around."""
    reed, ring = geometry.reed, geometry.seat.lip_face.ring
    beam, at = reed.slender, geometry.own_place
    if ring is None or beam is None or at is None:
        return ()
    angle = 2 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
    along, across = at + ring[0] * np.cos(angle), ring[0] * np.sin(angle)
    share = float(np.mean((along >= 0) & (along <= beam.span) & (np.abs(across) <= reed.face.width / 2)))
    if share >= COVERED:
        return ()
    outer, place = write_quantity(2 * ring[0] + ring[1], "length", 3), write_quantity(at, "length")
    return (
        f"the reed covers {quantities.percent(share, 2)} of the lip, {outer} wide, at contact.at = {place}; "
        "this model presses all of it. A reed that closes a port reaches beyond its lip all around: make contact.at "
        "smaller, or the reed wider",
    )


def dishing_notes(reed: Structure, seat: Structure, loads: Sequence[ExternalLoad], duration: float) -> tuple[str, ...]:
    """Return that a beam over a port does not dish under the pressure that closes it, with the stress of a round plate.

    ``duration``: of the run [s].

    3 p r^2/(4 t^2) with a clamped edge, 3 (3 + nu) p r^2/(8 t^2) with one free to turn: Timoshenko, Theory of Plates
    and Shells, section 16. Nothing without such a pressure, or where no round port is known.
    """
    time = np.linspace(0.0, duration, SAMPLES)
    thickness, material = getattr(reed, "thickness", None), getattr(reed, "material", None)
    if not reed.traits.has_stress or thickness is None or material is None or seat.files():
        return ()
    closing = max((-float(each.pressure.course(time).min()) for each in loads if each.pressure), default=0.0)
    loops = seat.views(coarse=True).contact
    if closing <= 0 or len(loops) < 2:
        return ()
    radius = min(float(np.hypot(*loop.T).max()) for loop in loops)
    unit = closing * (radius / thickness) ** 2
    clamped, turning = (quantities.text(share * unit, "Pa", 2) for share in (3 / 4, 3 * (3 + material.poisson) / 8))
    port, pressure = write_quantity(2 * radius, "length", 3), write_quantity(closing, "pressure", 2)
    return (
        f"closed under {pressure} over a port of {port} the reed also dishes: about {clamped} to {turning} (round "
        "plate, edge clamped or free to turn). A beam does not know this stress: no stress and no margin has it",
    )


def stopper_notes(stopper: Stopper | None) -> tuple[str, ...]:
    """Return the note that no plan looks at a stopper that is computed or read."""
    if stopper is None or not stopper.body.traits.is_solved:
        return ()
    return (
        f"the stopper (kind {stopper.body.kind!r}) is computed as its keys state it: a run's uncertainty "
        "includes its error, but a plan predicts neither that error nor its computing time",
    )


@dataclass(frozen=True)
class Fit:
    """Quality of a fit to a measured response, as the fit states it.

    Attributes:
        highest: line [Hz]; ``None`` of what is no fit.
        unexplained: part of the response that it misses beyond the noise.
        allowed: of that.
        ranges: of the lines that it misses by more than the noise [Hz], the worst first.
        worst: misfit of neighbouring lines over their noise.
    """

    highest: float | None = None
    unexplained: float = 0.0
    allowed: float = math.inf
    ranges: tuple[tuple[float, float], ...] = ()
    worst: float = 0.0


def fit_of(greens: GreensFunction) -> Fit:
    """Return the words of a Green's function on the fit that made it."""
    fit = greens.provenance.get("fit")
    if not isinstance(fit, dict):
        return Fit()
    band, ranges = fit.get("band_hz"), fit.get("unexplained_lines_hz")
    highest = float(band[1]) if isinstance(band, list | tuple) and len(band) == 2 else None
    lines = tuple((float(low), float(high)) for low, high in ranges) if isinstance(ranges, list | tuple) else ()
    missed, allowed, worst = (fit.get(key) for key in ("unexplained", "unexplained_allowed", "misfit_over_noise_worst"))
    if not (isinstance(missed, float) and isinstance(allowed, float) and isinstance(worst, float)):
        return Fit(highest)
    return Fit(highest, missed, allowed, lines, worst)


def _misfits(role: str, fit: Fit) -> Iterator[notices.Advice]:
    """Yield that the fit to a record misses more of it than its noise explains, with the lines."""
    remedy = f"leave these lines out, state {role}.free = true for a free body, or measure a wider band"
    reason = "it is not the response of a linear, passive body with all its modes within the band"
    words = measured.pole_fit.in_words(list(fit.ranges))
    if fit.unexplained > fit.allowed:
        what = f"part of the {role}'s record that its poles miss beyond the noise"
        where = f", most of it {words}" if words else ""
        yield notices.Advice(what, fit.unexplained, fit.allowed, f"{reason}{where}", remedy)
    elif fit.ranges:
        what = f"largest misfit of the {role}'s poles over the noise of the record"
        limit = math.sqrt(measured.pole_fit.BLOCK_LIMIT)
        yield notices.Advice(what, fit.worst, limit, f"{reason} {words}", remedy)


ONE_PORT: Final = "one_port"
BEAM: Final = "beam"
WITHOUT_FILM: Final = "without_film"


def simpler_models(scene: Scene, striker: impact.Body, seat: GreensFunction, dt: float) -> dict[str, Touches]:
    """Return the same impact by simpler models, by name; none where the contact is not along a lip and has no film.

    `WITHOUT_FILM`: the same without the film in the gap. The others are of one contact: both strike the mean of the
    seat's lip, over the mean of the gap along it. `ONE_PORT`: the same plate, by the mean of its motion along the lip.
    `BEAM`: what stands for the plate as a beam, where it knows one; none under the loads and with the stopper of a
    scene.
    """
    division, results = Division.from_greens(seat), {}
    if scene.contact.film is not None:
        contact = scene.contact.model_copy(update={"film": None})
        results[WITHOUT_FILM] = run_contacts(scene.model_copy(update={"contact": contact}), striker, seat, dt)
    if division.arcs > 1:
        for name, body in simpler_bodies(scene, striker, division):
            results[name] = run_contacts(scene, body, as_a_whole(seat), dt)
    return results


def simpler_keys(found: Mapping[str, Touches], filter_width: float) -> dict[str, object]:
    """Return for summary.json, of each model: NAME_impulse_Ns and NAME_filtered_peak_force_N."""
    keys: dict[str, object] = {}
    for name, touches in found.items():
        keys[f"{name}_impulse_Ns"] = measures.impulse(touches.seat)
        keys[f"{name}_filtered_peak_force_N"] = measures.filtered_peak_force(touches.seat, filter_width)
    return keys


def simpler_bodies(scene: Scene, striker: impact.Body, division: Division) -> Iterator[tuple[str, impact.Body]]:
    """Yield by name the simpler bodies in place of ``striker``, whose lip is divided."""
    greens = striker.greens
    if set(division.names) <= set(greens.ports):
        weights = np.zeros((len(greens.ports), 1))
        for name, share in zip(division.names, division.shares, strict=True):
            weights[greens.port_index(name)] = share
        yield ONE_PORT, replace(striker, greens=greens.combined(weights, ("contact",)))
    if scene.load or scene.base or scene.spring or scene.gas is not None or scene.stopper is not None:
        return
    with in_role("reed", scene.reed):
        plate = scene.reed.thin_plate
        beam = None if plate is None else plate.as_a_beam(greens)
    if beam is not None:
        yield BEAM, beam
