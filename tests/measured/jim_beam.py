"""Three aluminium plates as one solid: natural modes of a free body against those of a modal test."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import skfem

from seatfem import assemble, solve_modes
from seatfem.structures.materials import Material
from seatfem.structures.model import Array
from seatfem.units import parse_quantity
from seatfem.verify import Estimate, MeasuredSet

RIGID = 6
"""Modes of a free body without strain, which come first."""
MODES = 13
COARSE, FINE = (1, 0.025), (2, 0.0125)
"""Quadratic elements through each plate, and their size along it [m]."""


@dataclass(frozen=True)
class Plates:
    """Two legs on a plate that joins them, as one piece (SI).

    ``base``: thickness of the joining plate; ``joint``: modulus over that of the plates where a leg meets it.
    """

    width: float
    depth: float
    height: float
    thickness: float
    base: float
    material: Material
    joint: float = 1.0


def predict(record: MeasuredSet) -> Mapping[str, Estimate]:
    """Return modulus, frequencies and MACs of the modes.

    Bars: half of what the mesh changes, the fitted frequency's uncertainty, and the tolerances of height and thickness,
    each with its own fit.
    """
    geometry, plates = record.geometry, plates_of(record)
    fitted = record.fitted["modulus"]["mode"] - 1
    target, spread = fitted_to(record, "modulus")

    shapes, places = measured_shapes(record)
    fine, ours = plate_modes(plates, FINE, places)
    coarse, coarse_shapes = plate_modes(plates, COARSE, places)
    higher = replace(plates, height=plates.height + parse_quantity(geometry["tolerance_of_height"], "length"))
    thicker = replace(plates, base=plates.base + parse_quantity(geometry["tolerance_of_thickness"], "length"))

    def scaled(frequencies: Array) -> Array:
        return frequencies * (target / frequencies[fitted])

    changes = [(scaled(coarse) - scaled(fine)) / 2]
    changes += [scaled(plate_modes(each, COARSE, places)[0]) - scaled(coarse) for each in (higher, thicker)]
    bars = np.sqrt(np.sum(np.square(changes), axis=0) + (scaled(fine) * spread / target) ** 2)
    macs = np.array([assurance(a, b) for a, b in zip(shapes, ours.T, strict=True)])
    differences = np.abs(macs - [assurance(a, b) for a, b in zip(shapes, coarse_shapes.T, strict=True)])

    names = {f"frequency of mode {k + 1}": Estimate(scaled(fine)[k], bars[k]) for k in range(MODES)}
    names |= {f"MAC of mode {k + 1}": Estimate(macs[k], differences[k]) for k in range(MODES)}
    modulus = 1e-9 * plates.material.young * (target / fine[fitted]) ** 2
    error = abs((fine[fitted] - coarse[fitted]) / 2 / fine[fitted])
    return names | {"modulus": Estimate(modulus, 2 * modulus * math.hypot(spread / target, error))}


def assurance(a: Array, b: Array) -> float:
    """Return the modal assurance criterion |a* b|^2/((a* a)(b* b)) of two shapes (n,), of which either may be
    complex."""
    return float(abs(np.vdot(a, b)) ** 2 / (np.vdot(a, a).real * np.vdot(b, b).real))


def plates_of(record: MeasuredSet) -> Plates:
    """Return the plates of a record, as one piece."""
    geometry = record.geometry
    length = {key: parse_quantity(geometry[key], "length") for key in ("width", "depth", "height", "thickness")}
    young, density = parse_quantity(geometry["young"], "pressure"), parse_quantity(geometry["density"], "density")
    return Plates(**length, base=length["thickness"], material=Material(young, geometry["poisson"], density))


def measured_shapes(record: MeasuredSet) -> tuple[Array, Array]:
    """Return the (m, p) measured shapes and the places (p, 3) [m] of their points."""
    shapes = record.data["shapes"]
    measured = np.array(shapes["real"]) + 1j * np.array(shapes["imaginary"])
    return measured, 1e-3 * np.array(shapes["points"], dtype=float)


def fitted_to(record: MeasuredSet, name: str) -> tuple[float, float]:
    """Return frequency and uncertainty [Hz] of the mode that a number is fitted to."""
    fit = record.fitted[name]
    return float(fit["frequency_hz"]), float(fit["uncertainty_hz"])


def plate_modes(plates: Plates, size: tuple[int, float], places: Sequence[Any] | Array) -> tuple[Array, Array]:
    """Return the (m,) elastic frequencies [Hz] and the (p, m) displacements across the legs at the places [m]."""
    soft = replace(plates.material, young=plates.joint * plates.material.young)
    model = assemble(_mesh(plates, *size), {"plates": plates.material, "joints": soft}, fixed=(), ports={}, order=2)
    modes = solve_modes(model, RIGID + MODES, shift_hz=100.0)
    assert model.dofs is not None
    points = model.dofs.points
    nodes = [int(np.argmin(np.sum((points.T - place) ** 2, axis=1))) for place in places]
    shapes = [model.dofs.expand(shape)[0, nodes] for shape in modes.shapes[:, RIGID:].T]
    return modes.frequencies_hz[RIGID:], np.array(shapes).T


def _mesh(plates: Plates, layers: int, size: float) -> Any:
    """Return hexahedra of the three plates, with nodes at half height and half depth."""
    t, base, half = plates.thickness, plates.base, plates.height / 2
    end = plates.width - t
    x = _joined((0.0, t, layers), (t, end, _cells(end - t, size)), (end, plates.width, layers))
    y = np.linspace(0.0, plates.depth, 2 * _cells(plates.depth / 2, size) + 1)
    z = _joined((0.0, base, layers), (base, half, _cells(half - base, size)), (half, 2 * half, _cells(half, size)))
    block = skfem.MeshHex.init_tensor(x, y, z)
    middle = block.p[:, block.t].mean(axis=1)
    cut = block.restrict(np.flatnonzero((middle[0] < t) | (middle[0] > end) | (middle[2] < base)))
    middle = cut.p[:, cut.t].mean(axis=1)
    joints = (middle[2] < base) & ((middle[0] < t) | (middle[0] > end))
    return cut.with_subdomains({"joints": np.flatnonzero(joints), "plates": np.flatnonzero(~joints)})


def _cells(length: float, size: float) -> int:
    return max(1, round(length / size))


def _joined(*parts: tuple[float, float, int]) -> Array:
    return np.unique(np.concatenate([np.linspace(start, end, n + 1) for start, end, n in parts]))
