"""Plates of Mindlin elements: from the outline to the Green's function by eigenmodes, computed or found on file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from impact.files.safe_files import MB
from impact.greens.base import Array, ErrorEstimate
from impact.greens.modal import ModalGreens
from impact.notices import Progress, silent
from impact.quantities import brief
from impact.storage import hdf5
from seatfem.structures.cache import content_key, load_or_compute
from seatfem.structures.elements import mindlin
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.lip import AnyLip, Lip, Patch
from seatfem.structures.materials import Material
from seatfem.structures.mesh.plane_meshes import CLAMPED, mesh_sheet
from seatfem.structures.method import COARSENING, Aims
from seatfem.structures.model import DofMap, ModelError, SecondOrderModel
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.reduction.modes import Modes, modes_by_parity, solve_modes
from seatfem.structures.rings import CONTACT
from seatfem.structures.shapes import Flat, fingerprint
from seatfem.units import write_quantity

CUTOFF: Final = 3.0  # highest frequency of the modes, over the band
PER_WAVELENGTH: Final = 5.0  # elements per bending wave there: g of a disc smaller than they are is right to 0.3 %
ACROSS: Final = 3.0  # fewest elements across the narrowest part
WIDTHS: Final = 100  # time over which errors are judged, in widths of the band's pulse
INSTANTS: Final = 600  # instants at which errors are judged
PUSHED: Final = 8  # ports, all around a lip, under whose pushes errors are judged
THICKEST: Final = 1 / 3  # largest thickness over the bending wave at the band: tests/structures/test_free_plates.py
MOST_MODES: Final = 600  # most modes: a gigabyte and a minute
MOST_ELEMENTS: Final = 20_000
UNKNOWNS: Final = 17  # for each square of the element size: meshes have up to 1.4 elements there
OF_AN_UNKNOWN, OF_A_MODE = 700, 4.5  # floats at the peak, of matrices and factor, and of each mode
TOLERANCE: Final = 0.1  # tolerance that the modes are computed to; what they leave is stated, whatever it is
ORDER: Final = 2.0  # order of the error between two meshes; corners take away half of the elements' four


@dataclass(frozen=True)
class Sheet:
    """A plate, and the band and mesh of its modes.

    Attributes:
        shape, material: of the plate.
        bandwidth: highest frequency that must be right [Hz].
        size: of the elements [m]; ``None``: from the bandwidth.
    """

    shape: Flat
    material: Material
    bandwidth: float
    size: float | None = None

    def bending_wave(self, frequency: float) -> float:
        """Return the length of bending waves, 2 pi (D/(rho h))^(1/4)/sqrt(omega) [m], at a frequency [Hz]."""
        rigidity = self.material.young * self.shape.thickness**2 / (12 * (1 - self.material.poisson**2))
        speed = (rigidity / self.material.density) ** 0.25
        return float(2 * math.pi * speed / math.sqrt(2 * math.pi * frequency))

    @property
    def element_size(self) -> float:
        """Return the element size [m], a fifth of the bending wave at the cutoff."""
        if self.size is not None:
            return self.size
        wave = self.bending_wave(CUTOFF * self.bandwidth)
        return min(wave / PER_WAVELENGTH, self.shape.narrowest / ACROSS)

    def memory(self, modes: float) -> float:
        """Return the bytes at the peak of finding so many modes: five plates of 12,000 to 104,000 unknowns took 0.87 to
        1.15 times this, smaller ones 20 MB more."""
        return 8 * UNKNOWNS * self.shape.area / self.element_size**2 * (OF_AN_UNKNOWN + OF_A_MODE * modes)

    def weighed(self, mesh: PlateMesh) -> Material:
        """Return the material, so that the plate on a mesh has the drawing's mass: a free one flies by nothing else."""
        return replace(self.material, density=self.material.density * self.shape.area / mesh.area)

    @property
    def mode_count(self) -> float:
        """Return the expected number of modes up to `CUTOFF` times the band: A k^2/(4 pi) lie below wave k."""
        return math.pi * self.shape.area / self.bending_wave(CUTOFF * self.bandwidth) ** 2

    def check(self) -> None:
        """Raise `ModelError` of waves in the band that are no plate's, and of what would take too many modes or
        elements."""
        thickness = self.shape.thickness
        if (relative := thickness / self.bending_wave(self.bandwidth)) > THICKEST:
            raise ModelError(
                f"reed.thickness = {1e3 * thickness:.4g} mm is {relative:.2g} of a bending wave at "
                f"reed.greens.bandwidth = {write_quantity(self.bandwidth, 'frequency', 4)} (limit {THICKEST:.2g}), "
                f"where a plate answers "
                "otherwise than the solid by 8 % and more: lower reed.greens.bandwidth to "
                f"{write_quantity(self.bandwidth * (THICKEST / relative) ** 2, 'frequency', 3)}, take a thinner "
                f"reed, or a solid one, of kind = "
                "'cad' or 'mesh'"
            )
        if (count := self.mode_count) > MOST_MODES:
            raise ModelError(
                f"reed.greens.bandwidth = {write_quantity(self.bandwidth, 'frequency', 4)}: the plate has about "
                f"{count:.3g} modes below "
                f"{CUTOFF:g} times it (limit {MOST_MODES}); lower it to "
                f"{write_quantity(self.bandwidth * MOST_MODES / count, 'frequency', 3)}"
            )
        if (elements := self.shape.area / self.element_size**2) > MOST_ELEMENTS:
            raise ModelError(
                f"reed.mesh.size = {1e3 * self.element_size:.3g} mm makes about {elements:.3g} elements (limit "
                f"{MOST_ELEMENTS}): enlarge it to {1e3 * math.sqrt(self.shape.area / MOST_ELEMENTS):.3g} mm; where it "
                "is not stated, a wider neck has larger ones"
            )


@dataclass(frozen=True, eq=False)
class PlateModes:
    """The modes of a plate on one mesh, whatever touches it.

    Attributes:
        sheet, mesh: of the plate.
        modes: all up to `CUTOFF` times the band.
        coarser: ratio of its elements to those that were asked for.
        assembled: the model, where it is at hand.
    """

    sheet: Sheet
    mesh: PlateMesh
    modes: Modes
    coarser: float = 1.0
    assembled: SecondOrderModel | None = None

    __repr__ = brief

    @cached_property
    def model(self) -> SecondOrderModel:
        """Return the model without ports."""
        return _model(self.sheet, self.mesh) if self.assembled is None else self.assembled

    @cached_property
    def dofs(self) -> DofMap:
        """Return the model's unknowns."""
        return mindlin.plate_dofs(self.mesh, clamped=_clamped(self.sheet))

    def at(self, patch: Patch, name: str) -> Array:
        """Return the (m,) mean of the modes over a patch [1/sqrt(kg)]. Raises `ModelError` of one that lies off it."""
        return np.asarray(self.modes.shapes.T @ mindlin.average(self.mesh, patch, names=[name])[0][self.dofs.free])

    def shape_at(self, amplitudes: Array, points: Array) -> Array:
        """Return the (q,) deflections at points (q, 2), of modal amplitudes (m,) [m]. Raises as `at`."""
        return mindlin.deflections(self.mesh, self.field(amplitudes)[:, 0], points)

    def field(self, amplitudes: Array) -> Array:
        """Return the (n, 3) deflection [m] and rotations a of the nodes, of modal amplitudes (m,)."""
        full = np.zeros((len(self.mesh.points), 3))
        full.ravel()[self.dofs.free] = self.modes.shapes @ amplitudes
        return full / (1.0, self.mesh.side, self.mesh.side)

    def projected(self, nodal: Array) -> tuple[Array, float]:
        """Return the (m,) modal amplitudes q = Phi'M w of deflections (n,) at the nodes, and 1 - q'q/(w'M w), what they
        leave."""
        field = (nodal[:, None] * (1.0, 0.0, 0.0)).ravel()[self.dofs.free]
        image = self.model.M @ field
        amplitudes, square = np.asarray(self.modes.shapes.T @ image), float(field @ image)
        return amplitudes, 1 - float(amplitudes @ amplitudes) / square if square else 0.0

    @cached_property
    def centre(self) -> Array:
        """Return the (m,) deflections of the modes at the contact's centre, or their mean on a ring about the hole
        there [1/sqrt(kg)]."""
        shape = self.sheet.shape
        point, (hole, edge) = Patch(np.array([shape.centre]), np.ones(1)), shape.room
        ring = None if not hole else Lip((hole + edge) / 2, (edge - hole) / 4).patches(shape.centre)[CONTACT]
        return self.at(ring or point, "the contact's centre")

    @property
    def mean(self) -> Array:
        """Return the (m,) mean of the modes over the whole plate [1/sqrt(kg)]."""
        return np.asarray(self.modes.shapes.T @ mindlin.everywhere(self.mesh)[self.dofs.free])

    @property
    def mass(self) -> float:
        """Return the mass rho h A [kg]."""
        return self.sheet.material.density * self.sheet.shape.thickness * self.mesh.area

    def with_ports(self, lips: Sequence[AnyLip]) -> SecondOrderModel:
        """Return the model with a port for each part of the lips. Raises `ModelError` of one that reaches off the
        plate."""
        patches = patches_of(self.sheet, lips)
        try:
            ports = mindlin.plate_ports(self.mesh, patches, self.sheet.material, self.dofs.free)
        except ModelError as error:
            if len(lips) == 1:
                raise
            behind = [lip for lip in lips if lip.side and repr(lip.side)[:-1] in str(error)]
            raise _off_the_plate(self.sheet, (behind or lips)[-1], error) from error
        return replace(self.model, ports=ports, known=self.model.damping)

    def greens(self, lips: Sequence[AnyLip], damping_ratio: float) -> ModalGreens:
        """Return the Green's function of the ports of these lips; raises as `with_ports`."""
        model, band = self.with_ports(lips), self.sheet.bandwidth
        aims = Aims(band, WIDTHS / band, TOLERANCE)
        pushed = range(0, len(model.ports), max(1, len(model.ports) // PUSHED))
        damping = model.damping.plus(damping_ratio)
        greens = with_modes(model, damping, self.modes, CUTOFF * band, aims, pushed)
        origin = {"method": "modes", "bandwidth_Hz": band, "damping_ratio": damping_ratio, "dof": model.size}
        if self.coarser != 1.0:
            origin["coarser"] = self.coarser
        mesh = f"{len(self.mesh.cells)} Mindlin elements of nine nodes"
        return greens.with_error(greens.error, {**greens.origin, **origin, "mesh": mesh})


def _off_the_plate(sheet: Sheet, lip: AnyLip, error: ModelError) -> ModelError:
    """Return the error in words of the scene: the lip is the seat's, or the stopper's."""
    x, y = (1e3 * (a + b) for a, b in zip(sheet.shape.centre, lip.offset, strict=True))
    least, most = (1e3 * radius for radius in sheet.shape.room)
    what, remedy = "contact.offset: the seat's lip", "change the offset, or reed and seat until the lip lies on it"
    if lip.side:
        what, remedy = "stopper.arcs: the stopper's face", "take a smaller stopper, or remove arcs, rings and tilt"
    return ModelError(
        f"{what}, from {1e3 * lip.inner:.4g} to {1e3 * lip.outer:.4g} mm about ({x:.4g}, {y:.4g}) mm, reaches off the "
        f"reed, which has {f'{least:.4g} to ' if least else ''}{most:.4g} mm there: {remedy} ({error})"
    )


@dataclass(frozen=True)
class SolvedSheet:
    """The plate's Green's function and what is behind it.

    Attributes:
        greens: of the lip's ports, with its error estimates.
        plate: the modes behind it.
    """

    greens: ModalGreens
    plate: PlateModes


def patches_of(sheet: Sheet, lips: Sequence[AnyLip]) -> Mapping[str, Patch]:
    """Return the patches of several lips by the names of their ports; where these are the same, the last one's."""
    return {name: patch for lip in lips for name, patch in lip.patches(sheet.shape.centre).items()}


@dataclass(frozen=True)
class Watched:
    """A request for a plate's modes has, besides the plate, what helps to compute them; all requests are equal, so that
    caches take no notice of them.

    Attributes:
        progress: receives the progress.
        lower: the same plate on the same mesh with its modes in a narrower band, which are not computed again.
    """

    progress: Progress = field(default=silent, compare=False)
    lower: PlateModes | None = field(default=None, compare=False)


@lru_cache(maxsize=4)
def solved_sheet(
    asked: Sheet,
    lips: tuple[AnyLip, ...],
    damping_ratio: float,
    *,
    mesh_error: bool = True,
    watched: Watched = Watched(),
) -> SolvedSheet:
    """Return the plate with the ports of these lips by its eigenmodes up to three times the band.

    With ``mesh_error`` on two meshes, whose difference over r^2 - 1 is the error: against meshes twice as fine, twelve
    reeds of two shapes were off by a half of that at most. Never by Krylov vectors of the ports: they miss modes that
    these hardly see, whose compliance then acts at once.

    Raises:
        GeometryError, MeshingError, MeshError, ModelError, ConvergenceError: what the stages raise.
    """
    plate = plate_modes(asked, progress=watched.progress)
    fine = plate.greens(lips, damping_ratio)
    if not mesh_error:
        return SolvedSheet(fine, plate)
    coarser = plate_modes(asked, COARSENING, watched.progress)
    coarse = coarser.greens(lips, damping_ratio)
    width = 1 / asked.bandwidth
    t = np.linspace(0.0, WIDTHS * width, INSTANTS)
    right, off = (each.filtered_matrix(t, width, [0]) for each in (fine, coarse))
    off_by = float(np.max(np.abs(right - off)) / np.max(np.abs(right))) / (refinement(plate, coarser) ** ORDER - 1)
    error = ErrorEstimate(fine.error.reduction, off_by)
    return SolvedSheet(fine.with_error(error, fine.origin), plate)


def refinement(fine: PlateModes, coarse: PlateModes) -> float:
    """Return the element size of the coarser mesh over that of the other, by their numbers of elements."""
    return float(np.clip(math.sqrt(len(fine.mesh.cells) / len(coarse.mesh.cells)), 1.1, COARSENING))


def plate_modes(
    asked: Sheet, coarser: float = 1.0, progress: Progress = silent, lower: PlateModes | None = None
) -> PlateModes:
    """Return the plate on its mesh, or one of elements ``coarser`` times as large; found once in a process, and kept on
    file.

    ``lower``: as in `Watched`. Raises as `solved_sheet`.
    """
    return modes_in_process(asked, coarser, Watched(progress, lower))


@lru_cache(maxsize=4)
def modes_in_process(asked: Sheet, coarser: float, watched: Watched) -> PlateModes:
    """Return the plate of `plate_modes`, which is made once in a process whoever watches."""

    fresh: list[SecondOrderModel] = []

    def compute() -> tuple[PlateMesh, Modes]:
        lower, known = watched.lower, None
        if lower is None:
            mesh = _mesh(asked, coarser)
            model = _model(asked, mesh)
        else:
            asked.check()
            mesh, model, known = lower.mesh, lower.model, (CUTOFF * lower.sheet.bandwidth, lower.modes)
        fresh.append(model)
        up_to, progress = CUTOFF * asked.bandwidth, watched.progress
        modes = modes_by_parity(model, mesh.points, up_to_hz=up_to, known=known, progress=progress)
        if not len(modes.omega):
            lowest = write_quantity(float(solve_modes(model, 1).frequencies_hz[0]), "frequency", 3)
            band = write_quantity(asked.bandwidth, "frequency", 4)
            raise ModelError(
                f"reed.greens.bandwidth = {band}: the plate has no mode below {CUTOFF:g} times it, its lowest is at "
                f"{lowest}; raise it to that at least"
            )
        return mesh, modes

    mesh, modes = _kept(asked, coarser, compute)
    return PlateModes(asked, mesh, modes, coarser, *fresh)


BEYOND: Final = (2.5, 1.6, 1.25)
"""Band of the comparison that tells what a plate's modes beyond its own leave, over that one, the first that plate
theory and the number of modes allow. Of 16 drawn flappers 2.5 showed 0.9 to 1.3 times what four times the band changed
of stress where that was more than 1 %."""


def solve_in_wider_band(plate: PlateModes, progress: Progress = silent) -> tuple[PlateModes, float] | None:
    """Return the plate with the modes of a wider band, on elements of the same size, and its ratio to the plate's own
    band; ``None`` where plate theory or the number of modes allows none."""
    for ratio in BEYOND:
        wider = replace(plate.sheet, bandwidth=ratio * plate.sheet.bandwidth)
        try:
            coarser = plate.coarser * plate.sheet.element_size / wider.element_size
            return plate_modes(wider, coarser, progress, plate), ratio
        except ModelError:
            continue
    return None


def model_of(asked: Sheet, lips: Sequence[AnyLip]) -> SecondOrderModel:
    """Return the plate's matrices, with a port for each part of the lips. Raises as `solved_sheet`."""
    return _model(asked, _mesh(asked), patches_of(asked, lips))


def _mesh(asked: Sheet, coarser: float = 1.0) -> PlateMesh:
    asked.check()
    return mesh_sheet(asked.shape, coarser * asked.element_size)


def _model(asked: Sheet, mesh: PlateMesh, ports: Mapping[str, Patch] = MappingProxyType({})) -> SecondOrderModel:
    return mindlin.assemble_plate(
        mesh, asked.weighed(mesh), asked.shape.thickness, clamped=_clamped(asked), ports=ports
    )


def _clamped(asked: Sheet) -> str | tuple[str, ...]:
    return CLAMPED if asked.shape.is_clamped else ()


MOST: Final = 1024 * MB  # most bytes of all cached plates: the longest unused are dropped
Meshed = tuple[PlateMesh, Modes]


def _kept(asked: Sheet, coarser: float, compute: Callable[[], Meshed]) -> Meshed:
    """Return the mesh and modes of a plate as they are on file, else as ``compute`` finds them, which are then kept."""
    parts = {**vars(asked), "shape": fingerprint(asked.shape), "material": vars(asked.material)}
    key = content_key({"modes of": parts, "coarser": coarser})
    return load_or_compute(
        "plates", key, compute, content="modes of a plate", read=_read, write=_write, most_bytes=MOST
    )


def _write(file: Any, meshed: Meshed) -> None:
    mesh, modes = meshed
    file.attrs["modes"] = json.dumps({name: getattr(modes, name) for name in ("complete", "backend", "solves")})
    for name in ("points", "cells"):
        file[name] = getattr(mesh, name)
    for name, nodes in mesh.lines.items():
        file[f"lines/{name}"] = nodes
    for name in ("frequencies_hz", "shapes", "residuals"):
        file[f"modes/{name}"] = getattr(modes, name)


def _read(file: Any) -> Meshed:
    lines = {name: hdf5.finite_array(file, f"lines/{name}").astype(int) for name in file.get("lines", ())}
    mesh = PlateMesh(hdf5.finite_array(file, "points"), hdf5.finite_array(file, "cells").astype(int), lines)
    frequencies, shapes, residuals = (
        hdf5.finite_array(file, f"modes/{name}") for name in ("frequencies_hz", "shapes", "residuals")
    )
    return mesh, Modes(frequencies, shapes, residuals, **json.loads(str(file.attrs["modes"])))
