"""`ImpactResult`, the histories of a run, and `EnergyLedger`: data without references to the solver."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from impact import after, notices
from impact.greens.base import Array
from impact.march import laws
from impact.march.problem import ContactProblem
from impact.names import frame_of
from impact.quantities import as_html, brief, cut, in_units, percent, some

if TYPE_CHECKING:
    import pandas

    from impact.march import motion

_WAYS = ("gap", "striker_displacement", "target_displacement")
_TERMS = ("input", "striker", "target", "contact", "dissipated")


NO_ENERGY: Final = 1e-200
"""Energy that is none [J]: squares of the 1e-140 that the march adds to every state against denormal numbers."""


@dataclass(frozen=True)
class EnergyLedger:
    """Energies [J] at every recorded time, all (n + 1,).

    Attributes:
        input: energy brought in: initial energy, work of loads, of moving bases against the contacts, and what an
            overlap of rigid bodies at the start puts in.
        striker, target: energy stored, seen from the base where that moves (or, for a body in ``by_work``, all work it
            has received).
        contact: energy stored in the contact laws.
        dissipated: lost in the bodies' damping, in the contacts and in their films so far.
        contact_loss: the part of ``dissipated`` lost in the contacts: the impact itself, and the step's own damping.
        film_loss: the part of it lost in the films of their gaps; ``None`` where there are none.
        by_work: names of the bodies known only by the work done on them.
    """

    input: Array
    striker: Array
    target: Array
    contact: Array
    dissipated: Array
    contact_loss: Array
    by_work: tuple[str, ...] = ()
    film_loss: Array | None = None

    __repr__ = brief

    @property
    def stored(self) -> Array:
        """Return the energy stored in striker, target and contact."""
        return self.striker + self.target + self.contact

    @property
    def residual(self) -> float:
        """Return max |input - stored - dissipated| over the largest sum of stored energies; 0 without any."""
        largest = float(np.max(np.abs(self.striker) + np.abs(self.target) + np.abs(self.contact)))
        error = float(np.max(np.abs(self.input - self.stored - self.dissipated)))
        return error / largest if largest > NO_ENERGY else 0.0


def pressed_in(problem: ContactProblem, force: Array, gap: Array) -> Array:
    """Return the (n + 1,) work of the first step on rigid bodies that overlap at t = 0, which no law stores [J]."""
    out = np.zeros(len(gap))
    if len(force) and not problem.preload:
        rigid = np.array([isinstance(c.law, laws.Signorini) for c in problem.contacts])
        freed = np.where(rigid & (gap[0] < 0), np.minimum(gap[1], 0.0) - gap[0], 0.0)
        out[1:] = float(force[0] @ np.maximum(freed, 0.0))
    return out


def ledger(
    problem: ContactProblem,
    motions: tuple[motion.Motion, ...],
    force: Array,
    gap: Array,
    film: Array | None = None,
    carried: Array | None = None,
) -> EnergyLedger:
    """Return the ledger from the motion of each body (striker first), force (n, p), of which ``film`` is the films'
    part, and gap (n + 1, p), of which ``carried`` is what moving bases add."""
    potential = np.stack([c.law.potential(-gap[:, i]) for i, c in enumerate(problem.contacts)], axis=1)
    opened, of_films, of_bases = np.diff(gap, axis=0), None, np.zeros(len(gap))
    if carried is not None:
        of_bases[1:] = np.cumsum(np.sum(-force * np.diff(carried, axis=0), axis=1))
    if film is not None:
        of_films = np.concatenate([[0.0], np.cumsum(np.sum(-film * opened, axis=1))])
        force = force - film
    step_loss = np.sum(-force * opened - np.diff(potential, axis=0), axis=1)
    pressed = pressed_in(problem, force, gap)
    loss = np.concatenate([[0.0], np.cumsum(step_loss)]) + pressed
    stored_at_start = sum(float(m.stored[0]) for m in motions) + float(potential[0].sum())
    names = ("striker", *(["target"] * (len(motions) - 1)))
    return EnergyLedger(
        input=stored_at_start + np.sum([m.load_work for m in motions], axis=0) + pressed + of_bases,
        striker=motions[0].stored,
        target=np.sum([m.stored for m in motions[1:]], axis=0),
        contact=potential.sum(axis=1),
        dissipated=np.sum([m.dissipated for m in motions], axis=0) + loss + (0.0 if of_films is None else of_films),
        contact_loss=loss,
        film_loss=of_films,
        by_work=tuple(dict.fromkeys(name for name, m in zip(names, motions, strict=True) if m.by_work)),
    )


@dataclass(frozen=True)
class ImpactResult:
    """Time histories of one contact, all (n + 1,), or of p contacts, (n + 1, p), SI.

    ``force[m]`` is constant over the step that ends at ``time[m]``: the impulse is exactly ``sum(force[1:]) * dt``;
    ``force[0]`` is the preload. Displacements are along the normal from target to striker; ``gap`` > 0 is open.

    Attributes:
        time: uniform from 0 [s].
        force: contact force [N], >= 0 but for the pull of a film.
        gap: opening [m].
        striker_displacement, target_displacement: of the contact point, with its base [m].
        energy: the ledger [J].
        dt: step [s].
        striker_mass, target_mass: of rigid translation, ``inf`` when held [kg].
        striker_velocity, target_velocity: initial translation [m/s].
        engine: what remembered the past, in words.
        advice: warnings, empty when all is well.
        film: the part of ``force`` that films in the gaps bear [N]; ``None`` without any.
    """

    time: Array
    force: Array
    gap: Array
    striker_displacement: Array
    target_displacement: Array
    energy: EnergyLedger
    dt: float
    striker_mass: float
    target_mass: float
    striker_velocity: float
    target_velocity: float
    engine: str
    advice: tuple[notices.Advice, ...] = ()
    film: Array | None = None

    _repr_html_ = as_html

    def __repr__(self) -> str:
        return str(self)

    @property
    def solid(self) -> Array:
        """Return the force >= 0 that the bodies exert themselves where they touch [N]."""
        return self.force if self.film is None else self.force - self.film

    def __str__(self) -> str:
        """Return what the run did in four lines: its size, the force, the contacts, how far energy is balanced."""
        parts = 1 if self.force.ndim == 1 else self.force.shape[1]
        total = self.force.reshape(len(self.force), -1).sum(axis=1)
        peak, when = (
            in_units(value, unit, 4) for value, unit in ((total.max(), "N"), (self.time[total.argmax()], "s"))
        )
        size = f"{parts} contact{'s'[: parts > 1]}, {len(self.time) - 1} steps of {in_units(self.dt, 's', 4)}"
        advice_names = some([advice.name for advice in self.advice]) or "no advice"
        groups = after.measures.merged(
            self.dt * after.measures.closed_steps(self.solid.reshape(len(self.force), -1).sum(axis=1)[1:])
        )
        touches = "no contact"
        if len(groups):
            first = " to ".join(in_units(time, "s", 4) for time in groups[0])
            touches = f"closed once, from {first}"
            if len(groups) > 1:
                touches = f"closed {len(groups)} times, first from {first}"
        return (
            f"ImpactResult, {size}\n  peak force {peak} at {when}, impulse "
            f"{in_units(float(total[1:].sum()) * self.dt, 'N s', 4)}\n  {touches}\n  "
            f"energy balance error {percent(self.energy.residual)}; {cut(self.engine, 160)}; {advice_names}"
        )

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the histories by time [SI], a row a step; raises `impact.names.FrameError` without pandas."""
        of_contacts = {"force_N": self.force, **{f"{name}_m": getattr(self, name) for name in _WAYS}}
        energies = {f"energy_{name}_J": getattr(self.energy, name) for name in _TERMS}
        return frame_of({"time_s": self.time, **of_contacts, **energies}, "time_s")


def of_contacts(result: ImpactResult, which: int | slice) -> ImpactResult:
    """Return one of several contacts, histories (n + 1,), or a range of them; the energies stay those of all."""
    of_film = () if result.film is None else ("film",)
    return replace(result, **{name: getattr(result, name)[:, which] for name in ("force", *_WAYS, *of_film)})


def as_one(result: ImpactResult, shares: Array) -> ImpactResult:
    """Return p contacts of one face as one: the sum of the forces, the means by the (p,) ``shares`` of its area."""
    if result.force.ndim == 1:
        return result
    means = {name: getattr(result, name) @ shares for name in _WAYS}
    film = None if result.film is None else result.film.sum(axis=1)
    return replace(result, **means, force=result.force.sum(axis=1), film=film)
