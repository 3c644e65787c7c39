"""Time step, run length and conservation: the march itself."""

import math
from decimal import Decimal, localcontext

import numpy as np

import impact
from impact.march.laws import Hertz, HuntCrossley, Law
from tests.extremes import precise, scenes
from tests.extremes.cell import Cell, Finding, chosen, swept, worst
from tests.extremes.ledger import ledger, stored

EPS = float(np.finfo(float).eps)


def marching_cells() -> tuple[Cell, ...]:
    """Return sweeps of the step and of the number of steps, and the laws of conservation."""
    decades = [10.0**k for k in range(-7, 3)]
    lengths = [10.0**k for k in range(2, 8)]
    return (
        *swept("time step / transit, exact rod", decades, lambda dt: blow_on_rod(impact.Body(scenes.FIXED_ROD), dt)),
        *swept("time step / transit, 40 modes", decades, lambda dt: blow_on_rod(impact.Body(scenes.modal_rod(40)), dt)),
        *swept("run length in contact, steps", lengths, spring_for_ever),
        *swept("run length in contact of a pushed mass, steps", lengths, lambda n: spring_for_ever(n, omega=0.0)),
        *swept("run length in free motion, steps", lengths, swing_for_ever),
        *chosen("energy over 1e6 steps, conserving", lambda name: conservation("conserving", name), tuple(_CONSERVING)),
        *chosen("energy over 1e6 steps, passive", lambda name: conservation("passive", name), tuple(_PASSIVE)),
        *swept("run length of the FFT engine, steps", lengths[:-1], pressed_for_ever),
    )


def blow_on_rod(rod: impact.Body, dt: float) -> Finding:
    """A mass strikes a fixed rod of its own weight by d'Alembert's solution.

    The impulse of the whole blow; below 1e-6 transits, where a blow takes millions of steps, the force exp(-t) of the
    first 1e5. The step's error is below dt/10, and 1 % is all that is granted; the 40 modes' is below 1e-4.
    """
    blow = dt >= 1e-5
    steps = max(round(4 / dt), 8) if blow else 100_000
    result = scenes.run(impact.rigid_mass(mass=1.0, velocity=-1.0), rod, impact.Signorini(), dt, steps)
    modal = isinstance(rod.greens, impact.ModalGreens)
    if blow:
        error = scenes.relative(impact.measures.impulse(result), scenes.FIRST_BLOW)
        return Finding(error, min(dt / 10, 1e-2) + (1e-4 if modal else 1e-9), scenes.said(result), "impulse")
    if isinstance(rod.greens, impact.ModalGreens):
        exact = scenes.clinging_force(rod.greens, 1.0, (steps - 0.5) * dt)
        return Finding(scenes.relative(float(result.force[-1]), exact), 10 * dt + 1e-9, scenes.said(result), "force")
    middle = result.time[1:] - dt / 2
    return Finding(float(np.abs(result.force[1:] * np.exp(middle) - 1).max()), dt, scenes.said(result), "force")


def spring_for_ever(steps: float, omega: float = 1.0) -> Finding:
    """A pushed oscillator (omega = 0: a mass) never leaves its linear spring, at rest but for a small swing.

    Conserving step: a linear map of position and velocity, carried to its n-th power in 50 digits. Round-off moves the
    phase by less than eps a step.
    """
    n, dt, push, speed = int(steps), 0.1, -1.0, 0.3
    striker = scenes.oscillator(omega, v=speed, push=push) if omega else scenes.pushed_mass(1.0, speed, push)
    stepper = _stepper(striker, impact.LinearSpring(1.0), dt, n, "conserving", gap=-1.0)
    stepper.advance(n)
    with localcontext() as context:
        context.prec = precise.DIGITS
        h, w = Decimal(dt), Decimal(omega)
        if omega:
            c, s = precise.cosine_sine(w * h)
            (a, b), (d, e), w0, w1 = (c, s / w), (-w * s, c), (1 - c) / w**2, s / w
        else:
            (a, b), (d, e), w0, w1 = (Decimal(1), h), (Decimal(0), Decimal(1)), h * h / 2, h
        # u, v -> a u + b v + w0 (N + push), the same with d, e, w1; N = (pen + pen_end)/2, pen = 1 - u
        k = 1 / (1 + w0 / 2)
        force = (-(1 + a) / 2 * k, -b / 2 * k)
        rest = (2 - w0 * Decimal(push)) / 2 * k + Decimal(0)
        matrix = ((a + w0 * force[0], b + w0 * force[1]), (d + w1 * force[0], e + w1 * force[1]))
        total = rest + Decimal(push)
        exact, _ = precise.affine_power(matrix, (w0 * total, w1 * total), (Decimal(0), Decimal(speed)), n)
    return Finding(abs(float(stepper.gap[n, 0]) + 1 - exact) / speed, 4 * EPS * n, (), "opening at the end")


def swing_for_ever(steps: float) -> Finding:
    """An undamped mode swings free, over a whole run: against cos(w n h) in 50 digits; stated 4 eps n."""
    n, dt, omega = int(steps), 0.1, 1.7
    stepper = _stepper(scenes.oscillator(omega, x=1.0), impact.Signorini(), dt, n, "passive", gap=2.0)
    stepper.advance(n)
    angle = Decimal(omega) * Decimal(dt) * n
    return Finding(
        abs(float(stepper.gap[n, 0]) - 2.0 - float(precise.cosine_sine(angle)[0])), 4 * EPS * n, (), "opening"
    )


def pressed_for_ever(steps: float) -> Finding:
    """A mass pressed on a dashpot whose memory is summed by FFT over the run follows the step's recursion.

    Equal ends of mass and dashpot make N_n = (v + h F/(2 m))/(1/Z + h/(2 m)), v += h (F - N)/m, which forgets its
    round-off; but the way is h n, known to eps of itself, and w_0 = h: the force is known to some eps n.
    """
    n, dt, push = int(steps), 1e-3, 1.0
    striker = scenes.pushed_mass(1.0, 0.0, -push)
    result = scenes.run(striker, scenes.dashpot(1.0), impact.Signorini(), dt, n, engine="fft")
    exact, v = np.empty(n), 0.0
    for k in range(n):
        exact[k] = (v + dt * push / 2) / (1 + dt / 2)
        v += dt * (push - exact[k])
    return Finding(float(np.abs(result.force[1:] - exact).max()) / push, 16 * EPS * n, scenes.said(result), "force")


def conservation(rule: str, name: str) -> Finding:
    """Energy over 1e6 steps is kept to eps n by the conserving step, never gained beyond it by the passive one.

    Each step's energies are rounded, and the force of contact is found to an eps of the penetration: at worst, all one
    way, eps of the largest energy a step. Judged by the program's own ledger and by one made from the force alone
    (`ledger`), which must see the same gaps.

    A mass that nothing holds is nowhere brought back: the march rounds its speed at every step, which after n steps
    has moved it by about eps v h n^(3/2) from where its forces would have brought it without rounding. Both ledgers
    start from the forces; times the largest force this is energy. The march's own gaps keep it to eps n.
    """
    law, modes, free = (_CONSERVING if rule == "conserving" else _PASSIVE)[name]
    n, dt, omega, push, height = 1_000_000, 0.01, 0.0 if free else 0.3, -0.5, 0.5
    rod = scenes.modal_rod(modes, rest="none" if rule == "conserving" else "exponential")
    striker = scenes.pushed_mass(1.0, -1.0, push) if free else scenes.oscillator(omega, v=-1.0, push=push)
    target = impact.Body(rod) if modes else scenes.rigid_wall()
    result = scenes.run(striker, target, law, dt, n, gap=height, rule=rule)
    own_ledger = ledger(result, law, rod if modes else None, gap=height, omega=omega, velocity=-1.0, push=push)
    energy = result.energy
    largest = float(np.max(np.abs(energy.input)) + np.max(energy.stored))
    swing, rounding = float(np.max(np.abs(result.gap))), EPS * n
    fastest = math.sqrt(1 - 2 * push * height)  # as it first meets the wall
    way = EPS * fastest * dt * n**1.5 if free else 0.0
    moved = rounding + way * float(np.max(result.force)) / largest
    pairs = [
        (float(np.max(np.abs(energy.stored + energy.dissipated - energy.input))) / largest, moved),
        (float(np.max(np.abs(own_ledger.gap - result.gap))) / swing, rounding + way / swing),
    ]
    if rule == "conserving":
        changes = energy.stored - energy.input, own_ledger.energy - own_ledger.energy[0]
        pairs += [(float(np.max(np.abs(change))) / largest, moved) for change in changes]
        if free:
            pairs.append((_own_energy(striker, law, dt, n, push, height), rounding))
        return Finding(*worst(*pairs), note="energy change over the run")
    lost, kept = energy.contact_loss, own_ledger.energy
    gained = np.max(np.maximum.accumulate(lost) - lost), np.max(kept - np.minimum.accumulate(kept))
    pairs += [(float(e) / largest, moved) for e in gained]
    return Finding(*worst(*pairs), note="energy gained or not accounted")


def _own_energy(striker: impact.Body, law: Law, dt: float, n: int, push: float, height: float) -> float:
    """Return the largest change of the energy of a unit mass above a wall, by the gaps of the march, over the first."""
    problem = impact.ContactProblem(striker, scenes.rigid_wall(), gap=height, law=law)
    stepper = impact.ContactStepper(impact.prepare(problem, dt, n * dt, "conserving"))
    stepper.advance(n)
    gap = stepper.gap[:, 0]
    speed = np.diff(gap) / dt - dt / 2 * (stepper.force[:, 0] + push)  # as the step begins
    energy = speed**2 / 2 - push * gap[:-1] + stored(law, np.maximum(-gap[:-1], 0.0))
    return float(np.abs(energy / energy[0] - 1).max())


def _stepper(
    striker: impact.Body, law: impact.LinearSpring | impact.Signorini, dt: float, n: int, rule: str, *, gap: float
) -> impact.ContactStepper:
    wall = scenes.rigid_wall() if isinstance(law, impact.LinearSpring) else scenes.dashpot(1.0)
    problem = impact.ContactProblem(striker, wall, gap=gap, law=law)
    return impact.ContactStepper(impact.prepare(problem, dt, n * dt, rule))


# law, modes of the target, striker free to fly
_CONSERVING: dict[str, tuple[Law, int, bool]] = {
    "spring, wall": (impact.LinearSpring(30.0), 0, False),
    "Hertz, wall": (Hertz(100.0), 0, False),
    "Hertz, 5 modes": (Hertz(100.0), 5, False),
    "spring, 40 modes": (impact.LinearSpring(30.0), 40, False),
    "Hertz, mass": (Hertz(100.0), 0, True),
    "rigid": (impact.Signorini(), 5, False),
    "Hunt-Crossley, no damping": (HuntCrossley(100.0), 5, False),
}
_PASSIVE: dict[str, tuple[Law, int, bool]] = {
    "rigid, 5 modes": (impact.Signorini(), 5, False),
    "spring, 5 modes": (impact.LinearSpring(30.0), 5, False),
    "Hertz, 40 modes": (Hertz(100.0), 40, False),
    "rigid, mass": (impact.Signorini(), 5, True),
    "Hunt-Crossley": (HuntCrossley(100.0, 0.1), 5, False),
}
