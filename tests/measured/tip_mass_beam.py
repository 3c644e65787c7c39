"""A cantilever with a mass at its tip, by the beam of `impact`: one modulus for all lengths."""

import math
from collections.abc import Mapping

import numpy as np

from impact import TipMassCantilever
from seatfem.structures.model import Array
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

LENGTHS = (0.3, 0.4, 0.5, 0.6)
ORDER = ("first", "second")


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return modulus and frequencies. Bars: half of the range of tip masses, each with its own fit, and the tolerance
    of the length, of the fitted beam and of each other."""
    geometry, fit = record.geometry, record.fitted["modulus"]
    lightest, heaviest = (parse_quantity(mass, "mass") for mass in geometry["tip_mass"])
    young = parse_quantity(geometry["young"], "pressure")
    fitted, mode = parse_quantity(fit["length"], "length"), fit["mode"] - 1
    tolerance = parse_quantity(geometry["tolerance_of_length"], "length")

    def frequencies(mass: float, length: float) -> Array:
        width, thickness = (parse_quantity(geometry[key], "length") for key in ("width", "thickness"))
        beam = TipMassCantilever(
            young=young,
            density=parse_quantity(geometry["density"], "density"),
            length=length,
            width=width,
            thickness=thickness,
            tip_mass=mass,
        )
        return np.asarray(beam.frequencies(len(ORDER))) / (2 * math.pi)

    def factor(mass: float, change: float = 0.0) -> float:
        """Return what the fit multiplies all frequencies by."""
        return float(fit["frequency_hz"] / frequencies(mass, fitted + change)[mode])

    middle = (lightest + heaviest) / 2
    ours: dict[str, Estimate] = {}
    for length in LENGTHS:
        value = factor(middle) * frequencies(middle, length)
        extremes = [factor(mass) * frequencies(mass, length) for mass in (lightest, heaviest)]
        other = factor(middle) * frequencies(middle, length + tolerance) - value
        reference = (factor(middle, tolerance) - factor(middle)) * frequencies(middle, length)
        reading = value * fit["uncertainty_hz"] / fit["frequency_hz"]
        bars = np.sqrt(((extremes[1] - extremes[0]) / 2) ** 2 + other**2 + reference**2 + reading**2)
        ours |= {f"{name} frequency, {length:g} m": Estimate(value[i], bars[i]) for i, name in enumerate(ORDER)}
    moduli = [1e-9 * young * factor(mass) ** 2 for mass in (lightest, heaviest)]
    changed = 1e-9 * young * (factor(middle, tolerance) ** 2 - factor(middle) ** 2)
    modulus = Estimate(sum(moduli) / 2, math.hypot((moduli[1] - moduli[0]) / 2, changed))
    return ours | {"modulus": modulus}
