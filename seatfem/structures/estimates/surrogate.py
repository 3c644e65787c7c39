"""A body that is known without finite elements, for pre-runs.

    g(t) = rod of the patch's area and impedance, as long as its static compliance asks for + the plate's first mode

so that g(0+) = 1/(rho c_p A) is exact, and the static compliance is estimated. Waves come back undiminished from the
end of a rod, which a bulky body's do not: the surrogate asks for more of the band than the body will.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.exact.half_space import disk_compliance
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.estimates.patch import Patch

MODES: Final = 40  # of the surrogate's rod
SPREADING: Final = 0.2  # damping ratio that stands for waves which spread in three dimensions


@dataclass(frozen=True)
class Surrogate:
    """A stand-in for a body in pre-runs.

    Attributes:
        greens: the body, or what stands for it.
        exact: whether it is the body itself.
        words: what it is.
        patch: of a body of finite elements, where known.
    """

    greens: GreensFunction
    exact: bool
    words: str
    patch: Patch | None = None


@dataclass(frozen=True)
class Face:
    """The face that touches a body: its width [m], Young's modulus [Pa] and density [kg/m^3]."""

    width: float = 5e-3
    young: float = 200e9
    density: float = 7850.0


def of_patch(patch: Patch, damping: float) -> Surrogate:
    """Return a body behind a patch, whose modes have this damping ratio."""
    ratio = damping if patch.one_dimensional else max(damping, SPREADING)
    words = f"contact face of {1e6 * patch.area:.3g} mm^2, impedance {patch.impedance:.3g} N s/m"
    return Surrogate(_rod_behind(patch, ratio, damping), False, words, patch)


def unknown(what: str, face: Face) -> Surrogate:
    """Return a patch of the material of what strikes it, half as wide: all that is known of matrices and responses."""
    width, c_p = face.width, math.sqrt(1.35 * face.young / face.density)
    compliance = disk_compliance(young=face.young, poisson=0.3, radius=width / 4)
    patch = Patch(width**2 / 4, width / 2, width, compliance, face.density, c_p, 0.53 * c_p)
    words = f"{what}; here it is taken for a face {1e3 * width / 2:.2g} mm wide"
    return Surrogate(_rod_behind(patch, SPREADING, 0.0), False, words)


def ringing(greens: GreensFunction, ratio: float) -> GreensFunction:
    """Return what stands for a striker: it flies as its own damping ratio has it, waves that spread come back to it."""
    g = greens.modal
    return greens if g is None else replace(g, zeta=np.minimum(g.zeta, ratio))


def freed(greens: GreensFunction, mass: float) -> GreensFunction:
    """Return a body that nothing holds, of this mass [kg], from one that is held as long as its waves take to come
    back."""
    g = greens.modal
    if g is None:
        return greens
    omega, zeta = (np.concatenate([[0.0], values]) for values in (g.omega, g.zeta))
    shapes = np.concatenate([np.full((1, g.shapes.shape[1]), 1 / math.sqrt(mass)), g.shapes])
    return ModalGreens(omega, zeta, shapes, g.residual)


def _rod_behind(patch: Patch, ratio: float, bending_ratio: float) -> ModalGreens:
    length = patch.compliance * patch.density * patch.c_p**2 * patch.area
    omega = (np.arange(MODES) + 0.5) * math.pi * patch.c_p / length
    shapes = np.full(MODES, math.sqrt(2 / (patch.density * patch.area * length)))
    left_out = patch.compliance - float(np.sum(shapes**2 / omega**2))
    rest = Residual.exponential(left_out, 1 / patch.impedance)
    zeta = np.full(MODES, ratio)
    if patch.bending > 0:
        omega = np.append(omega, patch.bending_frequency)
        shapes = np.append(shapes, patch.bending_frequency * math.sqrt(patch.bending))
        zeta = np.append(zeta, bending_ratio)
    return ModalGreens(np.asarray(omega, dtype=np.float64), zeta, shapes[:, None], rest)
