"""Base of the plates of constant thickness, free or clamped, of any outline."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar, Final, Self

import numpy as np
from pydantic import Field, model_validator

from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.notices import Advice, Progress, silent
from impact.quantities import percent
from seatfem import fields
from seatfem.structures import model, sheets
from seatfem.structures.errors import ModelError
from seatfem.structures.kinds import motion, selectors, structure
from seatfem.structures.kinds.parts import Material
from seatfem.structures.lip import AnyLip, Lip, Patch
from seatfem.structures.method import Applicability, Method, Solved, Task
from seatfem.structures.outlines import BodyViews, arc, covered_share, draw_sheet
from seatfem.structures.shapes import Flat
from seatfem.units import write_quantity

SHORTEST: Final = 1 / 6  # largest ratio of thickness to bending wavelength for which plate theory holds
HALF: Final = 0.5  # share of the stated disc or ring on the struck face below which it lies beside it
ROUND_OFF: Final = 1e-9  # relative tolerance for a contact that extends to the edge of the plate


class SheetMesh(fields.Table):
    """How fine the elements of a plate are."""

    sample: ClassVar[str] = 'size = "1 mm"'

    size: fields.Length | None = Field(None, description="element size; from the bandwidth where absent")


class PlateGreens(fields.Table):
    """How the Green's function of a plate is computed: by its eigenmodes."""

    sample: ClassVar[str] = 'bandwidth = "30 kHz"'

    bandwidth: fields.Frequency = fields.default(
        "100 kHz", "highest frequency that must be right; modes up to 3 times it are kept"
    )


FRONTS: Final = "5 us"  # filter width in sample scenes: force fronts of a flat landing are shorter than modal periods


class ThinPlate(motion.Moving):
    """Base of all flat plates that touch with a disc or a ring; computed by Mindlin plate elements."""

    traits: ClassVar[structure.Traits] = replace(motion.Moving.traits, needs_gmsh=True, has_weight=True, stress="field")
    _beside_greens: ClassVar[frozenset[str]] = frozenset({"velocity", "release", "deflection", "force"})
    shape: ClassVar[type[Flat]]
    """Class of the outline; its fields are keys of the table."""
    least_cover: ClassVar[float] = structure.LEAST_COVER
    about: ClassVar[str] = "the plate's centre"
    """Name of the point on which its contact is centred."""

    thickness: fields.Thickness = Field(description="thickness, in the direction of the motion")
    material: Material = fields.default(
        {"young": "200 GPa", "density": "7850 kg/m^3"}, "the reed's material; steel if absent"
    )
    damping_ratio: fields.DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    contact_radius: fields.Length | None = Field(
        None,
        description="radius of the disc that touches, or mean radius of the ring, in place of the struck face; absent: "
        "the plate meets that face all over, or, of a partner without one, touches with a disc of an eighth of the way "
        "from the contact's centre to the nearest edge, about a hole with a ring midway to that edge",
    )
    contact_width: fields.Length | None = Field(
        None,
        description="radial width of the ring of contact_radius, or of that which touches a partner without a struck "
        "face; absent: a disc does, or about a hole a ring of a quarter of what is there",
    )
    greens: PlateGreens = fields.default({}, "how the Green's function is computed")
    mesh: SheetMesh = fields.default({}, "how fine the elements are")

    @property
    def thin_plate(self) -> ThinPlate | None:
        return self

    def geometry(self) -> Flat:
        """Return the outline in SI units. Raises `GeometryError` if it cannot be built."""
        return fields.build_from_fields(self.shape, self)  # type: ignore[type-var]

    def outline_loops(self) -> tuple[Array, ...]:
        return self.geometry().drawn

    @model_validator(mode="after")
    def _contact_on_the_plate(self) -> Self:
        least, most = selectors.build_in_scene_words(self.geometry).room
        if (width := self.width) > 2 * self.radius:
            key = "contact_radius" if self.contact_width is None else "contact_width"
            raise fields.KeyProblem(
                key,
                f"{write_quantity(width, 'length')} must be at most twice contact_radius, "
                f"{write_quantity(self.radius, 'length')}",
            )
        lip = self.own_lip
        key = "contact_width" if self.contact_radius is None and self.contact_width is not None else "contact_radius"
        outer, inner, edge, hole = (write_quantity(each, "length") for each in (lip.outer, lip.inner, most, least))
        if lip.outer > most * (1 + ROUND_OFF):
            words = f"the contact reaches {outer} from {self.about}, it must stay below the plate's {edge}"
            raise fields.KeyProblem(key, words)
        if lip.inner < least * (1 - ROUND_OFF):
            words = f"the contact begins {inner} from {self.about}, it must begin beyond the hole, {hole}"
            raise fields.KeyProblem(key, words)
        return self

    def inputs(self) -> structure.Inputs:
        made = super().inputs()
        return replace(made, classes=(*made.classes, type(self.geometry())))

    @property
    def radius(self) -> float:
        """Return the radius of the disc that touches, or the mean radius of the ring [m]."""
        if self.contact_radius is not None:
            return self.contact_radius
        hole, edge = self.geometry().room
        return (hole + edge) / 2 if hole else edge / 8

    @property
    def width(self) -> float:
        """Return the width of the ring that touches [m]; 0: a disc does."""
        if self.contact_width is not None:
            return self.contact_width
        hole, edge = self.geometry().room
        return (edge - hole) / 4 if hole else 0.0

    @property
    def own_lip(self) -> Lip:
        """Return the disc or ring on the plate that touches, as the table states it."""
        return Lip(self.radius, self.width) if self.width else Lip.disc(self.radius)

    def views(self, *, coarse: bool = False) -> BodyViews:
        lip = self.own_lip
        contact = (arc(lip.outer), *((arc(lip.inner),) if lip.inner > 0 else ()))
        return draw_sheet(self.kind.replace("_", " "), self.geometry(), contact)

    def levels(self) -> tuple[Applicability, ...]:
        return (Applicability("closed form", True, 0.0, f"kind = {self.kind!r}: the modes of a plate"),)

    def limits(self) -> tuple[Advice, ...]:
        """Return advice if bending waves at the band edge are shorter than six thicknesses."""
        wave = self.sheet().bending_wave(self.greens.bandwidth)
        if (relative := self.thickness / wave) <= SHORTEST:
            return ()
        return (
            Advice(
                "reed.thickness over its bending wave at reed.greens.bandwidth",
                relative,
                SHORTEST,
                "plate theory fails for waves so short (2 % of g at 1/4, 8 % at 1/3); the uncertainty leaves it out",
                f"use reed.greens.bandwidth <= "
                f"{write_quantity(self.greens.bandwidth * (SHORTEST / relative) ** 2, 'frequency', 3)}, or a solid "
                "reed, of kind = 'cad' or 'mesh'",
            ),
        )

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        return replace(super().stated(error, rings), bandwidth=self.greens.bandwidth, size=self.mesh.size)

    @property
    def band_limit(self) -> tuple[float, str]:
        """Return the widest band whose modes have bending waves of at least six thicknesses and are not too many."""
        own, sheet, most = self.greens.bandwidth, self.sheet(), sheets.MOST_MODES
        by_theory = own * (SHORTEST * sheet.bending_wave(own) / self.thickness) ** 2 / sheets.CUTOFF
        by_count = own * (most - 1) / sheet.mode_count
        too_short = "bending waves are shorter than six thicknesses: take a solid reed, kind = 'cad' or 'mesh'"
        too_many = f"the reed has more than {most} modes in reach: state a longer run.filter_width"
        return min((by_theory, too_short), (by_count, too_many))

    def sheet(self, band: float = 0.0) -> sheets.Sheet:
        """Return the data that determine its modes; ``band``: in place of the key [Hz], if not 0."""
        return sheets.Sheet(self.geometry(), self.material.solid, band or self.greens.bandwidth, self.mesh.size)

    def meets(self, face: AnyLip | None) -> AnyLip | None:
        return face

    def lips(self, face: AnyLip | None, behind: AnyLip | None = None) -> tuple[AnyLip, ...]:
        return (self.own_lip, *(each for each in (behind, face) if each is not None))

    @property
    def states_contact(self) -> bool:
        return self.contact_radius is not None

    def covering(self) -> Self:
        return self.model_copy(update={"contact_radius": None, "contact_width": None})

    def solved(self, method: Method, *, mesh_error: bool = True, progress: Progress = silent) -> sheets.SolvedSheet:
        """Return its modes and its Green's function, cached in the process."""
        asked = self.sheet(method.bandwidth or 0.0), self.lips(method.lip, method.behind), self.damping_ratio
        return sheets.solved_sheet(*asked, mesh_error=mesh_error, watched=sheets.Watched(progress))

    def plate(self, greens: GreensFunction) -> sheets.PlateModes:
        """Return the modes behind its Green's function, cached in the process."""
        band, coarser = (greens.provenance.get(name) for name in ("bandwidth_Hz", "coarser"))
        sheet = self.sheet(band if isinstance(band, float) else 0.0)
        return sheets.plate_modes(sheet, coarser) if isinstance(coarser, float) else sheets.plate_modes(sheet)

    def solve_in_wider_band(
        self, greens: GreensFunction, lips: tuple[AnyLip, ...], progress: Progress = silent
    ) -> tuple[GreensFunction, float] | None:
        beyond = sheets.solve_in_wider_band(self.plate(greens), progress)
        return beyond and (beyond[0].greens(lips, self.damping_ratio), beyond[1])

    def system_of_equations(self) -> model.SecondOrderModel:
        return sheets.model_of(self.sheet(), self.lips(None))

    def solve(self, task: Task) -> Solved:
        with task.watch("reduction"):
            solved = self.solved(task.method, mesh_error=task.mesh_error, progress=task.progress)
            model, modes = solved.plate.model, solved.plate.modes
        about = {"seat_model": f"Mindlin plate, {len(modes.omega)} modes", "seat_dof": model.size}
        return Solved(solved.greens, model=model, modes=modes, about=about)

    def cover_doubts(
        self, seat: structure.Structure, at: float, offset: tuple[float, float], arcs: int
    ) -> Iterator[structure.Finding]:
        """Yield a doubt if less than `HALF` of the disc or ring with which the plate is stated to touch lies on the
        struck face, as over an open port: what is stated counts."""
        if not self.states_contact or arcs > 1:
            return
        try:
            over, face = self.views(coarse=True).turned_over(), seat.views(coarse=True)
        except ModelError:  # a partner without a face
            return
        x, y = offset
        share = covered_share(over, replace(face, plan=face.contact), (-x, -y)) if face.contact else None
        if share is None or share >= HALF:
            return
        what = "ring" if self.width else "disc"
        yield (
            ("reed", "contact_radius"),
            f"{write_quantity(self.radius, 'length', 3)}: in plan {percent(share)} of this {what} lies on the seat's "
            "struck face, the rest over a port or beside it; remove contact_radius and contact_width, so that the reed "
            "meets the face as far as it covers it, or change the contact's place and radius",
        )

    def contact_problems(self, at: float | None, seat: structure.Structure) -> fields.Contradictions:
        yield from super().contact_problems(at, seat)
        if not self.states_contact:
            yield from seat.covered_problems(self.contact_width)

    def parts_problems(self, key: str) -> fields.Contradictions:
        yield from ()

    def check_place(self, place: structure.Place, key: str) -> None:
        """Check a distance; points are checked later, on the mesh."""
        if not isinstance(place, np.ndarray):
            super().check_place(place, key)

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        if not isinstance(place, np.ndarray):
            return super().pushed_at(body, place, by)
        plate = self.plate(body.greens)
        patches = (Patch(plate.sheet.shape.centre + point[None, :], np.ones(1)) for point in place)
        return np.column_stack([plate.at(patch, "the place of a spring or force") for patch in patches])

    def weight(self, body: Body) -> tuple[Array, float]:
        plate = self.plate(body.greens)
        return plate.mean, plate.mass

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        return super().body(self.solved(self.stated()).greens if greens is None else greens, n_modes, at)
