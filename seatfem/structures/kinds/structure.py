"""What every kind of structure answers, whatever role it plays: reed, seat or stopper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol

from pydantic import Field
from pydantic.fields import FieldInfo

from impact.bodies.body import Body
from impact.greens.base import GreensFunction
from impact.notices import Progress
from seatfem import structures
from seatfem.fields import Angle, Gap, Length, kind_of, kinds_below
from seatfem.machine.resources import Stopwatch
from seatfem.structures.estimates.surrogate import Column, Face, Patch, Surrogate, unknown
from seatfem.structures.kinds.striking import At, Striking
from seatfem.structures.lip import Lip
from seatfem.structures.method import Applicability, Method, Solved
from seatfem.structures.outlines import BodyViews

if TYPE_CHECKING:
    from impact.measured.frf import FrequencyResponse
    from impact.measured.pole_fit import PoleFit
    from seatfem.structures.kinds.beam import Beam
    from seatfem.structures.kinds.drawn import Drawn
    from seatfem.structures.kinds.elastic import Elastic
    from seatfem.structures.kinds.thin_plate import ThinPlate

NO_RING: Final = (
    "as it is given here, is not struck on a flat ring; remove the key, or take one that is, such as annular"
)
_READS: Final[Mapping[str, Any]] = MappingProxyType({"length": Length, "gap": Gap, "angle": Angle})
"""Types that read keys of shapes, by `seatfem.structures.shapes.shape.Key`."""
Finding = tuple[tuple[str | int, ...], str]
"""A key, from the structure's own table on, and what is wrong with it."""


@dataclass(frozen=True)
class Traits:
    """Properties of every body of a kind, whatever its table states.

    Attributes:
        needs_gmsh: gmsh must run to compute it.
        revolved: it is a solid of revolution, which pictures cut open.
        is_reduced: its Green's function is a reduction of matrices, for a band and a tolerance.
        is_kept: its Green's function is worth a file in the user's store.
        face_as_drawn: its struck face has a place in a CAD file, where a reed from another file may lie over it.
        reed_as_drawn: it may be such a reed: flat, in a STEP file.
        plane: its patch moves as a plane, whatever presses it.
        has_rings: its struck patch may be divided into rings.
        is_solved: its Green's function must be computed or read before it strikes.
        has_weight: `Structure.weight` is known.
        has_stress: its bending stress is known while it strikes.
        moved_by: keys that state how it starts or what drives it; none of a body that cannot strike.
    """

    needs_gmsh: bool = False
    revolved: bool = False
    is_reduced: bool = False
    is_kept: bool = False
    face_as_drawn: bool = False
    reed_as_drawn: bool = False
    plane: bool = False
    has_rings: bool = False
    is_solved: bool = False
    has_weight: bool = False
    has_stress: bool = False
    moved_by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Inputs:
    """What a Green's function depends on beside the method.

    Attributes:
        content: as JSON values; files stand for themselves.
        classes: whose code it depends on.
    """

    content: Mapping[str, object]
    classes: tuple[type, ...]


@dataclass(frozen=True)
class LipFace:
    """The struck face as the table of a body describes it.

    Attributes:
        ring: mean radius and width of a flat ring [m]; ``None`` where another face is struck.
        no_lip: why it is no lip, as far as the table says, and what would help; "" where it may be one.
    """

    ring: tuple[float, float] | None = None
    no_lip: str = ""


class Measured(Protocol):
    """A body that is known by a measured response."""

    def response(self) -> FrequencyResponse:
        """Return the measured response of the contact, read once in a process. Raises as its reader."""

    def fit(self) -> PoleFit:
        """Return the poles fitted to its record, those tried, and its other draws."""


@dataclass(frozen=True)
class SampleScene:
    """What surrounds the sample of a kind in a scene.

    Attributes:
        motion: of a kind that usually strikes, a line of TOML; "" of one that usually is struck.
        opposite: the kind that it meets.
        filter_width: of the mean behind the peak force, where the usual one is too short; "" for the usual one.
    """

    motion: str = ""
    opposite: str = "cantilever"
    filter_width: str = ""


class Structure(Striking):
    """A body: its table in a scene, and the methods by which planning, computing and striking use it.

    A kind is a subclass with ``kind: Literal["name"]``; its docstring and its fields are its chapter in docs/scene/.
    What is said here holds for a body in closed form without files, patch and motion.
    """

    group: ClassVar[str] = "seats"
    """Under which name lists of kinds have it: one of `seatfem.fields.GROUPS`."""
    traits: ClassVar[Traits] = Traits()
    """What is so of every body of its kind."""
    sample_scene: ClassVar[SampleScene] = SampleScene()
    """What surrounds its sample in a scene of its own (`seatfem init`)."""
    _beside_greens: ClassVar[frozenset[str]] = frozenset(
        {"mesh", "greens", "model", "n_modes", "velocity", "deflection", "force"}
    )
    """Keys that say how a body is computed, which its method knows, and how it moves."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Add the keys of the shape that a kind is drawn as, before those of its own."""
        super().__pydantic_init_subclass__(**kwargs)
        if (shape := vars(cls).get("shape")) is None:
            return
        inherited = {name for base in cls.__mro__[1:] if issubclass(base, Striking) for name in base.model_fields}
        own = [name for name in cls.model_fields if name not in inherited]
        for field in fields(shape):
            if (key := field.metadata.get("key")) is None:
                continue
            optional = field.default is None
            annotation = _READS[key.reads] | None if optional else _READS[key.reads]
            said = Field(None if optional else key.written or ..., description=key.description)
            cls.__annotations__[field.name] = annotation
            cls.model_fields[field.name] = FieldInfo.from_annotated_attribute(annotation, said)
        for name in own:
            cls.model_fields[name] = cls.model_fields.pop(name)

    # What else it can be asked as

    @property
    def thin_plate(self) -> ThinPlate | None:
        """Return the body as a plate that bends under a lip, arc by arc; ``None`` of one that touches rigidly."""
        return None

    @property
    def slender(self) -> Beam | None:
        """Return the body as a beam, known by its own modes; ``None`` of others."""
        return None

    @property
    def elastic(self) -> Elastic | None:
        """Return the body as one of finite elements, whose cost is known beforehand; ``None`` of others."""
        return None

    @property
    def drawn(self) -> Drawn | None:
        """Return the body as one whose mesh is made from a drawing, as fine as it is asked for; ``None`` of others."""
        return None

    @property
    def measured(self) -> Measured | None:
        """Return the body as one whose poles are fitted to a measured response; ``None`` of others."""
        return None

    # What it is

    def files(self) -> tuple[Path, ...]:
        """Return the files that it names."""
        return tuple(file for key in type(self).model_fields if isinstance(file := getattr(self, key), Path))

    def problems(self) -> Iterator[Finding]:
        """Yield the problems of its files, once they are opened."""
        return iter(())

    def inputs(self) -> Inputs:
        """Return the data on which its Green's function depends, beside the method."""
        return Inputs(self.model_dump(mode="json", exclude=set(self._beside_greens)), (type(self),))

    @property
    def loose(self) -> str:
        """Return why it is certain to move away when it is struck; "" where something may hold it."""
        return ""

    @property
    def lip_face(self) -> LipFace:
        """Return the struck face as the table describes it."""
        return LipFace(no_lip=NO_RING)

    def lip(self, arcs: int = 1, rings: int = 1) -> structures.lip.AnyLip | None:
        """Return the flat ring-shaped face that is struck, in parts; ``None`` where `lip_face` says why there is none.

        Raises:
            ModelError: a face of a file that is no lip.
        """
        return None if (ring := self.lip_face.ring) is None else Lip(*ring, arcs, rings)

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        """Return its outlines in section and plan, for drawings; a symbol with its name where its shape is not known.

        Args:
            at: where on it the contact lies, from its root [m]; ``None``: where it is by default.
            coarse: whether a body from a file may be shown by few triangles, as long as places are right.

        Raises:
            ModelError, GeometryError: a file whose faces cannot be found.
        """
        named = f" ({self.files()[0].name})" if self.files() else ""
        return BodyViews(self.kind.replace("_", " ") + named, symbol="box")

    # How it is modelled

    @property
    def loss(self) -> float:
        """Return the modal damping ratio, as far as it is uniform."""
        return float(getattr(self, "damping_ratio", 0.0))

    def levels(self, band: float | None = None) -> tuple[Applicability, ...]:
        """Return every level of modelling with the reasons for or against it, the cheapest first; ``band``: edge
        [Hz]."""
        return (Applicability("closed form", True, 0.0, f"kind = {self.kind!r}: nothing to discretise"),)

    def level(self, error: float) -> Applicability:
        """Return the cheapest level whose own error is at most ``error``, or the one that the table names."""
        return self.levels()[0]

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        """Return the method that the table states, at the cheapest level whose own error is at most ``error``."""
        return Method(self.level(error).level, rings=rings)

    @property
    def is_convolved(self) -> bool:
        """Return whether its g will be no sum of oscillators: damping couples its modes, or it is stepped in time."""
        return False

    # What is known of it before it is computed

    def patch(self) -> Patch | None:
        """Return the struck patch and the body behind it; ``None`` where no face is known."""
        return None

    def column(self) -> Column | None:
        """Return the column of material under the struck face, where that is what it is guessed by."""
        return None

    @property
    def _model_words(self) -> str:
        """Return the name of its closed form in results."""
        return f"{self.kind.replace('_', ' ')}, closed form"

    def closed_form(self) -> GreensFunction | None:
        """Return the body in closed form, where there is one."""
        return None

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        """Return the body itself where that costs nothing, else its surrogate in pre-runs of ``duration`` [s].

        ``face``: of what touches it.
        """
        if (exact := self.closed_form()) is not None:
            return Surrogate(exact, True, f"the {self.kind} itself")
        return unknown(f"kind = {self.kind!r} does not state the size of the struck face", face)

    # Computing it

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        """Return its Green's function by a method, for runs of ``duration`` [s]; ``mesh_error``: by a coarser mesh,
        too."""
        greens = self.closed_form() if method.n_modes is None else self.body(None, method.n_modes).greens
        assert greens is not None
        return Solved(greens, about={"seat_model": self._model_words}, plane=self.traits.plane)

    def system_of_equations(self) -> structures.model.SecondOrderModel | None:
        """Return the matrices in its files; ``None`` of a body that has none."""
        return None

    def body(self, greens: GreensFunction | None = None, n_modes: int | None = None, at: At = None) -> Body:
        """Return the body with the motion that the table states.

        Args:
            greens: its Green's function, where it has to be computed.
            n_modes: beam modes in place of the table's.
            at: of the contact, from its root [m], or of several: each is a port.
        """
        known = self.closed_form() if greens is None else greens
        assert known is not None
        return Body(known)


def motion_key(body: Structure) -> str:
    """Return the key that states how a body starts or what drives it; "" of one at rest."""
    return next((key for key in body.traits.moved_by if getattr(body, key) is not None), "")


def kinds_of() -> tuple[type[Structure], ...]:
    """Return every kind that there is, by name: subclasses whose ``kind`` is stated."""
    return tuple(sorted(kinds_below(Structure), key=kind_of))
