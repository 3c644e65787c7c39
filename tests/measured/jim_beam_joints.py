"""The plates of `jim_beam` with soft joints: two moduli fitted to two modes."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from seatfem.structures.model import Array
from seatfem.verify import Estimate, MeasuredSet, read_measured_set

from .jim_beam import COARSE, FINE, MODES, Plates, assurance, fitted_to, measured_shapes, plate_modes, plates_of

SOFTEST, HARDEST = 0.02, 1.0
"""Modulus of a joint over that of the plates."""
CLOSE = 0.02
"""Of the logarithm of that share: it moves no frequency by 0.1 %."""


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return both moduli, frequencies and MACs.

    Bars: half of what the mesh changes, and what the uncertainties of the two fitted frequencies change.
    """
    beside = read_measured_set(Path(__file__).with_name(record.source.beside))
    plates, (shapes, places) = plates_of(beside), measured_shapes(beside)
    (whole, spread), (soft, spread_of_soft) = (fitted_to(record, name) for name in ("modulus", "joint"))
    modes = [record.fitted[name]["mode"] - 1 for name in ("modulus", "joint")]

    def fitted(ratio: float) -> Plates:
        """Return the plates with the joint whose modes have the ``ratio`` of frequencies, softer to harder mode."""

        def misfit(share: float) -> float:
            frequencies, _ = plate_modes(replace(plates, joint=math.exp(share)), COARSE, places)
            return float(frequencies[modes[1]] / frequencies[modes[0]] - ratio)

        share = brentq(misfit, math.log(SOFTEST), math.log(HARDEST), xtol=CLOSE)
        return replace(plates, joint=math.exp(share))

    def scaled(of: Plates, size: tuple[int, float]) -> tuple[Array, Array]:
        frequencies, ours = plate_modes(of, size, places)
        return frequencies * whole / frequencies[modes[0]], ours

    own, other = fitted(soft / whole), fitted((soft + spread_of_soft) / whole)
    fine, ours = scaled(own, FINE)
    coarse, coarse_shapes = scaled(own, COARSE)
    harder, harder_shapes = scaled(other, COARSE)
    parts = ((coarse - fine) / 2, harder - coarse, fine * spread / whole)
    bars = np.sqrt(np.sum(np.square(parts), axis=0))
    macs, *others = (
        np.array([assurance(a, b) for a, b in zip(shapes, each.T, strict=True)])
        for each in (ours, coarse_shapes, harder_shapes)
    )
    changes = np.abs(others[0] - macs) + np.abs(others[1] - others[0])

    raw = plate_modes(own, FINE, places)[0][modes[0]]
    modulus = 1e-9 * plates.material.young * (whole / raw) ** 2
    names = {f"frequency of mode {k + 1}": Estimate(fine[k], bars[k]) for k in range(MODES)}
    names |= {f"MAC of mode {k + 1}": Estimate(macs[k], changes[k]) for k in range(MODES)}
    return names | {
        "modulus": Estimate(modulus, 2 * modulus * spread / whole),
        "joint": Estimate(100 * own.joint, 100 * abs(other.joint - own.joint)),
    }
