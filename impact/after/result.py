"""`ImpactResult`, the histories of a run, its `RunRows` and `EnergyLedger`: data without references to the solver."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from impact import notices
from impact.after.histories import closed_steps, merged
from impact.greens.base import Array
from impact.march import laws, motion
from impact.march import rows as march_rows
from impact.march.grid import AtEqualSteps, TimeGrid, blocks
from impact.march.problem import ContactError, ContactProblem
from impact.names import frame_of
from impact.quantities import as_html, brief, cut, in_units, percent, some

if TYPE_CHECKING:
    import pandas

_WAYS = ("gap", "striker_displacement", "target_displacement")
_TERMS = ("input", "striker", "target", "contact", "dissipated")


NO_FILM: Final[Array] = np.zeros(())
"""Force and energy of the films of a run without any."""
NO_ENERGY: Final = 1e-200
"""Energy [J] up to which a ledger counts as zero: squares of the 1e-140 added to every state against denormals."""


@dataclass(frozen=True)
class EnergyLedger:
    """Energies [J] at every recorded time, all (n + 1,).

    Attributes:
        input: energy supplied: initial energy, work of loads and of moving bases against the contacts, and work of
            separating rigid bodies that overlap at the start.
        striker, target: energy stored, relative to a moving base (for a body in ``by_work``, the whole work done on
            it).
        contact: energy stored in the contact laws.
        dissipated: energy lost so far in the bodies' damping, in the contacts and in their films.
        contact_loss: part of ``dissipated`` lost in the contacts: impact losses and numerical damping of the step.
        film_loss: part of ``dissipated`` lost in the films of the gaps; 0 without films.
        by_work: names of the bodies whose energy is known only as the work done on them.
    """

    input: Array
    striker: Array
    target: Array
    contact: Array
    dissipated: Array
    contact_loss: Array
    by_work: tuple[str, ...] = ()
    film_loss: Array = field(default_factory=lambda: NO_FILM)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "film_loss", np.broadcast_to(self.film_loss, self.input.shape))

    @property
    def stored(self) -> Array:
        """Return the energy stored in striker, target and contact."""
        return self.striker + self.target + self.contact

    @property
    def residual(self) -> float:
        """Return max |input - stored - dissipated| / max(|striker| + |target| + |contact|); 0 without energy."""
        largest = float(np.max(np.abs(self.striker) + np.abs(self.target) + np.abs(self.contact)))
        error = float(np.max(np.abs(self.input - self.stored - self.dissipated)))
        return error / largest if largest > NO_ENERGY else 0.0


def find_separation_work(problem: ContactProblem, force: Array, gap: Array) -> Array:
    """Return the (n + 1,) work [J] done in the first step to separate rigid bodies that overlap at t = 0."""
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
    carried: Array,
    film: Array,
) -> EnergyLedger:
    """Return the ledger from the motion of each body (striker first), force (n, p), with the films' part ``film``,
    (n, 0) without films, and gap (n + 1, p), with the part ``carried`` from moving bases."""
    potential, of_bases, lost, by_films = np.zeros((4, len(gap)))
    for column, contact in enumerate(problem.contacts):  # the whole history: a joint remembers its largest closure
        potential += contact.law.potential(-gap[:, column])
    for part in blocks(len(force)):
        now, after = slice(part.start, part.stop + 1), slice(part.start + 1, part.stop + 1)
        opened, pushed = np.diff(gap[now], axis=0), force[part]
        of_bases[after] = np.sum(-pushed * np.diff(carried[now], axis=0), axis=1)
        if film.size:
            by_films[after] = np.sum(-film[part] * opened, axis=1)
            pushed = pushed - film[part]
        lost[after] = np.sum(-pushed * opened, axis=1) - np.diff(potential[now])
    of_films = np.cumsum(by_films)
    pressed = find_separation_work(problem, force[:1] - film[:1] if film.size else force[:1], gap)
    loss = np.cumsum(lost) + pressed
    stored_at_start = sum(float(m.stored[0]) for m in motions) + float(potential[0])
    names = ("striker", *(["target"] * (len(motions) - 1)))
    return EnergyLedger(
        input=stored_at_start + np.sum([m.load_work for m in motions], axis=0) + pressed + np.cumsum(of_bases),
        striker=motions[0].stored,
        target=np.sum([m.stored for m in motions[1:]], axis=0),
        contact=potential,
        dissipated=np.sum([m.dissipated for m in motions], axis=0) + loss + of_films,
        contact_loss=loss,
        film_loss=of_films,
        by_work=tuple(dict.fromkeys(name for name, m in zip(names, motions, strict=True) if m.by_work)),
    )


@dataclass(frozen=True)
class RunRows(TimeGrid):
    """Histories of one contact, all (N + 1,), or of p contacts, (N + 1, p): a row a step of the march, the start first.

    A force is constant over the step that ends there; motions and energies, (N + 1,), are those at its end. ``film``
    is zero without films. See `ImpactResult`. Displacements at many contacts are made when they are asked for;
    ``None``: they are not on file.
    """

    force: Array
    gap: Array
    striker_displacement: Array | march_rows.Replayed | None
    target_displacement: Array | march_rows.Replayed | None
    energy: EnergyLedger
    film: Array = field(default_factory=lambda: NO_FILM)

    __repr__ = brief

    def __post_init__(self) -> None:
        object.__setattr__(self, "film", np.broadcast_to(self.film, self.force.shape))

    @cached_property
    def solid(self) -> Array:
        """Return the force >= 0 of solid contact [N]: ``force`` without the film's part."""
        return self.force - self.film if np.any(self.film) else self.force

    def make_displacement(self, body: Literal["striker", "target"]) -> Array:
        """Return the displacement of the striker or the target [m], shaped as ``force``; raises `ContactError` if it is
        not on file."""
        known = self.striker_displacement if body == "striker" else self.target_displacement
        if known is None:
            raise ContactError(
                f"the displacements at {self.force.shape[-1]} contacts of a long run are not on file: take those of "
                "the whole face, or solve the problem again"
            )
        return np.asarray(known)


@dataclass(frozen=True)
class ImpactResult(AtEqualSteps):
    """Time histories of one contact, all (n + 1,), or of p contacts, (n + 1, p), at n equal steps; SI.

    ``force[m]`` is constant over the step that ends at ``time[m]``: the impulse is exactly ``sum(force[1:]) * dt``;
    ``force[0]`` is the preload. Displacements are along the normal from target to striker; ``gap`` > 0 is open.

    A long run is marched, and kept, in steps of different lengths: ``rows``. The histories are made from them when they
    are asked for. Within a long step motions are on the line between its ends, from which they stray by no more than
    `impact.march.ladder.BEND` of the largest gap; `impact.march.grid.TimeGrid` makes windows of them. They raise
    `impact.ContactError` where one would take more than 4 GB.

    Attributes:
        rows: what was marched, a row a step.
        striker_mass, target_mass: mass in rigid translation [kg], ``inf`` for a held body.
        striker_velocity, target_velocity: initial velocity of translation [m/s].
        engine: description of the method that evaluated the convolution with past forces.
        advice: warnings, empty when all is well.
    """

    rows: RunRows
    striker_mass: float
    target_mass: float
    striker_velocity: float
    target_velocity: float
    engine: str
    advice: tuple[notices.Advice, ...] = ()

    _repr_html_ = as_html

    def __repr__(self) -> str:
        return str(self)

    @property
    def time(self) -> Array:
        """Return the times of the histories, uniform from 0 [s]."""
        return np.asarray(self.dt * np.arange(self.rows.ends[-1] + 1), dtype=np.float64)

    @property
    def striker_displacement(self) -> Array:
        """Return the displacement of the contact point of the striker, its base's motion included [m]."""
        return self.rows.spread_motions(self.rows.make_displacement("striker"))

    @property
    def target_displacement(self) -> Array:
        """Return the displacement of the contact point of the target, its base's motion included [m]."""
        return self.rows.spread_motions(self.rows.make_displacement("target"))

    @property
    def film(self) -> Array:
        """Return the part of ``force`` carried by films in the gaps [N]; 0 without films."""
        return self.rows.spread_forces(self.rows.film)

    @property
    def solid(self) -> Array:
        """Return the force >= 0 of solid contact [N]: ``force`` without the film's part."""
        return self.rows.spread_forces(self.rows.solid)

    @property
    def energy(self) -> EnergyLedger:
        """Return the ledger."""
        of_rows, spread = self.rows.energy, self.rows.spread_motions
        each = {name: spread(getattr(of_rows, name)) for name in (*_TERMS, "contact_loss", "film_loss")}
        return EnergyLedger(**each, by_work=of_rows.by_work)

    def __str__(self) -> str:
        """Return a summary in four lines: size of the run, force, contacts, energy balance error."""
        rows = self.rows
        parts = 1 if rows.force.ndim == 1 else rows.force.shape[1]
        total, time = (values.reshape(len(values), -1).sum(axis=1) for values in (rows.force, rows.time))
        peak, when = (in_units(value, unit, 4) for value, unit in ((total.max(), "N"), (time[total.argmax()], "s")))
        size = f"{parts} contact{'s'[: parts > 1]}, {rows.ends[-1]} steps of {in_units(self.dt, 's', 4)}"
        if not rows.is_uniform:
            size += f", taken as {rows.describe()}"
        advice_names = some([advice.name for advice in self.advice]) or "no advice"
        closed = closed_steps(rows.solid.reshape(len(time), -1).sum(axis=1)[1:])
        groups = merged(time[closed])
        touches = "no contact"
        if len(groups):
            first = " to ".join(in_units(edge, "s", 4) for edge in groups[0])
            touches = f"closed once, from {first}"
            if len(groups) > 1:
                touches = f"closed {len(groups)} times, first from {first}"
        return (
            f"ImpactResult, {size}\n  peak force {peak} at {when}, impulse "
            f"{in_units(float(total[1:] @ rows.spans), 'N s', 4)}\n  {touches}\n  "
            f"energy balance error {percent(rows.energy.residual)}; {cut(self.engine, 160)}; {advice_names}"
        )

    def to_dataframe(self) -> pandas.DataFrame:
        """Return the histories by time [SI], a row a step; raises `impact.names.FrameError` without pandas."""
        rows = self.rows
        histories = {"force_N": rows.force, **{f"{name}_m": np.asarray(getattr(rows, name)) for name in _WAYS}}
        energies = {f"energy_{name}_J": getattr(rows.energy, name) for name in _TERMS}
        return frame_of({"time_s": rows.time, **histories, **energies}, "time_s")


def select_contacts(result: ImpactResult, which: int | slice) -> ImpactResult:
    """Return the result with one of several contacts, histories (n + 1,), or a range; energies remain those of all."""
    rows = result.rows
    known = {name: getattr(rows, name) for name in ("force", *_WAYS, "film")}
    columns: dict[str, Any] = {name: None if values is None else values[:, which] for name, values in known.items()}
    return replace(result, rows=replace(rows, **columns))


def join_contacts(result: ImpactResult, shares: Array) -> ImpactResult:
    """Return p contacts of one face as one: summed forces, mean motions weighted by the (p,) area fractions."""
    rows = result.rows
    if rows.force.ndim == 1:
        return result
    known = {name: getattr(rows, name) for name in _WAYS}
    means: dict[str, Any] = {name: None if values is None else values @ shares for name, values in known.items()}
    return replace(result, rows=replace(rows, **means, force=rows.force.sum(axis=1), film=rows.film.sum(axis=1)))
