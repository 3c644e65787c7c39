"""The flapper: a flat reed with a round paddle, by plate elements."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from impact.advice import Advice
from impact.progress import Progress
from seatfem.fields import DampingRatio, Frequency, KeyProblem, Length, Table, default, of_same_names
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.surrogate import Face, Surrogate
from seatfem.structures.kinds.materials import Material
from seatfem.structures.kinds.plate_loads import LoadedPlate
from seatfem.structures.kinds.selectors import in_scene_words
from seatfem.structures.lip import Lip
from seatfem.structures.method import Applicability, Method
from seatfem.structures.shapes.flapper import Flapper as Outline
from seatfem.structures.solved import Solved

if TYPE_CHECKING:
    from seatfem.structures.natural_modes import NaturalModes, Wanted
    from seatfem.structures.sheets import Sheet, SolvedSheet

SHORTEST: Final = 1 / 6  # thickness over a bending wave that is a plate's


class SheetMesh(Table):
    """How fine the elements of a plate are."""

    size: Length | None = Field(None, description="element size; from the bandwidth where absent")


class PlateGreens(Table):
    """How the Green's function of a plate is computed: by its eigenmodes."""

    bandwidth: Frequency = default("100 kHz", "highest frequency that must be right; modes up to 3 times it are kept")


class Flapper(LoadedPlate):
    """A flat reed of even thickness: a clamped root that tapers to a neck, and a round paddle; it touches with a disc
    or a ring about the paddle's centre. By Mindlin plate elements: it twists, and its paddle bends across."""

    needs_gmsh: ClassVar[bool] = True
    meets_lips: ClassVar[bool] = True

    kind: Literal["flapper"]
    root_width: Length = Field(description="width where it is clamped")
    taper_length: Length = Field(description="from the root, over which it narrows to the neck")
    neck_width: Length = Field(description="width of the neck")
    neck_length: Length = Field(description="from the clamped root to where the neck meets the paddle")
    paddle_diameter: Length = Field(description="diameter of the paddle")
    thickness: Length = Field(description="thickness, in the direction of the motion")
    material: Material = default({"young": "200 GPa", "density": "7850 kg/m^3"}, "the reed's material; steel if absent")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    contact_radius: Length | None = Field(
        None, description="radius of the disc that touches, or mean radius of the ring; absent: paddle_diameter/16"
    )
    contact_width: Length | None = Field(None, description="radial width of the ring that touches; absent: a disc does")
    greens: PlateGreens = default({}, "how the Green's function is computed")
    mesh: SheetMesh = default({}, "how fine the elements are")

    @model_validator(mode="after")
    def _as_drawn(self) -> Self:
        outline = in_scene_words(self.geometry)
        if self.contact_width is not None and self.contact_width > 2 * self.radius:
            raise KeyProblem(
                "contact_width", f"{self.contact_width:g} m is more than twice contact_radius, {self.radius:g} m"
            )
        reach, paddle = self.radius + (self.contact_width or 0.0) / 2, outline.paddle_diameter / 2
        if reach > paddle * (1 + 1e-9):
            raise KeyProblem(
                "contact_radius", f"the contact reaches {reach:g} m from the paddle's centre, the paddle {paddle:g} m"
            )
        if self.pressure_radius is not None and self.pressure_radius > paddle:
            raise KeyProblem("pressure_radius", f"{self.pressure_radius:g} m is more than the paddle's, {paddle:g} m")
        if self.velocity is not None:
            raise KeyProblem("velocity", 'a clamped reed cannot translate; write release = { velocity = "-2 m/s" }')
        return self

    def geometry(self) -> Outline:
        """The outline in SI units. Raises `GeometryError` where it cannot be built."""
        return of_same_names(Outline, self)

    def made_by(self) -> tuple[type, ...]:
        return (*super().made_by(), Outline)

    @property
    def axis(self) -> float:
        return self.geometry().length

    @property
    def radius(self) -> float:
        """Of the disc that touches, or mean radius of the ring [m]."""
        return self.paddle_diameter / 16 if self.contact_radius is None else self.contact_radius

    @property
    def face(self) -> Face:
        return Face(self.contact_width or 2 * self.radius, self.material.young, self.material.density)

    @property
    def loss(self) -> float:
        return self.damping_ratio

    def levels(self, band: float | None = None) -> tuple[Applicability, ...]:
        return (Applicability("closed form", True, 0.0, "kind = 'flapper': the modes of a plate"),)

    def limits(self) -> tuple[Advice, ...]:
        """Of the plate's theory: a wave is six thicknesses long at least."""
        wave = self.sheet().bending_wave(self.greens.bandwidth)
        if (relative := self.thickness / wave) <= SHORTEST:
            return ()
        return (
            Advice(
                "reed.thickness over its bending wave at reed.greens.bandwidth",
                relative,
                SHORTEST,
                "waves so short are those of a solid, not of a plate, and no bar knows",
                f"use reed.greens.bandwidth <= {self.greens.bandwidth * (SHORTEST / relative) ** 2:.3g} Hz",
            ),
        )

    def sheet(self) -> Sheet:
        """What its modes and its Green's function depend on."""
        from seatfem.structures.sheets import Sheet  # scenes are read without finite elements

        return Sheet(self.geometry(), self.material.solid, self.greens.bandwidth, self.mesh.size)

    @property
    def own_lip(self) -> Lip:
        """The disc or ring that it touches with by itself."""
        return Lip.disc(self.radius) if self.contact_width is None else Lip(self.radius, self.contact_width)

    def lips(self, lip: Lip | None) -> tuple[Lip, ...]:
        """Its own contact and, where it is struck along a lip, that one's arcs; a whole lip in place of its own."""
        return (self.own_lip,) if lip is None else (self.own_lip, lip)

    def solved(self, lip: Lip | None = None) -> SolvedSheet:
        """Its modes, computed once in a process, and its Green's function, of a lip's ports or of its own one."""
        from seatfem.structures.sheets import solved_sheet  # as above

        return solved_sheet(self.sheet(), self.lips(lip), self.damping_ratio)

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        found = self.solved()
        return Surrogate(found.greens, True, f"the plate itself, {len(found.modes.omega)} modes")

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        with watch("reduction"):
            found = self.solved(method.lip)
        about = {"seat_model": f"Mindlin plate, {len(found.modes.omega)} modes", "seat_dof": found.model.size}
        return Solved(found.greens, model=found.model, modes=found.modes, about=about)

    def natural_modes(self, wanted: Wanted, watch: Stopwatch, progress: Progress) -> NaturalModes | None:
        from seatfem.structures.natural_modes import of_one  # of `seatfem modes` only
        from seatfem.structures.sheets import model_of  # as above

        with watch("modes"):
            return of_one(model_of(self.sheet(), self.lips(None)), None, wanted, progress)
