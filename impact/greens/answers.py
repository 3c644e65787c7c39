"""Data of a Green's function: error estimate, uniform rod, kernel at a time step, content of a file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact import quantities
from impact.greens import base
from impact.greens import modal as modal_greens

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class GreensFunctionError(ValueError):
    """A Green's function that cannot be used; the message names number, limit and remedy."""


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated error of g after a pulse of the stated band, relative to its largest value.

    ``reduction`` is the error by reducing M, C, K to g (modes, Krylov vectors, time step); ``mesh`` is the
    discretisation error of M, C, K themselves. ``None`` means unknown, not zero.

    It is an error of g, not of the result of an impact: where a contact chatters, opening and closing within an impact,
    an error of 1e-3 has changed forces and impulses of single contacts by 1.6 %. `impact.error_budget` measures the
    error of an impact.
    """

    reduction: float | None = None
    mesh: float | None = None

    @property
    def total(self) -> float | None:
        """Return the sum of the known parts; ``None`` if nothing is known."""
        known = [e for e in (self.reduction, self.mesh) if e is not None]
        return sum(known) if known else None

    def __str__(self) -> str:
        reduction, mesh = ("unknown" if e is None else f"{e:.2g}" for e in (self.reduction, self.mesh))
        return (
            f"error of g in its band: reduction {reduction}, mesh {mesh}; "
            "it bounds no contact that chatters, impact.error_budget does"
        )


@dataclass(frozen=True)
class Rod:
    """A uniform rod struck at one end: impedance Z = rho c A [N s/m], transit l/c [s], reflection R at the far end.

    R is of the particle velocity: -1 fixed ... +1 free. ``damping_ratio`` is that of every mode.
    """

    impedance: float
    transit: float
    reflection: float
    damping_ratio: float = 0.0


@dataclass(frozen=True)
class StepKernel:
    """A Green's function at a fixed step h, for forces constant over each step.

    ``modal`` is advanced by its exact recursion; ``weights[i, j, m] = S_ij((m+1) h) - S_ij(m h)``, (p, p, n) [m/N],
    S the step response, is convolved. Either may be ``None``. ``engine``: the history engine in words.
    """

    modal: modal_greens.ModalGreens | None
    weights: Array | None
    engine: str

    __repr__ = quantities.brief

    def self_weight(self, dt: float) -> Array:
        """Return W_0 (p, p): displacement at the end of a step per unit force during it [m/N]."""
        parts = []
        if self.modal is not None:
            parts.append(self.modal.step_matrix(dt))
        if self.weights is not None:
            parts.append(self.weights[:, :, 0])
        return np.asarray(sum(parts))


@dataclass(frozen=True)
class Stored:
    """The content of a file from which a Green's function is restored, without its provenance, error and time limit.

    ``kind``: name of the representation in files; ``numbers``: plain values; ``arrays``: datasets, real or complex;
    ``parts``: functions of which it is composed, which have provenance, error and time limit of their own.
    """

    kind: str
    numbers: Mapping[str, float | str] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    parts: tuple[base.GreensFunction, ...] = ()


def check_positive(**values: float) -> None:
    """Raise `GreensFunctionError`, naming it, for a value that is not a positive, finite number."""
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise GreensFunctionError(f"{name} = {value:g} must be a positive, finite number")


def check_factor(factor: float) -> float:
    """Return a factor of g that leaves a passive body passive; raises `GreensFunctionError` for any other."""
    if not (np.isfinite(factor) and factor > 0):
        raise GreensFunctionError(f"factor = {factor} must be positive and finite: the body must stay passive")
    return float(factor)


def check_valid_for(time: float) -> None:
    """Raise `GreensFunctionError` for a time limit that is not positive."""
    if not time > 0:
        raise GreensFunctionError(f"valid_for = {time} s must be positive (inf: without limit)")
