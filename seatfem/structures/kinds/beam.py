"""Base of the flat reeds: beams in closed form, their release and their loads."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Final, Self

import numpy as np
from pydantic import Field, model_validator

from impact import notices, quantities
from impact.bodies import loads, reeds
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from seatfem import fields
from seatfem.structures import method, outlines
from seatfem.structures.kinds import parts, structure
from seatfem.structures.kinds.motion import AnyPointForce, AnyPressure
from seatfem.structures.kinds.structure import Structure, Traits
from seatfem.units import write_quantity

STIFFENING: Final = 36 / 35  # extra force of a cantilever's elastica under a tip force, over (deflection/length)^2
DEFLECTED: Final = 0.1  # largest deflection over length; the extra force is less than 1 % there
POINTS: Final = 720  # sampled points around a lip
COVERED: Final = 0.95  # covered fraction of a lip above which a beam counts as covering it
LEAST_QUARTER: Final = 0.8  # share of a quarter period in which the higher modes of a static shape may bring it back
START_POINTS: Final = 60  # places at which the initial shape is drawn
SLENDER: Final = 0.2  # largest thickness over length of a thin beam; shear adds 3 % to the compliance there
SHEAR: Final = 0.25 * 2 * (1 + 0.3) / (5 / 6)  # compliance by shear over that by bending, over (t/l)^2; nu = 0.3


class Release(fields.Table):
    """The initial state of a reed: at rest in the static shape under a force at its tip, or in one mode, with a
    deflection or a velocity."""

    where: ClassVar[str] = ""
    """Place of the deflection, in drawings."""

    tip_deflection: fields.Length | None = Field(None, description="deflection of the tip, away from the seat")
    mode: int | None = Field(None, strict=True, ge=1, description="number of a mode, with deflection or velocity")
    deflection: fields.Position | None = Field(None, description="of the tip (or the middle) in that mode")
    velocity: fields.Approach | None = Field(
        None, description='of the tip (or the middle) in that mode; towards the seat negative, as in "-2 m/s"'
    )

    @model_validator(mode="before")
    @classmethod
    def _one_way(cls, given: object) -> object:
        if not isinstance(given, Mapping):
            return given
        beside = [key for key in ("deflection", "velocity") if key in given]
        if "mode" in given or beside:
            if "tip_deflection" in given:
                raise fields.KeyProblem(
                    "tip_deflection", f"{'mode' if 'mode' in given else beside[0]} is given too; keep one"
                )
            if "mode" not in given:
                raise fields.KeyProblem("mode", f"required key is missing beside {beside[0]}")
            if not beside:
                raise fields.KeyProblem("deflection", "required key is missing beside mode; or give velocity")
        elif "tip_deflection" not in given:
            raise fields.KeyProblem(
                "tip_deflection", "required key is missing: deflection of the tip, away from the seat"
            )
        return given

    @property
    def largest(self) -> float:
        """Return the deflection of the tip at the start [m]."""
        return abs(self.tip_deflection if self.tip_deflection is not None else self.deflection or 0.0)


class Beam(Structure):
    """Base of all beams that bend about their thin side."""

    group: ClassVar[str] = "reeds"
    traits: ClassVar[Traits] = Traits(has_weight=True, moved_by=("release", "pressure", "point_force", "gravity"))
    theory: ClassVar[type[Any]]
    """Class of the beam in closed form; its fields have the names of keys of the table or of its material."""
    long: ClassVar[str] = "reed.length"
    """The key that states its length."""
    both_held: ClassVar[bool] = False
    """This says whether the far end of the beam is clamped as well."""
    least_cover: ClassVar[float] = structure.LEAST_COVER

    thickness: fields.Thickness = fields.default("0.305 mm", "thickness, in the direction of the motion")
    material: parts.Material = fields.default(
        {"young": "200 GPa", "density": "7850 kg/m^3"}, "the reed's material; steel if absent"
    )
    damping_ratio: fields.DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    n_modes: int = Field(40, strict=True, ge=1, le=structure.MOST_BEAM_MODES, description="number of beam modes")
    release: Release | None = Field(None, description="how the reed starts; absent: at rest, under its loads")
    pressure: AnyPressure | None = Field(None, description="on the whole reed; a constant one may be written as text")
    point_force: AnyPointForce | None = Field(None, description="on one place of the reed")
    gravity: fields.Acceleration | None = Field(
        None, description="component of the acceleration along the normal; negative presses the reed on the seat"
    )

    @property
    @abstractmethod
    def span(self) -> float:
        """Return the free length [m]."""

    @property
    @abstractmethod
    def mean_width(self) -> float:
        """Return the mean width [m]."""

    def beam(self) -> reeds.Beam:
        """Return the beam in closed form, of the class `theory`."""
        beam: reeds.Beam = fields.build_from_fields(self.theory, self, self.material)
        return beam

    @property
    def widths_along(self) -> tuple[tuple[float, float], ...]:
        """Return pairs of distance from the root and width [m]; the width is linear in between."""
        return ((0.0, self.mean_width), (self.span, self.mean_width))

    def views(self, *, coarse: bool = False) -> outlines.BodyViews:
        return self.views_at(self.place(None))

    def views_at(self, at: float, *, coarse: bool = False) -> outlines.BodyViews:
        name = "beam held at both ends" if self.both_held else self.kind.replace("_", " ")
        return outlines.draw_beam(name, self.widths_along, self.thickness, at, both_ends=self.both_held)

    def stated(self, error: float = 0.0, rings: int | None = 1) -> method.Method:
        return replace(super().stated(error, rings), n_modes=self.n_modes)

    def parts_problems(self, key: str) -> fields.Contradictions:
        """Yield as of other bodies, but a profile, on which the beam rolls along its length."""
        if key != "stopper.profile":
            yield from super().parts_problems(key)

    def check_place(self, place: structure.Place, key: str) -> None:
        if isinstance(place, np.ndarray):
            super().check_place(place, key)
        else:
            structure.check_along(self.kind, self.span, place, key)

    def contact_problems(self, at: float | None, seat: Structure) -> fields.Contradictions:
        structure.check_along(self.kind, self.span, at, "contact.at")
        if (ring := seat.lip_face.ring) is None:
            return
        if (place := self.place(at)) < (outer := ring[0] + ring[1] / 2) * (1 - 1e-9):
            words = f"the lip's middle is {write_quantity(place, 'length')} from the clamp, and the lip reaches"
            reaches = f"{words} {write_quantity(outer, 'length', 4)} from its middle, behind the clamp"
            key = "contact.at" if at is not None else self.long if self.long.startswith("reed.") else "reed"
            yield key, f"{reaches}; make {'this' if at is None else key} at least that, or the lip smaller"

    def place(self, at: float | None) -> float:
        return self.beam().free_point if at is None else at

    def start_at(self, at: float) -> float:
        """Return the initial deflection at ``at``, in the static shape under a force at the tip or in a mode."""
        if self.release is None:
            return 0.0
        beam = self.beam()
        tip = beam.free_point
        if self.release.tip_deflection is not None:
            return self.release.tip_deflection * beam.compliance(at, tip) / beam.compliance(tip, tip)
        assert self.release.mode is not None
        touched, free = beam.modes(self.release.mode).deflection(np.array([at, tip]))[-1]
        return (self.release.deflection or 0.0) * float(touched / free)

    def flight_time(self, gap: float) -> float:
        """Return as other bodies do; of a deflected beam most of a quarter of the period of its first mode [s]."""
        if self.release is None or self.release.tip_deflection is None:
            return super().flight_time(gap)
        return LEAST_QUARTER * np.pi / 2 / float(self.beam().modes(1).omega[0])

    def start_shape(self) -> Array:
        x = np.linspace(0.0, self.span, START_POINTS)
        return np.column_stack([x, [self.start_at(float(place)) for place in x]])

    def cover_doubts(
        self, seat: Structure, at: float, offset: tuple[float, float], arcs: int
    ) -> Iterator[structure.Finding]:
        """Yield a doubt if the beam covers only a part of a lip, which the model presses all around."""
        if (ring := seat.lip_face.ring) is None:
            return
        angle = 2 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
        along, across = at + ring[0] * np.cos(angle), ring[0] * np.sin(angle)
        share = float(np.mean((along >= 0) & (along <= self.span) & (np.abs(across) <= self.mean_width / 2)))
        if share >= COVERED:
            return
        outer, place = write_quantity(2 * ring[0] + ring[1], "length", 3), write_quantity(at, "length")
        yield (
            ("contact", "at"),
            f"the reed covers {quantities.percent(share, 2)} of the lip, whose outer diameter is {outer}, at "
            f"contact.at = {place}; this model presses all of it. A reed that closes a port reaches beyond its lip all "
            "around: make contact.at smaller, or the reed wider",
        )

    def closed_form(self) -> GreensFunction:
        return self._body(0, None, moved=False).greens

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: structure.At = None) -> Body:
        return self._body(n_modes, at)

    def _body(self, n_modes: int, at: structure.At, *, moved: bool = True) -> Body:
        return reeds.reed(
            self.beam(),
            damping_ratio=self.damping_ratio,
            n_modes=n_modes or self.n_modes,
            contact_at=at,
            release=self._release() if moved else None,
            loads=self._loads() if moved else (),
        )

    def pushed_at(self, body: Body, place: structure.Place, by: structure.Push = "force") -> Array:
        modal = body.greens.modal
        if place is None or isinstance(place, np.ndarray) or modal is None:
            return super().pushed_at(body, place, by)
        return self.beam().modes(len(modal.omega)).deflection(place)[:, None]

    def weight(self, body: Body) -> tuple[Array, float]:
        modal = body.greens.modal
        assert modal is not None
        modes = self.beam().modes(len(modal.omega))
        (load,) = loads.Gravity(1.0).modal(modes)
        return load.shape, modes.line_density * modes.length

    def _release(self) -> reeds.Release | None:
        if self.release is None:
            return None
        if self.release.tip_deflection is not None:
            return reeds.StaticShape(self.release.tip_deflection)
        assert self.release.mode is not None
        return reeds.ModeShape(self.release.mode, self.release.deflection or 0.0, velocity=self.release.velocity or 0.0)

    def _loads(self) -> list[loads.ReedLoad]:
        reed_loads: list[loads.ReedLoad] = []
        if self.pressure is not None:
            reed_loads.append(loads.Pressure(self.pressure.course))
        if self.point_force is not None:
            at = self.beam().free_point if self.point_force.at is None else self.point_force.at
            reed_loads.append(loads.PointForce(self.point_force.course, at))
        if self.gravity is not None:
            reed_loads.append(loads.Gravity(self.gravity))
        return reed_loads

    @model_validator(mode="after")
    def _force_on_the_reed(self) -> Self:
        if self.point_force is not None:
            structure.check_along(self.kind, self.span, self.point_force.at, "point_force.at")
        return self

    def too_thick(self) -> str:
        if self.thickness <= SLENDER * self.span:
            return ""
        return (
            f"reed.thickness = {1e3 * self.thickness:g} mm over {self.long} = {1e3 * self.span:g} mm is "
            f"{self.thickness / self.span:.2g} (limit {SLENDER:g}): a beam so thick bends by shear too, which is not "
            "modelled; take a thinner or longer reed, or a rigid mass"
        )

    def shear_error(self, at: float | None) -> float:
        """Return the relative error 3 EI/(kappa G A L^2) of a compliance without shear, L from the root to the contact.

        Source: S. P. Timoshenko, Phil. Mag. 41 (1921) 744; kappa = 5/6, Poisson ratio 0.3.
        """
        return SHEAR * (self.thickness / (self.span if at is None else at)) ** 2

    def limits(self) -> tuple[notices.Advice, ...]:
        """Return advice if the deflection at release is too large for linear theory.

        The elastica of a cantilever needs 1 + (36/35)(d/L)^2 times the linear tip force for a deflection d, to second
        order, whatever its thickness. Source: K. E. Bisshopp and D. C. Drucker, Large deflection of cantilever beams,
        Quart. Appl. Math. 3 (1945) 272.
        """
        deflection = 0.0 if self.release is None else self.release.largest
        if (relative := deflection / self.span) <= DEFLECTED:
            return ()
        strain = 1.5 * relative * self.thickness / self.span
        return (
            notices.Advice(
                f"release.tip_deflection over {self.long}",
                relative,
                DEFLECTED,
                f"the reed's theory is linear; at {deflection / self.thickness:.3g} thicknesses "
                f"it is stiffer by about {STIFFENING * relative**2:.2g} of its stiffness (strain {strain:.2g}); "
                "the uncertainty does not include this",
                f"release it from at most {1e3 * DEFLECTED * self.span:.3g} mm, or take a longer reed",
            ),
        )

    def assumed(self) -> tuple[str, ...]:
        values = {
            "width": quantities.text(self.mean_width, "m"),
            "thickness": quantities.text(self.thickness, "m"),
            "material": f"{quantities.text(self.material.young, 'Pa')}, {self.material.density:g} kg/m^3",
        }
        assumed = type(self).model_fields.keys() - self.model_fields_set
        return tuple(f"reed.{key} = {value}" for key, value in values.items() if key in assumed)


class UniformBeam(Beam):
    """Base of all beams of constant width."""

    length: fields.Length = Field(description="free length")
    width: fields.Length = fields.default("10 mm", "width")

    @property
    def span(self) -> float:
        return self.length

    @property
    def mean_width(self) -> float:
        return self.width
