"""The base of a body moves: a clamp that is shaken, a seat in a frame that accelerates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from impact.beams.modes import BeamModes
from impact.bodies.body import Load
from impact.bodies.loads import Gravity
from impact.bodies.time_series import TimeSeries, TimeSeriesError
from impact.brief import brief
from impact.greens.base import Array

Kind = Literal["displacement", "velocity", "acceleration"]


@dataclass(frozen=True)
class BaseMotion:
    """A course of the base along the normal, from rest relative to it at t = 0.

    In the frame of its base a body feels the load -acceleration on its mass, as if gravity changed; its ports are
    carried along by the displacement. Both are needed:

        body = impact.cantilever_reed(..., loads=[motion])
        body = dataclasses.replace(body, base=motion.displacement)

    Attributes:
        displacement: s(t) - s(0) at the times (n,) s -> (n,) m.
        acceleration: its second derivative, (n,) s -> (n,) m/s^2.
    """

    displacement: Callable[[Array], Array]
    acceleration: Callable[[Array], Array]

    __repr__ = brief

    @staticmethod
    def from_series(series: TimeSeries, kind: Kind) -> BaseMotion:
        """Return the motion by a record of one of the three, the others by exact integrals and derivatives of one
        piecewise polynomial.

        An acceleration or velocity is linear between its samples, a displacement a cubic spline (not-a-knot). The base
        moves from s = 0 at t = 0; an acceleration starts it from rest. Raises `TimeSeriesError`: another kind; later,
        times that the record does not cover.
        """
        from scipy.interpolate import CubicSpline, PPoly  # here, for its import takes longer than a small impact

        if kind not in get_args(Kind):
            raise TimeSeriesError(f"{series.name}: {kind!r} of a base is unknown; choose {', '.join(get_args(Kind))}")
        way: PPoly
        if kind == "displacement":
            way = CubicSpline(series.time, series.value, extrapolate=False)
        else:
            slope = np.diff(series.value) / np.diff(series.time)
            line = PPoly(np.stack([slope, series.value[:-1]]), series.time, extrapolate=False)
            way = line.antiderivative(1 if kind == "velocity" else 2)
        speed, push = way.derivative(), way.derivative(2)
        first = float(series.time[0]), float(series.time[-1])

        def inside(t: Array) -> Array:
            slack = 1e-9 * (first[1] - first[0])
            if t.size and (t.min() < first[0] - slack or t.max() > first[1] + slack):
                raise TimeSeriesError(
                    f"{series.name}: the base's {kind} covers {first[0]:g}..{first[1]:g} s, the run asks for "
                    f"{t.min():g}..{t.max():g} s; give a longer record"
                )
            return np.clip(t, *first)

        def displacement(t: Array) -> Array:
            zero = inside(np.zeros(1))
            drift = float(speed(zero)[0]) if kind == "acceleration" else 0.0  # the record may begin before t = 0
            return np.asarray(way(inside(t)) - way(zero) - drift * t)

        return BaseMotion(displacement, lambda t: np.asarray(push(inside(t))))

    def modal(self, modes: BeamModes) -> tuple[Load, ...]:
        """Return the load on a beam in the frame of its base, tip mass included: -integral of rho A w_k dx times
        s''."""
        return tuple(self.load(load.shape, modes.line_density * modes.length) for load in Gravity(1.0).modal(modes))

    def load(self, shape: Array, mass: float) -> Load:
        """Return the same on a body of a ``mass`` [kg] that is spread over its modes by ``shape`` (M,) [1/sqrt(kg)]."""
        return Load(shape, lambda t: -mass * np.asarray(self.acceleration(t), dtype=float))
