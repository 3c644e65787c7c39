"""Plates to their ends: discs, rings, strips and flappers that strike a soft spring as rigid bodies would."""

import math
from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import jv

from tests.extremes.cell import Cell, Finding, swept
from tests.extremes.scene_run import Known, SceneRun, judge, run_tables, run_text, same
from tests.extremes.scene_text import Table, material, run_table, scene_text, si

YOUNG, DENSITY, POISSON = 2e11, 8000.0, 0.3
SLOW = 25.0  # times the period of the first mode that the blow feels: it changes a blow by 1/SLOW^2
RIGID = 5e-3  # of a blow on a soft spring: the plate's own compliance, and a step that holds the force of its end


def plate_cells() -> tuple[Cell, ...]:
    """Return cells of thickness, modulus, Poisson's ratio, size, hole and slenderness of plates."""
    return (
        *swept(
            "disc, thickness / diameter", [1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2, 0.4], lambda x: disc(thickness=x)
        ),
        *swept("disc, Young's modulus, Pa", [10.0**k for k in (4, 6, 8, 10, 12, 14)], lambda x: disc(young=x)),
        *swept("disc, Poisson's ratio", [0.0, 0.01, 0.1, 0.3, 0.45, 0.49, 0.4999], lambda x: disc(poisson=x)),
        *swept("disc, diameter, m", [10.0**k for k in (-7, -6, -5, -4, -3, -1, 0, 1, 2)], lambda x: disc(diameter=x)),
        *swept("disc, speed, m/s", [10.0**k for k in (-9, -6, -3, -1, 1, 2, 3)], lambda x: disc(speed=x)),
        *swept("ring plate, hole / diameter", [1e-3, 0.01, 0.1, 0.3, 0.6, 0.9, 0.95, 0.97, 0.99], ring),
        *swept("disc that rings, band / 900 kHz", [1 / 20, 1 / 15, 1 / 9, 0.2, 0.4], ringing_disc),
        *swept("sheet, length / width", [0.3, 1.0, 3.0, 10.0, 30.0, 100.0], sheet),
        *swept("flapper, size / 25 mm", [10.0**k for k in (-4, -3, -2, -1, 1, 2, 3)], flapper),
        *swept("flapper, band / 50 kHz", [1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 2.0], lambda b: flapper(1.0, b)),
    )


def disc(
    *,
    thickness: float = 0.05,
    young: float = YOUNG,
    poisson: float = POISSON,
    diameter: float = 0.01,
    speed: float = 0.5,
) -> Finding:
    """A free disc on a soft spring has m v and a rigid body's swing; its ringing is Mindlin's, in closed form.

    ``thickness`` is over the diameter. Both ends of an element have curved sides: frequencies are known to 1 %.
    """
    mass = DENSITY * math.pi / 4 * diameter**3 * thickness
    rings = breathing(thickness * diameter, diameter / 2, young, poisson)
    reed: Table = {
        "kind": "disc", "diameter": si(diameter, "m"), "thickness": si(thickness * diameter, "m"),
        "material": material(young, DENSITY, poisson), "velocity": si(-speed, "m/s"),
        "greens": {"bandwidth": si(2 * rings / (2 * math.pi), "Hz")},
    }  # fmt: skip
    run = run_text(bounced(reed, mass, rings / SLOW))
    listed = [float(f) for f in run.summary["reed_frequencies_Hz"]]  # type: ignore[attr-defined]
    nearest = min(listed, key=lambda f: abs(f - rings / (2 * math.pi)))
    ringing = Known("reed_frequencies_Hz", rings / (2 * math.pi), 1e-2, value=nearest)
    return judge(run, *swing(mass, speed, rings / SLOW), ringing)


def ring(hole: float) -> Finding:
    """A free ring, struck around its middle, swings as a rigid body of its mass."""
    outer, thickness, speed = 0.02, min(1.5e-3, 0.02 * (1 - hole) / 8), 0.5
    mass = DENSITY * math.pi / 4 * outer**2 * (1 - hole**2) * thickness
    reed: Table = {
        "kind": "ring_plate", "outer_diameter": si(outer, "m"), "inner_diameter": si(hole * outer, "m"),
        "thickness": si(thickness, "m"), "material": material(YOUNG, DENSITY, POISSON), "velocity": si(-speed, "m/s"),
    }  # fmt: skip
    slow = breathing(1.5e-3, outer / 2, YOUNG, POISSON) / 2 / SLOW
    return judge(run_text(bounced(reed, mass, slow)), *swing(mass, speed, slow))


def ringing_disc(band: float) -> Finding:
    """A disc on a spring a hundred times stiffer than it, which feels a few of its modes: the same with a wide band.

    What a narrow ``band`` leaves out, up to a fifth of the peak, only the error bar tells: the file states the band.
    """
    run, exact = _ringing_disc(band), _ringing_disc(1.0)
    return judge(
        run,
        *same(run, exact, "landing_impulse_Ns"),
        *same(run, exact, "landing_filtered_peak_force_N"),
        *same(run, exact, "landing_duration_s"),
    )


@cache
def _ringing_disc(band: float) -> SceneRun:
    reed: Table = {
        "kind": "disc", "diameter": "10 mm", "thickness": "0.5 mm", "material": material(YOUNG, DENSITY, POISSON),
        "damping_ratio": 0.02, "velocity": "-0.5 m/s", "greens": {"bandwidth": si(9e5 * band, "Hz")},
    }  # fmt: skip
    seat: Table = {"kind": "spring", "stiffness": "5e8 N/m"}
    return run_tables(seat=seat, reed=reed, run=run_table(6e-5, 1e-6), accuracy={"target": "5 %"})


def bounced(reed: Table, mass: float, omega: float, target: str = "1 %", **tables: Table) -> str:
    """Return the scene of a free body that swings back from a spring of ``mass omega^2``; 1.3 half swings."""
    half = math.pi / omega
    seat: Table = {"kind": "spring", "stiffness": si(mass * omega**2, "N/m")}
    return scene_text(seat=seat, reed=reed, run=run_table(1.3 * half, half / 50), accuracy={"target": target}, **tables)


def swing(mass: float, speed: float, omega: float) -> Iterator[Known]:
    """Yield what a rigid body leaves: impulse 2 m v, half a swing, largest mean force over 1/50 of it."""
    yield Known("landing_impulse_Ns", 2 * mass * speed, RIGID)
    yield Known("landing_duration_s", math.pi / omega, RIGID)
    yield Known("landing_filtered_peak_force_N", mass * speed * omega, RIGID)
    yield Known("energy_residual", 0.0, 1e-9)


def breathing(thickness: float, radius: float, young: float, poisson: float) -> float:
    """Return the lowest axisymmetric frequency of a free disc by Mindlin's theory [rad/s].

    w = J0(d r), a = C J1(d r) solves both equations for two d; M and Q vanish at the rim: a determinant of two by two.
    """
    shear = 5 / 6 * young / (2 * (1 + poisson)) * thickness
    bending = young * thickness**3 / (12 * (1 - poisson**2))
    area, turning = DENSITY * thickness, DENSITY * thickness**3 / 12
    thin = 9.003 / radius**2 * math.sqrt(bending / area)  # of Kirchhoff, at 0.3; at most 4 % less at others

    def determinant(omega: float) -> float:
        p = area * omega**2 / shear  # d^4 bending - d^2 (turning w^2 + bending p) + p (turning w^2 - shear) = 0
        roots = np.roots([bending, -(turning * omega**2 + bending * p), p * (turning * omega**2 - shear)])
        rows = []
        for d in np.sqrt(roots.astype(complex)):
            c, x = d - p / d, d * radius
            rows.append((c * (d * jv(0, x) - (1 - poisson) * jv(1, x) / radius), (c - d) * jv(1, x)))
        (a, b), (e, f) = rows
        return float((a * f - b * e).real)

    tries = thin * np.linspace(0.02, 1.1, 400)
    signs = np.sign([determinant(w) for w in tries])
    first = int(np.flatnonzero(signs[1:] != signs[:-1])[0])
    return float(brentq(determinant, tries[first], tries[first + 1]))


def sheet(slenderness: float) -> Finding:
    """A clamped strip of Poisson's ratio 0 is a beam: its lowest frequency, and the stress of its release.

    Bent statically by d at 0.9 l: w = F x^2 (3 l' - x)/(6 E I) up to its contact l': at the root 3 E h d/(2 l'^2).
    """
    length, thickness, bent = 0.02, 2e-4, 1e-4
    width, arm = length / slenderness, 0.9 * length
    corners = [(0.0, -width / 2), (length, -width / 2), (length, width / 2), (0.0, width / 2)]
    outline = [[si(x, "m"), si(y, "m")] for x, y in corners]
    reed: Table = {
        "kind": "sheet", "outline": outline, "clamped": [outline[0], outline[3]], "contact_at": [si(arm, "m"), "0 m"],
        "thickness": si(thickness, "m"), "material": material(YOUNG, DENSITY, 0.0),
        "release": {"deflection": si(bent, "m")}, "greens": {"bandwidth": "20 kHz"},
    }  # fmt: skip
    first = 1.8751040687**2 / length**2 * thickness * math.sqrt(YOUNG / 12 / DENSITY) / (2 * math.pi)
    run = run_tables(
        seat={"kind": "spring", "stiffness": "1e5 N/m"},
        reed=reed,
        run=run_table(0.4 / first, 1e-5),
        accuracy={"target": "5 %"},
    )
    listed = float(run.summary["reed_frequencies_Hz"][0])  # type: ignore[index]
    return judge(run, Known("reed_frequencies_Hz", first, 1e-2, value=listed), Known("energy_residual", 0.0, 1e-9))


def flapper(scale: float, band: float = 1.0) -> Finding:
    """A flapper and its seat scale: times go like the length, impulses like its cube, forces like its square.

    A ``band`` over 50 kHz changes what modes are in it, which the error bars must know.
    """
    run, exact = _flapper(scale, band), _flapper(1.0)
    return judge(
        run,
        *same(run, exact, "landing_impulse_Ns", factor=scale**3),
        *same(run, exact, "landing_filtered_peak_force_N", factor=scale**2),
        *same(run, exact, "landing_duration_s", factor=scale),
    )


@cache
def _flapper(scale: float, band: float = 1.0) -> SceneRun:
    sizes = {"root_width": 10, "taper_length": 2, "neck_width": 8, "neck_length": 15}
    sizes |= {"paddle_diameter": 12, "thickness": 0.5}
    reed = {
        "kind": "flapper", **{key: si(scale * 1e-3 * value, "m") for key, value in sizes.items()},
        "material": material(YOUNG, DENSITY, POISSON), "damping_ratio": 0.02, "release": {"velocity": "-1 m/s"},
        "greens": {"bandwidth": si(5e4 * band / scale, "Hz")},
    }  # fmt: skip
    return run_tables(
        seat={"kind": "spring", "stiffness": si(1e6 * scale, "N/m")},
        reed=reed,
        run=run_table(3e-4 * scale, 1e-5 * scale),
        accuracy={"target": "5 %"},
    )
