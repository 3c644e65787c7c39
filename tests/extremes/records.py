"""Sampled kernels: noise, a cut tail, a coarse step; and the same numbers in other units."""

from functools import partial

import numpy as np

import impact
from impact.after.result import ImpactResult
from impact.greens.modal import ModalGreens as _Modal
from impact.greens.sampled import Tail
from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, swept, worst

SPACING = 2e-3
RINGING = scenes.modal_rod(40, zeta=0.02)


def record_cells() -> tuple[Cell, ...]:
    """Return sweeps over what measured records suffer from, and over units."""
    return (
        *swept("noise of a record / g(0+)", [0.0, *(10.0**k for k in range(-12, 1))], noise),
        *swept("record kept / needed", [1e-3, 1e-2, 0.1, 0.3, 0.5, 0.9, 1.0, 2.0], cut_tail),
        *swept(
            "record kept / needed, then zero", [1e-3, 1e-2, 0.1, 0.3, 0.5, 0.9, 1.0], partial(cut_tail, tail="zero")
        ),
        *swept("time step / spacing of a record", [0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0], coarse),
        *swept("length unit, m", [10.0**k for k in range(-9, 10, 3)], length_unit),
        *swept("power of two of length, mass and time", [-600, -300, -96, -30, 0, 30, 96, 300, 600], binary_unit),
    )


def noise(level: float) -> Finding:
    """White noise on every sample moves the impulse by about its own size, or the advice says that work is gained.

    The record without noise answers as the modes that it was taken from.
    """
    t = SPACING * np.arange(2001)
    clean = RINGING.impulse_response(t)
    dirty = clean + level * np.random.default_rng(1).standard_normal(len(t))
    dirty[0] = abs(dirty[0])
    clean_impulse = _impulse(_blow(clean))
    result = _blow(dirty)
    modes = _impulse(impact.solve(_problem(RINGING), dt=SPACING, duration=4.0))
    pairs = (
        (scenes.relative(_impulse(result), clean_impulse), 1e-12 + min(3 * level, 0.1)),
        (scenes.relative(clean_impulse, modes), 2e-4),
    )
    return Finding(*worst(*pairs), scenes.said(result), "impulse")


def cut_tail(share: float, *, tail: Tail = "forbid") -> Finding:
    """A record shorter than the run is refused unless a rule says how it goes on; a tail set to zero too early makes
    the body active: the advice must say so wherever the impulse is off."""
    t = SPACING * np.arange(max(int(2000 * share), 2) + 1)
    g = RINGING.impulse_response(t)
    result = impact.solve(_problem(impact.SampledGreens(g, SPACING, tail)), dt=SPACING, duration=4.0)
    exact = impact.measures.impulse(impact.solve(_problem(RINGING), dt=SPACING, duration=4.0))
    return Finding(scenes.relative(_impulse(result), exact), 2e-4, scenes.said(result), "impulse")


def coarse(ratio: float) -> Finding:
    """Steps finer and coarser than the samples agree with the modes that the samples were taken from."""
    t = SPACING * np.arange(4001)
    dt = SPACING * ratio
    result = impact.solve(_problem(impact.SampledGreens(RINGING.impulse_response(t), SPACING)), dt=dt, duration=4.0)
    exact = impact.measures.impulse(impact.solve(_problem(RINGING), dt=SPACING / 10, duration=4.0))
    return Finding(scenes.relative(_impulse(result), exact), 2e-4 + dt / 50, scenes.said(result), "impulse")


def length_unit(unit: float) -> Finding:
    """Forces stay with lengths in another unit and masses scaled to it: mm and t for 1e-3.

    The first contact: later ones may amplify round-off.
    """
    first, second = (_scaled_blow(length=f, mass=1 / f, time=1.0) for f in (1.0, 1 / unit))
    force = float(np.abs(first.force - second.force).max() / first.force.max())
    gap = float(np.abs(first.gap - second.gap * unit).max() / np.abs(first.gap).max())
    return Finding(max(force, gap), 1e-9, (), "force and gap")


def binary_unit(power: float) -> Finding:
    """Units that are powers of two change no digit: any difference is a hidden dimensional constant.

    Two constants of the program bound the range: 1e-140 added to every state, and the overflow of squares at 1e154.
    """
    f = 2.0 ** (power / 3)
    worst = 0.0
    for length, mass, time in ((f, 1.0, 1.0), (1.0, f, 1.0), (1.0, 1.0, f), (f, 1 / f, 1.0), (f, f, f)):
        first, second = _scaled_blow(length=1.0, mass=1.0, time=1.0), _scaled_blow(length=length, mass=mass, time=time)
        scale = mass * length / time**2
        worst = max(worst, float(np.abs(first.force - second.force / scale).max() / first.force.max()))
    return Finding(worst, 0.0, (), "force")


def _scaled_blow(*, length: float, mass: float, time: float) -> ImpactResult:
    """Run a mass on a damped modal rod under a rigid law, with changed units."""
    greens = scenes.modal_rod(8, zeta=0.01)
    compliance = time**2 / mass
    residual = impact.Residual(
        greens.residual.shapes * np.sqrt(time / mass),
        greens.residual.rates / time,
        greens.residual.compliance * compliance,
    )
    seat = impact.ModalGreens(greens.omega / time, greens.zeta, greens.shapes / np.sqrt(mass), residual)
    ball = impact.rigid_mass(mass=mass, velocity=-length / time)
    law = impact.Hertz(50.0 * mass / time**2 / np.sqrt(length))
    return impact.solve(
        impact.ContactProblem(ball, impact.Body(seat), gap=0.25 * length, law=law), dt=time / 256, duration=3 * time
    )


def _problem(greens: impact.SampledGreens | _Modal) -> impact.ContactProblem:
    return impact.ContactProblem(
        impact.rigid_mass(mass=1.0, velocity=-1.0), impact.Body(greens), law=impact.Signorini()
    )


def _blow(g: np.ndarray[tuple[int], np.dtype[np.float64]]) -> ImpactResult:
    return impact.solve(_problem(impact.SampledGreens(g, SPACING)), dt=SPACING, duration=4.0)


def _impulse(result: ImpactResult) -> float:
    return impact.measures.impulse(result)
