"""All the axes of a contact at once: a pairwise covering array, judged by what every run must satisfy.

No closed form knows these runs. Each is checked against its own equations, evaluated another way, and the laws of
mechanics:

    motion   gap = free motion + sum over steps of N (S(t - t_start) - S(t - t_end)) by the step responses' closed
             forms, term by term, where the march uses recursions, FFT or weights;
    law      N > 0 only where the law's penetration is, to round-off of the gap; N = 0 where it is open;
    energy   input = stored + dissipated, and the contacts never give energy.
"""

import math
from dataclasses import dataclass, fields
from functools import cache
from typing import get_args

import numpy as np

from impact import (
    Body,
    Contact,
    ContactProblem,
    Hertz,
    HuntCrossley,
    ImpactResult,
    LinearSpring,
    ModalGreens,
    Residual,
    Signorini,
    solve,
)
from impact.march.history import Engine
from impact.march.laws import Law
from tests.extremes import balances, scenes
from tests.extremes.cell import Cell, Finding
from tests.extremes.pairwise import covering_array

EPS = float(np.finfo(float).eps)
SEEDS = (1, 2, 3)

LEVELS: dict[str, tuple[float | str, ...]] = {
    "step": (1e-7, 1e-4, 1e-2, 1.0, 1e2), "steps": (3, 300, 5000), "speed": (1e-9, 1.0, 1e3),
    "stiffness": (0.0, 1e-8, 1.0, 1e8), "mass": (1e-8, 1e-3, 1.0, 1e8), "damping": (0.0, 1e-9, 0.1, 1.0, 10.0),
    "modes": (1, 3, 100, 3000), "spacing": ("harmonic", "pairs 1e-14 apart", "coincident"),
    "residual": ("none", "relaxation", "spring", "dominant spring"), "gap": ("closed", "open", "grazing", "pressed in"),
    "law": ("rigid", "soft spring", "stiff spring", "Hertz", "Hunt-Crossley"),
    "rule": ("passive", "conserving", "auto"), "ports": ("one", "two", "twins"), "engine": get_args(Engine),
    "unit": (1.0, 2.0**120, 2.0**-120), "push": (0.0, 1.0),
}  # fmt: skip
REFUSED = (  # these are refused, whatever the rest: a row with them would test nothing else
    ("law", "rigid", "rule", "conserving"),
    ("residual", "none", "law", "rigid"),
)


@dataclass(frozen=True)
class Scene:
    """A point of the array; a rod-like seat of unit stiffness, mass and transit, in units of ``unit``.

    Attributes:
        step, steps: time step / transit and their number.
        speed: of approach, in transits' unit.
        stiffness, mass: of the striker, over the seat's; stiffness 0 is a free body.
        damping: of all modes of both bodies.
        modes, spacing, residual: of the seat.
        gap, law, rule, ports, engine: of the contact.
        unit: of mass and length.
        push: steady force towards the seat.
    """

    step: float
    steps: float
    speed: float
    stiffness: float
    mass: float
    damping: float
    modes: float
    spacing: str
    residual: str
    gap: str
    law: str
    rule: str
    ports: str
    engine: Engine
    unit: float
    push: float

    def __call__(self) -> Finding:
        """Run it and check it."""
        return checked(self)

    @property
    def text(self) -> str:
        """Return all values, in order."""
        return ", ".join(f"{f.name} {_text(getattr(self, f.name))}" for f in fields(self))


@cache
def together_cells(seeds: tuple[int, ...] = SEEDS) -> tuple[Cell, ...]:
    """Return a covering array per seed, with all pairs of levels of any two axes but for the `REFUSED`."""
    counts = [len(levels) for levels in LEVELS.values()]
    axes = list(LEVELS)
    excluded = {(axes.index(a), LEVELS[a].index(i), axes.index(b), LEVELS[b].index(j)) for a, i, b, j in REFUSED}
    rows = [row for seed in seeds for row in covering_array(counts, seed=seed, excluded=excluded)]
    drawn = [Scene(**{k: v[i] for (k, v), i in zip(LEVELS.items(), row, strict=True)}) for row in rows]  # type: ignore[arg-type]
    return tuple(Cell("pairwise", f"{n:03d}: {scene.text}", scene) for n, scene in enumerate(drawn))


def checked(scene: Scene) -> Finding:
    """Return the largest deviation, each over what round-off may make of it.

    Where a run has no advice, and is short, the step must not matter: a quarter of it changes the impulse by 10 % at
    most.
    """
    problem, dt = problem_of(scene), scene.step
    result = _solved(scene, problem, dt)
    for name in ("force", "gap", "striker_displacement", "target_displacement"):
        if not np.all(np.isfinite(getattr(result, name))):
            return Finding(math.nan, 1.0, (), f"{name} is not finite")
    force, gap = (np.reshape(a, (len(result.time), -1)) for a in (result.force, result.gap))
    expected, scale = balances.replayed(problem, force, dt)
    phase = balances.highest_frequency(problem) * dt * scene.steps
    rounding = EPS * (1e4 + 64 * scene.steps + 4 * phase)
    advice = scenes.said(result)
    shaken = balances.shaken_energy(problem, force, gap) * float(scale.max()) * 64 * EPS
    deviations = {"motion": float(np.max(np.abs(gap[-len(expected) :] - expected) / (scale * rounding)))}
    if scene.rule == "passive":
        deviations["law"] = balances.law_deviation(problem, force, gap, float(scale.max()) * rounding)
    if not any(text.startswith("overlap") for text in advice):  # energy given, and told with the answer
        deviations["energy"] = balances.energy_deviation(result, shaken)
    if not advice and scene.steps <= 300 and scene.modes <= 100:
        finer = _solved(scene, problem, dt / 4)
        impulses = [float(np.sum(r.force)) * r.dt for r in (result, finer)]
        deviations["step"] = abs(impulses[0] - impulses[1]) / max(*impulses, np.finfo(float).tiny) / 0.1
    worst = max(deviations, key=lambda name: deviations[name])
    advice = advice if deviations[worst] <= 1 else ()  # advice excuses no equation that is not met
    return Finding(deviations[worst], 1.0, advice, f"{worst}, over what it may be")


def _solved(scene: Scene, problem: ContactProblem, dt: float) -> ImpactResult:
    return solve(problem, dt=dt, duration=scene.step * scene.steps, rule=scene.rule, engine=scene.engine)


def problem_of(scene: Scene) -> ContactProblem:
    """Return the contact problem of a scene."""
    m, length = scene.unit, scene.unit
    seat, striker = Body(_seat(scene)), _striker(scene)
    way = {"closed": 0.0, "open": 0.3 * scene.step * scene.steps, "grazing": 1e-13, "pressed in": -1e-3 * scene.step}
    gap = way[scene.gap] * scene.speed * length
    count = 1 if scene.ports == "one" else 2
    # forces are m length: the laws' stiffness k [m], Hertz [m/sqrt(length)]
    laws: dict[str, Law] = {
        "rigid": Signorini(),
        "soft spring": LinearSpring(1e-3 * m),
        "stiff spring": LinearSpring(1e8 * m),
        "Hertz": Hertz(1e3 * m / math.sqrt(length * scene.speed)),
        "Hunt-Crossley": HuntCrossley(1e3 * m / math.sqrt(length * scene.speed), 0.5 / (length * scene.speed)),
    }
    return ContactProblem(striker, contacts=[Contact(seat, k, gap, laws[scene.law], 1, k) for k in range(count)])


def _seat(scene: Scene) -> ModalGreens:
    n = int(scene.modes)
    k = np.arange(n)
    if scene.spacing != "harmonic":
        k = k - k % 2
    omega = np.asarray((k + 0.5) * np.pi, dtype=np.float64)
    if scene.spacing == "pairs 1e-14 apart":
        omega *= 1 + 1e-14 * (np.arange(n) % 2)
    p = 1 if scene.ports == "one" else 2
    shapes = np.full((n, p), math.sqrt(2.0))
    if scene.ports == "two":
        shapes[:, 1] *= np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    if scene.ports == "twins":
        shapes[:, 1] *= 1 + 1e-14
    rest = 0.2 / n
    residual = {
        "none": Residual.none(p),
        "relaxation": Residual.exponential(rest * np.eye(p) / scene.unit, np.eye(p) / scene.unit),
        "spring": Residual.spring(rest * np.eye(p) / scene.unit),
        "dominant spring": Residual.spring(1e6 * np.eye(p) / scene.unit),
    }[scene.residual]
    names = tuple(str(i) for i in range(p))
    return ModalGreens(omega, np.full(n, scene.damping), shapes / math.sqrt(scene.unit), residual, names)


def _striker(scene: Scene) -> Body:
    mass = scene.mass * scene.unit
    omega = math.sqrt(scene.stiffness / scene.mass)
    one = scenes.oscillator(omega, mass, zeta=scene.damping, v=-scene.speed * scene.unit, push=-_push(scene))
    p = 1 if scene.ports == "one" else 2
    g = one.greens
    wide = ModalGreens(g.omega, g.zeta, g.shapes * np.ones((1, p)), Residual.none(p), tuple(str(i) for i in range(p)))
    return Body(wide, state=one.state, loads=one.loads)


def _push(scene: Scene) -> float:
    """Return a force that would stop the striker within some transits, or hold a seat of unit stiffness down."""
    return scene.push * scene.unit**2 * scene.speed * min(1.0, scene.mass)


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"
