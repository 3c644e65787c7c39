"""Flat reeds of Mindlin elements: from the outline to the Green's function by eigenmodes, and its error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction
from seatfem.structures.elements.mindlin import Patch, PlateMesh, assemble_plate, average, disc, ring
from seatfem.structures.materials import Material
from seatfem.structures.mesh.gmsh_process import GmshSession
from seatfem.structures.mesh.sheet import ROOT, mesh_flapper
from seatfem.structures.method import COARSENING
from seatfem.structures.model import DofMap, ModelError, SecondOrderModel
from seatfem.structures.reduction.greens import reduce_model
from seatfem.structures.reduction.modes import Modes
from seatfem.structures.shapes import Flapper

PORT: Final = "contact"
CUTOFF: Final = 3.0  # times the band, up to which modes are found
PER_WAVELENGTH: Final = 5.0  # elements per bending wave there: g is right to 0.3 % on a disc smaller than they are
ACROSS: Final = 3.0  # elements across the neck, at least
WIDTHS: Final = 100  # of pulses of the band, over which errors are judged
MOST_MODES: Final = 600  # a gigabyte and a minute
MOST_ELEMENTS: Final = 20_000
TOLERANCE: Final = 0.1  # of the modes: with more left out, more are taken
ORDER: Final = 2.0  # of the error between two meshes; corners take away half of the elements' four


@dataclass(frozen=True)
class Sheet:
    """What is asked: a clamped flat reed that is struck about its paddle's centre.

    Attributes:
        shape, material: of the reed.
        radius: of the struck disc, or mean radius of the struck ring [m].
        width: of that ring [m]; ``None``: a disc.
        bandwidth: highest frequency that must be right [Hz].
        damping_ratio: of every mode.
        size: of the elements [m]; ``None``: from the bandwidth.
    """

    shape: Flapper
    material: Material
    radius: float
    width: float | None
    bandwidth: float
    damping_ratio: float = 0.0
    size: float | None = None

    @property
    def patch(self) -> Patch:
        """The struck patch."""
        centre = self.shape.centre
        return disc(centre, self.radius) if self.width is None else ring(centre, self.radius, self.width)

    def bending_wave(self, frequency: float) -> float:
        """Length of bending waves, 2 pi (D/(rho h))^(1/4)/sqrt(omega) [m], at a frequency [Hz]."""
        rigidity = self.material.young * self.shape.thickness**2 / (12 * (1 - self.material.poisson**2))
        speed = (rigidity / self.material.density) ** 0.25
        return float(2 * math.pi * speed / math.sqrt(2 * math.pi * frequency))

    @property
    def element_size(self) -> float:
        """[m]; a fifth of the bending wave at the cutoff."""
        if self.size is not None:
            return self.size
        wave = self.bending_wave(CUTOFF * self.bandwidth)
        return min(wave / PER_WAVELENGTH, self.shape.neck_width / ACROSS)

    def check(self) -> None:
        """Raise `ModelError` of what would take too many modes or elements: A k^2/(4 pi) modes lie below wave k."""
        count = math.pi * self.shape.area / self.bending_wave(CUTOFF * self.bandwidth) ** 2
        if count > MOST_MODES:
            raise ModelError(
                f"reed.greens.bandwidth = {self.bandwidth:.4g} Hz: the plate has about {count:.3g} modes below "
                f"{CUTOFF:g} times it (limit {MOST_MODES}); lower it to {self.bandwidth * MOST_MODES / count:.3g} Hz"
            )
        if (elements := self.shape.area / self.element_size**2) > MOST_ELEMENTS:
            raise ModelError(
                f"reed.mesh.size = {1e3 * self.element_size:.3g} mm makes about {elements:.3g} elements (limit "
                f"{MOST_ELEMENTS}): enlarge it to {1e3 * math.sqrt(self.shape.area / MOST_ELEMENTS):.3g} mm; where it "
                "is not stated, a wider neck has larger ones"
            )


@dataclass(frozen=True)
class SolvedSheet:
    """The reed's Green's function and what is behind it.

    Attributes:
        greens: of the port "contact", with its error estimates.
        model, modes: behind it.
        centre: (m,) of the modes at the paddle's centre [1/sqrt(kg)].
    """

    greens: GreensFunction
    model: SecondOrderModel
    modes: Modes
    centre: Array


@lru_cache(maxsize=4)
def solved_sheet(asked: Sheet) -> SolvedSheet:
    """The reed by its eigenmodes up to three times the band, on two meshes whose difference over r^2 - 1 is the error.

    Against meshes twice as fine, twelve reeds of two shapes were off by a half of that at most.

    Never by Krylov vectors of the port: they miss modes that it hardly sees, whose compliance then acts at once.

    Raises:
        GeometryError, MeshingError, MeshError, ModelError, ConvergenceError: what the stages raise.
    """
    asked.check()
    with GmshSession() as gmsh:
        fine, coarse = (
            mesh_flapper(asked.shape, size, gmsh=gmsh) for size in (asked.element_size, COARSENING * asked.element_size)
        )
    solved, other = _on(fine, asked), _on(coarse, asked)
    width = 1 / asked.bandwidth
    t = np.linspace(0.0, WIDTHS * width, 2000)
    right, off = solved.greens.filtered(t, width), other.greens.filtered(t, width)
    ratio = float(np.clip(math.sqrt(len(fine.cells) / len(coarse.cells)), 1.1, COARSENING))
    mesh_error = float(np.max(np.abs(right - off)) / np.max(np.abs(right))) / (ratio**ORDER - 1)
    error = ErrorEstimate(solved.greens.error_estimate.reduction, mesh_error)
    known = {key: value for key, value in solved.greens.provenance.items() if key != "advice"}  # to use Krylov vectors
    origin = {**known, "mesh": f"{len(fine.cells)} Mindlin elements of nine nodes"}
    return SolvedSheet(solved.greens.with_error(error, origin), solved.model, solved.modes, solved.centre)


def model_of(asked: Sheet) -> SecondOrderModel:
    """The reed's matrices, with its port. Raises as `solved_sheet`."""
    asked.check()
    return _assembled(mesh_flapper(asked.shape, asked.element_size), asked)


def _assembled(mesh: PlateMesh, asked: Sheet) -> SecondOrderModel:
    thickness, ports = asked.shape.thickness, {PORT: asked.patch}
    return assemble_plate(mesh, asked.material, thickness, clamped=ROOT, ports=ports)


def _on(mesh: PlateMesh, asked: Sheet) -> SolvedSheet:
    model = _assembled(mesh, asked)
    reduction = reduce_model(
        model,
        bandwidth=asked.bandwidth,
        duration=WIDTHS / asked.bandwidth,
        tolerance=TOLERANCE,
        damping_ratio=asked.damping_ratio,
        method="modes",
    )
    modes, dofs = reduction.modes, model.dofs
    assert modes is not None
    assert isinstance(dofs, DofMap)
    centre = average(mesh, Patch(np.array([asked.shape.centre]), np.ones(1)), "the paddle's centre")[dofs.free]
    return SolvedSheet(reduction.greens, model, modes, modes.shapes.T @ centre)
