"""A cantilever by the Timoshenko beam of `impact`: the first frequency fits the modulus, the others follow."""

import math
from collections.abc import Mapping

import numpy as np

from impact import TimoshenkoCantilever
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return modulus and frequencies; their relative bar is the uncertainty of the fitted one."""
    geometry, fit = record.geometry, record.fitted["modulus"]
    young = parse_quantity(geometry["young"], "pressure")
    beam = TimoshenkoCantilever(
        young=young,
        density=parse_quantity(geometry["density"], "density"),
        length=parse_quantity(geometry["length"], "length"),
        width=parse_quantity(geometry["width"], "length"),
        thickness=parse_quantity(geometry["thickness"], "length"),
    )
    frequencies = np.asarray(beam.frequencies(3)) / (2 * math.pi)
    factor, spread = fit["frequency_hz"] / frequencies[0], fit["uncertainty_hz"] / fit["frequency_hz"]
    modulus = 1e-9 * young * factor**2
    ours = {
        name: Estimate(factor * value, factor * value * spread)
        for name, value in zip(("second frequency", "third frequency"), frequencies[1:], strict=True)
    }
    return ours | {"modulus": Estimate(modulus, 2 * spread * modulus)}
