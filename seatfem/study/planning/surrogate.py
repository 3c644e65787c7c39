"""A seat that is known without finite elements, for pre-runs.

    g(t) = rod of the patch's area and impedance, as long as its static compliance asks for + the plate's first mode

so that g(0+) = 1/(rho c_p A) is exact, and the static compliance is estimated. Waves come back undiminished from the
end of a rod, which a bulky body's do not: the surrogate asks for more of the band than the seat will.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

import impact
from impact.exact.half_space import disk_compliance
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.kinds.imported import FrequencyResponseFile, UniversalModes
from seatfem.structures.kinds.parts import AnyMaterial, Material
from seatfem.study.planning.patch import Patch, patch_of
from seatfem.study.scene import Cantilever, ElasticSeat, GreensFile, Rod, Scene, Spring

MODES: Final = 40  # of the surrogate's rod
SPREADING: Final = 0.2  # damping ratio that stands for waves which spread in three dimensions


@dataclass(frozen=True)
class Surrogate:
    """Attributes:
    greens: the seat, or what stands for it.
    exact: whether it is the seat itself.
    words: what it is.
    patch: of a drawn seat, where known.
    """

    greens: GreensFunction
    exact: bool
    words: str
    patch: Patch | None = None


def surrogate_of(scene: Scene) -> Surrogate:
    """The seat itself where it costs nothing, else what is known of it without a mesh."""
    seat = scene.seat
    match seat:
        case Rod():
            rod = impact.fixed_rod(
                young=seat.young,
                density=seat.density,
                area=seat.cross_section,
                length=seat.length,
                damping_ratio=seat.damping_ratio,
            )
            return Surrogate(rod, True, "the rod itself")
        case Spring():
            return Surrogate(impact.spring(stiffness=seat.stiffness), True, "the spring itself")
        case GreensFile():
            from seatfem.structures.inspection.imported import greens_of  # its readers take half a second to load

            return Surrogate(greens_of(seat, scene.run.duration), True, f"the function in {seat.file.name}")
        case UniversalModes():
            from seatfem.structures.inspection.imported import modes_of  # likewise

            return Surrogate(modes_of(seat), True, f"the modes in {seat.file.name}")
        case ElasticSeat():
            patch = patch_of(seat)
            ratio = _damping(seat) if patch.one_dimensional else max(_damping(seat), SPREADING)
            words = f"patch of {1e6 * patch.area:.3g} mm^2, impedance {patch.impedance:.3g} N s/m"
            return Surrogate(_of_patch(patch, ratio, _damping(seat)), False, words, patch)
        case _:
            return _unknown(scene)


def _of_patch(patch: Patch, ratio: float, bending_ratio: float) -> ModalGreens:
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


def _unknown(scene: Scene) -> Surrogate:
    """A patch of the reed's material, half as wide as the reed: all that is known of matrices and responses."""
    reed = scene.reed
    width = reed.width if isinstance(reed, Cantilever) else 5e-3
    material = reed.material if isinstance(reed, Cantilever) else None
    young, density = (material.young, material.density) if isinstance(material, Material) else (200e9, 7850.0)
    c_p = math.sqrt(1.35 * young / density)
    area = width**2 / 4
    compliance = disk_compliance(young=young, poisson=0.3, radius=width / 4)
    patch = Patch(area, width / 2, width, compliance, 0.0, 0.0, density, c_p, 0.53 * c_p, False)
    what = (
        "poles are fitted to the response by the run"
        if isinstance(scene.seat, FrequencyResponseFile)
        else ("matrices do not tell how large the struck face is")
    )
    words = f"{what}; here it is taken for a face {1e3 * width / 2:.2g} mm wide"
    return Surrogate(_of_patch(patch, SPREADING, 0.0), False, words)


def _damping(seat: ElasticSeat) -> float:
    """Of the seat's modes; Rayleigh damping counts as light."""
    material: AnyMaterial = seat.material
    return seat.damping_ratio + material.loss_factor / 2
