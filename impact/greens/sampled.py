"""Green's function known at equally spaced times: measured, or computed by time integration."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from impact.greens import base
from impact.greens.base import Array
from impact.quantities import percent

Tail = Literal["zero", "hold", "rigid", "forbid"]
Pretrigger = Literal["refuse", "drop"]
_GRID = 0.01  # largest deviation of a time from an even grid, over the spacing, as times in files are rounded


@dataclass(frozen=True)
class SampledGreens(base.StatedGreens):
    """g_ij at t = 0, dt, 2 dt, ..., linear in between, with a stated rule beyond the last sample.

    Attributes:
        values: samples (p, p, n) or, for one port, (n,) [m/(N s)], n >= 2; the first is g(0+).
        dt: spacing [s].
        tail: rule for g beyond the last sample: "zero" (a supported body that has come to rest), "hold" (last value: a
            body that a constant force moves at constant speed), "rigid" (continued with the last slope: a free body),
            or "forbid": evaluation raises an error.
        port_names: p names; default "contact" for one port, "1", "2", ... for several.
        static: static compliance (p, p) if known independently [m/N], else (0, 0).
        error: estimated error of g.
        origin: provenance, plain JSON values.

    Raises:
        GreensFunctionError: wrong shape, values not finite, g_ij != g_ji, g_ii(0+) < 0, unknown tail rule.
    """

    values: Array
    dt: float
    tail: Tail = "forbid"
    port_names: tuple[str, ...] = ()
    static: Array = field(default_factory=lambda: np.zeros((0, 0)))
    error: base.ErrorEstimate = field(default_factory=base.ErrorEstimate)
    origin: Mapping[str, object] = field(default_factory=dict)

    __repr__ = base.StatedGreens.__str__
    overhang: ClassVar[float] = 0.0
    remedy_too_short: ClassVar[str] = "measure or compute longer, or state a tail rule (zero, hold, rigid)"

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=float)
        values = values.reshape(1, 1, -1) if values.ndim == 1 else values
        if values.ndim != 3 or values.shape[0] != values.shape[1] or values.shape[2] < 2:
            raise base.GreensFunctionError(f"values must be (n,) or (p, p, n) with n >= 2, got {np.shape(self.values)}")
        p = len(values)
        names = self.port_names or (("contact",) if p == 1 else tuple(str(k + 1) for k in range(p)))
        if len(names) != p:
            raise base.GreensFunctionError(f"{len(names)} port names for {p} ports: give one for each")
        if not (np.isfinite(self.dt) and self.dt > 0):
            raise base.GreensFunctionError(f"dt = {self.dt} s must be positive and finite")
        if self.tail not in get_args(Tail):
            raise base.GreensFunctionError(f"tail {self.tail!r} is unknown; choose from {', '.join(get_args(Tail))}")
        if bad := int(np.sum(~np.isfinite(values))):
            first_bad = int(np.flatnonzero(np.any(~np.isfinite(values), axis=(0, 1)))[0])
            raise base.GreensFunctionError(
                f"{bad} of {values.size} samples are not finite, the first at {first_bad * self.dt:.6g} s: measure "
                "again, or fill them in"
            )
        skew = float(np.abs(values - values.transpose(1, 0, 2)).max()) / max(float(np.abs(values).max()), 1e-300)
        if skew > 1e-6:
            raise base.GreensFunctionError(
                f"g_ij and g_ji differ by {skew:.1e} of the maximum: average them (reciprocity)"
            )
        if (first := values[range(p), range(p), 0].min()) < 0:
            raise base.GreensFunctionError(
                f"g(0+) = {first:g} m/(N s) must be >= 0: a push does not start with a pull; check the sign and the "
                "time zero, or set a first sample that is noise to zero"
            )
        static = np.reshape(np.asarray(self.static, dtype=float), (p, p) if np.size(self.static) else (0, 0))
        if np.any(np.isnan(static)):
            raise base.GreensFunctionError(
                "static must hold the (p, p) static compliance, or be left out where it is unknown"
            )
        for key, value in (("values", values), ("port_names", names), ("static", static)):
            object.__setattr__(self, key, value)

    @classmethod
    def from_series(
        cls,
        time: ArrayLike,
        values: ArrayLike,
        *,
        tail: Tail = "forbid",
        pretrigger: Pretrigger = "refuse",
        port_names: tuple[str, ...] = (),
        static: ArrayLike = (),
        origin: Mapping[str, object] = base.OWN_ORIGIN,
    ) -> SampledGreens:
        """Return a measured function: ``values`` (n,) or (p, p, n) [m/(N s)] at ``time`` (n,) or (p, p, n) [s], the
        impact at 0.

        The times must be equally spaced to 1 % of the spacing, the same for all records, with a sample at t = 0.
        Earlier samples must be zero, or are dropped with ``pretrigger="drop"``; ``origin["pretrigger"]`` then has their
        number, and their share of the sum of g^2. Raises `GreensFunctionError` otherwise, and as the class itself.
        """
        g = np.asarray(values, dtype=float)
        t, dt = _uniform(_common_time(np.asarray(time, dtype=float), g.shape))
        zero = round(-t[0] / dt)
        if t[0] > _GRID * dt:
            raise base.GreensFunctionError(
                f"the record starts at {t[0]:.6g} s: g from 0 to there is unknown; give it, or shift the time axis"
            )
        if zero >= len(t) - 1 or abs(t[0] + zero * dt) > _GRID * dt:
            nearest = t[np.argmin(np.abs(t))]
            raise base.GreensFunctionError(
                f"no sample at t = 0, the nearest is at {nearest:.6g} s: shift or resample the time"
            )
        early, later = g[..., :zero], g[..., zero:]
        provenance = dict(origin)
        if np.any(early != 0):
            share = float(np.sum(early**2) / np.sum(g**2))
            if pretrigger != "drop":
                raise base.GreensFunctionError(
                    f"not causal: {zero} samples before t = 0 reach {np.abs(early).max():.3g} m/(N s), "
                    f"{percent(share)} of the sum of squares; a body does not "
                    "move before the blow: correct the time zero, or give "
                    'pretrigger="drop"'
                )
            provenance["pretrigger"] = {"samples": zero, "share_of_squares": share}
        return cls(later, dt, tail, port_names, np.asarray(static), origin=provenance)

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> SampledGreens:
        values = np.einsum("ia,ijn,jb->abn", weights, self.values, weights, optimize=True)
        static = weights.T @ self.static @ weights if self.static.size else self.static
        values = (values + values.transpose(1, 0, 2)) / 2  # to round-off
        return replace(self, values=values, static=static, port_names=port_names)

    @property
    def end(self) -> float:
        """Return the time of the last sample [s]."""
        return float((self.values.shape[2] - 1) * self.dt)

    @property
    def valid_for(self) -> float:
        """Return the time of the last sample with tail "forbid", otherwise ``inf``, as the tail rule continues g
        [s]."""
        return self.end if self.tail == "forbid" else math.inf

    def known_for(self, time: float) -> Self:
        return self

    @property
    def sampled_parts(self) -> tuple[SampledGreens, ...]:
        return (self,)

    def inverse_mass(self) -> Array:
        """Return the last slope (p, p) with tail "rigid" [1/kg], otherwise 0, as other bodies count as supported."""
        if self.tail != "rigid":
            return np.zeros(self.values.shape[:2])
        return np.asarray((self.values[:, :, -1] - self.values[:, :, -2]) / self.dt)

    def scaled(self, factor: float) -> SampledGreens:
        return replace(self, values=base.check_factor(factor) * self.values, static=factor * self.static)

    def stored(self) -> base.Stored:
        arrays = {"values": self.values} | ({"static": self.static} if self.static.size else {})
        return base.Stored("sampled", {"dt": self.dt, "tail": self.tail}, arrays)

    def _describe(self) -> tuple[str, ...]:
        count = self.values.shape[2]
        return (f"{count} samples {self.dt:.4g} s apart, up to {self.end:.4g} s; tail {self.tail}",)

    @cached_property
    def _integral(self) -> Array:
        """Return the exact integral (p, p, n) of the piecewise-linear g up to each sample."""
        steps = (self.values[:, :, 1:] + self.values[:, :, :-1]) * (self.dt / 2)
        return np.concatenate([np.zeros((*steps.shape[:2], 1)), np.cumsum(steps, axis=2)], axis=2)

    def _pieces(self, t: ArrayLike, i: int, j: int) -> tuple[Array, Array, Array, Array, Array]:
        """Return (t, index of the sample before, time since, its value, slope after it); the tail is the last piece."""
        t = np.asarray(t, dtype=float)
        last = self.values.shape[2] - 1
        if self.tail == "forbid" and t.size and t.max() > self.end * (1 + 1e-9):
            raise base.GreensFunctionError(
                f"g is asked for at {t.max():.6g} s but known up to {self.end:.6g} s only: compute or measure a longer "
                "duration, or state a tail rule (zero, hold, rigid)"
            )
        index = np.clip(np.floor(t / self.dt).astype(int), 0, last)
        g = self.values[i, j]
        slopes = np.append(np.diff(g) / self.dt, (g[-1] - g[-2]) / self.dt if self.tail == "rigid" else 0.0)
        start = np.where((index == last) & (self.tail == "zero") & (t > self.end), 0.0, g[index])
        return t, index, np.maximum(t, 0.0) - index * self.dt, start, slopes[index]

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        t, _, since, start, slope = self._pieces(t, i, j)
        return np.asarray(np.where(t < 0, 0.0, start + slope * since))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        t, index, since, start, slope = self._pieces(t, i, j)
        return np.asarray(np.where(t < 0, 0.0, self._integral[i, j][index] + since * (start + slope * since / 2)))

    def static_compliance(self) -> Array:
        """Return ``static`` (p, p) if given, otherwise by the tail rule; raises for "forbid" [m/N]."""
        if self.static.size:
            return self.static
        if self.tail == "forbid":
            raise base.GreensFunctionError(
                "the static compliance is unknown: read the record with the argument static, or a tail rule but forbid"
            )
        if self.tail == "zero":
            return np.asarray(self._integral[:, :, -1])
        last = self.values[:, :, -1]
        if self.tail == "rigid":
            slope = last - self.values[:, :, -2]
            last = np.where(slope != 0, slope, last)
        return np.where(last != 0, np.copysign(np.inf, last), self._integral[:, :, -1])

    def initial_value(self) -> Array:
        return np.asarray(self.values[:, :, 0])

    def step_kernel(self, dt: float, n_steps: int) -> base.StepKernel:
        self.check_length(dt, n_steps)
        return base.StepKernel(
            None, base.step_weights(self, dt, n_steps), f"convolution of a sampled g, {n_steps} weights"
        )


def _common_time(time: Array, shape: tuple[int, ...]) -> Array:
    """Return the common time axis (n,) of all records."""
    if len(shape) not in (1, 3) or time.shape not in (shape, shape[-1:]) or shape[-1] < 2:
        raise base.GreensFunctionError(
            f"time {time.shape} and values {shape} do not match: (n,) each, or values (p, p, n); n >= 2"
        )
    if time.ndim == 1:
        return time
    away = np.abs(time - time[0, 0])
    if away.max() > _GRID * np.abs(np.diff(time[0, 0])).min():
        i, j, k = (int(a) for a in np.unravel_index(int(np.argmax(away)), time.shape))
        raise base.GreensFunctionError(
            f"the records have different times: sample {k} is at {time[i, j, k]:.6g} s for ports {i + 1}, {j + 1} and "
            f"at {time[0, 0, k]:.6g} s for ports 1, 1; resample them to one grid"
        )
    return np.asarray(time[0, 0])


def _uniform(time: Array) -> tuple[Array, float]:
    """Return the times and their spacing; raises `GreensFunctionError` if they are not equally spaced."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    irregular = np.flatnonzero(~(np.abs(steps - usual) <= _GRID * abs(usual)))
    if irregular.size or not usual > 0:
        k = int(irregular[0]) if irregular.size else 0
        raise base.GreensFunctionError(
            f"the times are not equally spaced: from sample {k} at {time[k]:.6g} s to the next it is {steps[k]:.4g} s, "
            f"usually {usual:.4g} s; resample to a uniform grid"
        )
    return time, float((time[-1] - time[0]) / (len(time) - 1))
