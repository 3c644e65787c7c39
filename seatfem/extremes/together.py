"""All the axes of a contact at once: a pairwise covering array, judged by what every run must satisfy.

No closed form knows these runs. Each is checked against its own equations, evaluated another way, and the laws of
mechanics:

    motion   gap = free motion + sum over steps of N (S(t - t_start) - S(t - t_end)) by the step responses' closed
             forms, term by term, where the march uses recursions, FFT or weights;
    law      N > 0 only where the law's penetration is, to round-off of the gap; N = 0 where it is open;
    energy   input = stored + dissipated, and the contacts never give energy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
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
    oscillator,
    solve,
)
from impact.engines import Engine
from impact.greens import Array
from impact.laws import Law
from seatfem.extremes import scenes
from seatfem.extremes.cell import Cell, Finding
from seatfem.extremes.pairwise import covering_array

EPS = float(np.finfo(float).eps)
SEEDS = (1, 2, 3)

LEVELS: dict[str, tuple[float | str, ...]] = {
    "step": (1e-7, 1e-4, 1e-2, 1.0, 1e2),
    "steps": (3, 300, 5000),
    "speed": (1e-9, 1.0, 1e3),
    "stiffness": (0.0, 1e-8, 1.0, 1e8),
    "mass": (1e-8, 1e-3, 1.0, 1e8),
    "damping": (0.0, 1e-9, 0.1, 1.0, 10.0),
    "modes": (1, 3, 100, 3000),
    "spacing": ("harmonic", "pairs 1e-14 apart", "coincident"),
    "residual": ("none", "relaxation", "spring", "dominant spring"),
    "gap": ("closed", "open", "grazing", "pressed in"),
    "law": ("rigid", "soft spring", "stiff spring", "Hertz", "Hunt-Crossley"),
    "rule": ("passive", "conserving"),
    "ports": ("one", "two", "twins"),
    "engine": get_args(Engine),
    "unit": (1.0, 2.0**120, 2.0**-120),
    "push": (0.0, 1.0),
}


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
        """All values, in order."""
        return ", ".join(f"{f.name} {_text(getattr(self, f.name))}" for f in fields(self))


def together_cells(seeds: Sequence[int] = SEEDS) -> tuple[Cell, ...]:
    """One covering array per seed: in each, every pair of levels of any two axes occurs."""
    counts = [len(levels) for levels in LEVELS.values()]
    rows = [row for seed in seeds for row in covering_array(counts, seed=seed)]
    found = [Scene(**{k: v[i] for (k, v), i in zip(LEVELS.items(), row, strict=True)}) for row in rows]  # type: ignore[arg-type]
    return tuple(Cell("pairwise", f"{n:03d}: {scene.text}", scene) for n, scene in enumerate(found))


def checked(scene: Scene) -> Finding:
    """The largest of the three deviations, each over what round-off may make of it."""
    problem = problem_of(scene)
    dt = scene.step
    result = solve(problem, dt=dt, duration=dt * scene.steps, rule=scene.rule, engine=scene.engine)
    for name in ("force", "gap", "striker_displacement", "target_displacement"):
        if not np.all(np.isfinite(getattr(result, name))):
            return Finding(math.nan, 1.0, (), f"{name} is not finite")
    force, gap = (np.reshape(a, (len(result.time), -1)) for a in (result.force, result.gap))
    expected, scale = replayed(scene, problem, force, dt)
    rounding = EPS * (1e4 + 64 * scene.steps + 4 * _phase(problem) * dt * scene.steps)
    motion = float(np.max(np.abs(gap[-len(expected) :] - expected) / (scale * rounding)))
    law = _law_deviation(problem, force, gap, float(scale.max()) * rounding) if scene.rule == "passive" else 0.0
    advice = scenes.said(result)
    gains = any(text.startswith("overlap") for text in advice)  # told with the answer
    energy = 0.0 if gains else _energy_deviation(result, scene, _shaken(problem, gap) * float(scale.max()) * 64 * EPS)
    worst = max(("motion", motion), ("law", law), ("energy", energy), key=lambda pair: pair[1])
    advice = advice if worst[1] <= 1 else ()  # advice excuses no equation that is not met
    return Finding(worst[1], 1.0, advice, f"{worst[0]}, over its round-off")


def problem_of(scene: Scene) -> ContactProblem:
    """The contact problem of a scene."""
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


def replayed(scene: Scene, problem: ContactProblem, force: Array, dt: float) -> tuple[Array, Array]:
    """Gaps at the last 40 times (k, p) by closed forms, and the sizes of the terms they are the sum of."""
    n, p = len(force) - 1, force.shape[1]
    t = np.asarray(dt * np.arange(n + 1), dtype=np.float64)
    last = np.arange(max(n + 1 - 40, 1), n + 1)
    out = np.tile([c.gap for c in problem.contacts], (len(last), 1))
    size = np.abs(out)
    free, free_size = _free(scene, problem, t[last])
    out, size = out + free, size + free_size
    for i in range(p):
        for j in range(p):
            rise = problem.striker.greens.step_response(t, i, j) + problem.target.greens.step_response(t, i, j)
            rise[0] = 0.0  # before the force: a bare compliance answers at once
            steps = np.diff(rise)
            for row, k in enumerate(last):
                terms = steps[k - 1 :: -1][:k] * force[1 : k + 1, j]
                out[row, i] += math.fsum(terms)
                size[row, i] += np.abs(terms).sum() + np.abs(rise[: k + 1]).max() * np.abs(force[1 : k + 1, j]).max()
    return out, np.maximum(size, np.finfo(float).tiny * 1e30)


def _free(scene: Scene, problem: ContactProblem, t: Array) -> tuple[Array, Array]:
    """Striker without contact, (k, p): v h(t) + F S(t) of its one mode, by closed forms."""
    g = problem.striker.greens
    assert isinstance(g, ModalGreens)
    swing = oscillator.impulse_response(t, g.omega[0], g.zeta[0]) * (-scene.speed * scene.unit)
    pressed = -_push(scene) * g.step_response(t)
    moved = (swing + pressed)[:, None]
    size = (np.abs(swing) + np.abs(pressed) + EPS * scene.speed * scene.unit * t)[:, None]
    ones = np.ones((1, len(problem.contacts)))
    return moved * ones, np.maximum.accumulate(size) * ones


def _phase(problem: ContactProblem) -> float:
    """Highest frequency of both bodies [rad/s]: over a time t its phase is known to eps w t."""
    found = [float(b.greens.omega.max()) for b in problem.bodies if isinstance(b.greens, ModalGreens)]
    return max(found)


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
    left = 0.2 / n
    residual = {
        "none": Residual.none(p),
        "relaxation": Residual.exponential(left * np.eye(p) / scene.unit, np.eye(p) / scene.unit),
        "spring": Residual.spring(left * np.eye(p) / scene.unit),
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
    assert isinstance(g, ModalGreens)
    wide = ModalGreens(g.omega, g.zeta, g.shapes * np.ones((1, p)), Residual.none(p), tuple(str(i) for i in range(p)))
    return Body(wide, state=one.state, loads=one.loads)


def _push(scene: Scene) -> float:
    """A force that would stop the striker within some transits, or hold a seat of unit stiffness down."""
    return scene.push * scene.unit**2 * scene.speed * min(1.0, scene.mass)


def _law_deviation(problem: ContactProblem, force: Array, gap: Array, limit: float) -> float:
    """How far the gap is from where the law's force belongs, over ``limit``."""
    worst = max(0.0, -float(force.min()) / max(float(force.max()), 1e-300) / EPS)
    for c, contact in enumerate(problem.contacts):
        n, pen = force[1:, c], -gap[1:, c]
        needed = _penetration(contact.law, n)
        if needed is None:
            continue
        pressed = n > 0
        worst = max(worst, float(np.max(np.abs(pen - needed)[pressed], initial=0.0)) / limit)
        worst = max(worst, float(np.max(pen[~pressed], initial=0.0)) / limit)
    return worst


def _penetration(law: Law, force: Array) -> Array | None:
    """The penetration that belongs to a force, where a law has one."""
    if isinstance(law, Signorini):
        return np.zeros_like(force)
    if isinstance(law, LinearSpring):
        return force / law.stiffness
    if isinstance(law, Hertz):
        return (force / law.stiffness) ** (2 / 3)
    return None


def _shaken(problem: ContactProblem, gap: Array) -> float:
    """Sum over the steps of the law's own force [N]: times the round-off of a gap it is the energy that this costs."""
    total = 0.0
    for c, contact in enumerate(problem.contacts):
        pen = np.maximum(-gap[:, c], 0.0)
        if isinstance(contact.law, LinearSpring):
            total += float(np.sum(contact.law.stiffness * pen))
        elif isinstance(contact.law, Hertz):
            total += float(np.sum(contact.law.stiffness * pen**1.5))
    return total


def _energy_deviation(result: ImpactResult, scene: Scene, shaken: float) -> float:
    """Energy given by the contacts, or not accounted for, over n eps of the largest term and the gap's round-off."""
    e = result.energy
    largest = max(float(np.max(np.abs(e.striker) + np.abs(e.target) + np.abs(e.contact) + np.abs(e.input))), 1e-300)
    lost = e.contact_loss
    given = float(np.max(np.maximum.accumulate(lost) - lost))
    missing = float(np.max(np.abs(e.input - e.stored - e.dissipated)))
    return max(given, missing) / (largest * EPS * (1e4 + 64 * scene.steps) + shaken)


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}"
