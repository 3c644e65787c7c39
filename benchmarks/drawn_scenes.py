"""Whole scenes drawn at random over all that a scene file may say, short ones that cost some seconds each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from drawn_seats import ELASTIC, LANDS, LIPPED, SOLIDS, Seat, Write, draw_seat
from drawn_strikers import BEAMS, PLATES, Striker, course, draw_striker

from seatfem.study.scene.measures import all_measures

SEATS: Final = (
    *("annular", "rod", "conical", "annular", "spring", "stopper", "block", "annular", "greens", "rod", "annular"),
    *("bar", "conical", "annular", "matrices", "stopper", "annular", "cad", "rod", "annular", "frf", "plate"),
    *("annular", "mesh", "spring", "conical", "cantilever", "annular", "stopper"),
)
STRIKERS: Final = (
    *("cantilever", "flapper", "rigid_mass", "clamped_clamped", "sheet", "timoshenko", "cantilever", "ring_plate"),
    *("tip_mass", "ball", "stepped", "flapper", "cantilever", "rod", "disc", "bar"),
)
"""Both by turns, 29 and 16 of them, so that any seat may meet any striker; all else is drawn at random."""
PATCHED: Final = ("annular", "conical", "stopper", "block", "cad", "mesh", "plate")
"""Seats whose patch brings the local compliance that Hertz's law holds, too: these have a spring in its place."""
ON_LIPS: Final = 0.4  # of the plates meet a lip of revolution, whatever seat has its turn
EVERY: Final = 3  # that manieth scene is a plate on lands of a plate, a CAD part or a mesh
STATED: Final = 0.2  # of the scenes state keys that the others leave open
MEASURES: Final[Mapping[str, float]] = {"impulse": 3, "filtered_peak": 3}
"""How often a measure is asked for, beside once."""
LANDINGS: Final = ("hardest", "hardest", "first", "run")
STRENGTH: Final = Path(__file__).parents[1] / "examples" / "strengths" / "invented_strip.toml"
GAS: Final = """[gas]
valve = "suction"
suction = { pressure = "1 bar", temperature = "20 degC" }
discharge = { pressure = "4 bar", temperature = "150 degC" }
bore = "40 mm"
stroke = "30 mm"
rod = "60 mm"
clearance = "2 cm^3"
start_pressure = "4 bar"
other_valve_area = "40 mm^2"
port_diameter = "9 mm"
"""


@dataclass(frozen=True)
class DrawnScene:
    """A scene as it is written.

    Attributes:
        text: of scene.toml.
        seat, reed: their kinds.
        about: what else is in it, in words.
        stated: whether it states keys that the loop would choose.
        files: by name, what writes them.
    """

    text: str
    seat: str
    reed: str
    about: str
    stated: bool
    files: Mapping[str, Write] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        """The scene and its files in a folder."""
        for name, write in self.files.items():
            write(folder / name)
        path = folder / "scene.toml"
        path.write_text(self.text, encoding="utf-8")
        return path


def draw_scene(index: int, seed: int) -> DrawnScene:
    """Scene number ``index`` of a seed."""
    rng = np.random.default_rng([seed, index])
    turn, on_lands = divmod(index + seed, EVERY)
    if on_lands == 0:
        stated, seat = bool(rng.random() < STATED), LANDS[turn % len(LANDS)](rng)
        plates = [kind for kind in PLATES if seat.is_ring or kind != "ring_plate"]
        strikes = plates[turn % len(plates)]
    else:
        kind, strikes = SEATS[(index + seed) % len(SEATS)], STRIKERS[(index + seed) % len(STRIKERS)]
        on_a_lip = strikes in PLATES and rng.random() < ON_LIPS
        stated = bool(rng.random() < STATED)
        seat = draw_seat(LIPPED if on_a_lip else kind, rng, stated=stated)
    striker = draw_striker(strikes, seat, rng, stated=stated)
    extras = dict(_extras(seat, striker, rng))
    files = {**seat.files, **striker.files, **_files(extras, striker, rng)}
    contact = f"[contact]\n{_contact(seat, striker, extras, rng, stated)}"
    tables = "".join(text for name, text in extras.items() if name != "tilted")
    turns = "cycles" in extras.get("gas", "")
    duration = "" if turns else f'duration = "{striker.duration:.6f} ms"\n'
    run = f'[run]\n{duration}filter_width = "{rng.uniform(2, 10):.4f} us"\n'
    asked = _accuracy(seat, striker, rng)
    about = ", ".join([striker.way, *extras, *(["in arcs"] if striker.in_arcs or "tilted" in extras else [])])
    text = seat.table + striker.table + contact + tables + run + asked
    return DrawnScene(text, seat.kind, striker.kind, about, seat.stated or striker.stated, files)


def _contact(seat: Seat, striker: Striker, extras: Mapping[str, str], rng: np.random.Generator, stated: bool) -> str:
    """Lines of [contact]: gap, law, place, and how it is open along a lip."""
    stiffness = 10 ** rng.uniform(6.5, 8.5)
    laws = (
        "",
        f'law = {{ kind = "spring", stiffness = "{stiffness:.4g} N/m" }}\n',
        f'law = {{ kind = "hertz", stiffness = "{1e3 * stiffness:.4g} N/m^1.5" }}\n',
        f'law = {{ kind = "hunt_crossley", stiffness = "{1e3 * stiffness:.4g} N/m^1.5", damping = "0.1 s/m" }}\n',
    )
    preload = striker.preload or "gas" in extras  # which laws of other powers have not
    law = str(rng.choice(laws, p=[0.7, 0.3, 0.0, 0.0] if preload else [0.55, 0.15, 0.15, 0.15]))
    if law in laws[2:] and (seat.kind in PATCHED or striker.kind == "ball"):
        law = laws[1]
    lines = [f'gap = "{striker.gap:.6f} mm"\n', law]
    if "tilted" in extras:
        lines.append(extras["tilted"])
    if "film" in extras:
        width, length = (seat.width, 2 * np.pi * seat.radius) if seat.radius else (1.0, 15.0)
        size = "" if seat.kind == LIPPED else f'width = "{width:.4f} mm"\nlength = "{length:.4f} mm"\n'
        inline = ", ".join(['viscosity = "18 uPa s"', f'floor = "{rng.uniform(0.3, 2):.3f} um"', *size.splitlines()])
        lines.append(f"film = {{ {inline} }}\n")
    if preload:
        lines.append("preload = true\n")
    if stated and seat.radius and not striker.in_arcs and "film" not in extras and rng.random() < 0.5:
        lines.append(f"rings = {rng.integers(2, 5)}\n")
    return "".join(lines)


def _extras(seat: Seat, striker: Striker, rng: np.random.Generator) -> Iterator[tuple[str, str]]:
    """Further tables, by what they are called in words."""
    beam, plate = striker.kind in BEAMS, striker.kind in PLATES
    if seat.radius and plate and striker.in_arcs and rng.random() < 0.75:
        tilt, axis = 10 ** rng.uniform(-2, -0.3), rng.uniform(0, 360)
        lines = f'tilt = "{tilt:.5f} deg"\ntilt_axis = "{axis:.3f} deg"\n'
        if rng.random() < 0.25:
            lines += f'offset = ["{rng.uniform(-0.2, 0.2):.4f} mm", "{rng.uniform(-0.2, 0.2):.4f} mm"]\n'
        if seat.is_ring and rng.random() < 0.25:
            rows = ", ".join(f'["{90 * k} deg", "{height:.3f} um"]' for k, height in enumerate(rng.uniform(0, 5, 4)))
            lines += f"waviness = [{rows}]\n"
        yield "tilted", lines
    if rng.random() < 0.08:
        yield "film", ""
    if beam and striker.kind == "cantilever" and striker.way in ("pushed", "loaded") and rng.random() < 0.6:
        yield "gas", f'{GAS}rpm = {rng.integers(2500, 6000)}\nangle = "0 deg"\ncycles = {rng.uniform(0.2, 0.35):.4f}\n'
    if rng.random() < 0.1 and striker.kind not in ("rod", "ball", "bar"):
        load = f'pressure = "-{rng.uniform(0.02, 0.2):.4f} bar"\narea = [["0 mm", "40 mm^2"], ["1 mm", "30 mm^2"]]\n'
        weight = "" if striker.kind in ("ring_plate", "disc") else '[[load]]\ngravity = "-9.81 m/s^2"\n'
        yield "loads", f"[[load]]\n{load}{weight}"
    if beam and striker.above and rng.random() < 0.35:
        yield "stopper", _stopper(striker, rng)
    if beam and rng.random() < 0.1:
        yield "base", f'[[base]]\nof = "{rng.choice(["reed", "seat"])}"\ndisplacement = "base.csv"\n'
    if striker.kind in ("cantilever", "flapper", "sheet") and rng.random() < 0.12:
        yield "life", f'[life]\nstrength = "{STRENGTH}"\nhours = 10000\nrpm = 3000\n'
    dear = seat.kind in SOLIDS or striker.in_arcs
    if seat.kind in ELASTIC and rng.random() < (0.05 if dear else 0.25):
        yield "seat stress", '[stress]\ndistance = "0.3 mm"\nstruck = false\n'


def _stopper(striker: Striker, rng: np.random.Generator) -> str:
    """Met on the way back, or on a way beyond the start."""
    gap = striker.above * rng.uniform(1.001, 1.05)
    kind = rng.choice(["spring", "rod", "stopper"], p=[0.5, 0.3, 0.2])
    bodies = {
        "spring": f'stiffness = "{10 ** rng.uniform(5.5, 7.5):.5g} N/m"\n',
        "rod": 'young = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "10 mm"\narea = "3 mm^2"\ndamping_ratio = 0.05\n',
        "stopper": 'radius = "5 mm"\nthickness = "5 mm"\ncontact_radius = "1.5 mm"\nmaterial = "steel"\n'
        'damping_ratio = 0.03\ngreens = { bandwidth = "300 kHz" }\n',
    }
    return f'[stopper]\nkind = "{kind}"\ngap = "{gap:.6f} mm"\n{bodies[kind]}'


def _files(extras: Mapping[str, str], striker: Striker, rng: np.random.Generator) -> Mapping[str, Write]:
    """What the further tables name: a base that moves by microns, smoothly."""
    if "base" not in extras:
        return {}
    time, rise = np.linspace(0, 1.01 * striker.duration, 40), rng.uniform(1, 5)
    rows = [(float(t), float(rise * np.sin(np.pi * t / striker.duration) ** 2)) for t in time]
    return {"base.csv": course("time [ms],displacement [um]", rows)}


def _accuracy(seat: Seat, striker: Striker, rng: np.random.Generator) -> str:
    """Target, measures and landing, as far as a scene may state it."""
    known = all_measures()
    lip = bool(seat.radius) and striker.in_arcs
    names = [
        name
        for name, each in known.items()
        if not each.judged_by
        and not each.of_some
        and ("stress" not in each.data or striker.kind == "cantilever")
        and ("line" not in each.data or lip)
        and name != "gauge_strain"  # no scene here has a gauge
    ]
    weights = np.array([MEASURES.get(name, 1.0) for name in names])
    asked = sorted(rng.choice(names, size=rng.integers(1, 4), replace=False, p=weights / weights.sum()))
    target = rng.uniform(0.03 if striker.kind in PLATES else 0.01, 0.1)
    landing = rng.choice(LANDINGS)
    states = f'landing = "{landing}"\n'
    return f"[accuracy]\ntarget = {target:.5f}\nmeasures = {json.dumps(asked)}\n{states}"
