"""Interface of every kind of structure in the role of a reed, seat or stopper, and as a striker.

As a striker it has an initial deflection, a contact face, and responses to loads, strain and stress.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, Protocol, Self

import numpy as np
from pydantic import Field
from pydantic.fields import FieldInfo

from impact.after.histories import ReedStress
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.names import import_now
from impact.notices import Advice, Progress, silent
from seatfem.fields import Angle, Contradictions, Gap, KeyProblem, Length, Table, kind_of, kinds_below
from seatfem.structures import lip, model
from seatfem.structures.errors import GeometryError, ModelError
from seatfem.structures.materials import NAMED_MATERIALS
from seatfem.structures.method import AnyLevel, Applicability, Method, Solved, Task
from seatfem.structures.outlines import BodyViews
from seatfem.structures.patch import Patch, Sizes
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.structures.inspection.cad import Part
    from seatfem.structures.kinds.drawn import Drawn
    from seatfem.structures.kinds.elastic import Elastic
    from seatfem.structures.kinds.thin_plate import ThinPlate
    from seatfem.structures.sheets import SolvedSheet

LEAST_COVER: Final = 0.1
"""`Structure.least_cover` of a beam or plate: with its tip over the middle of a lip it covers a half or a third; one of
less than a tenth of a ring is not over the port."""
NO_RING: Final = (
    "as it is given here, is not struck on a flat ring; remove the key, or take one that is, such as annular"
)
_READS: Final[Mapping[str, Any]] = MappingProxyType({"length": Length, "gap": Gap, "angle": Angle})
"""Field type of a key of a shape, by `Key.reads` of `seatfem.structures.shapes.shape`."""
Picture = tuple[str, Callable[[Path], object]]
"""File name of a picture, and the function that draws it."""
Finding = tuple[tuple[str | int, ...], str]
"""Path to a key, relative to the structure's table or to the scene, and the problem with its value."""


At = float | tuple[float, ...] | None
"""Distances of the contact or contacts from the root of a body [m]; ``None``: the default contact."""


Place = float | Array | None
"""A place at which a body is pushed is a distance from its root [m], or points (n, 2) relative to the centre of its
contact [m]; ``None``: at its contact, or at the default places of springs."""
Push = Literal["force", "springs", "pressure"]
"""Origin of a load on a body: a force, springs that press it, or a pressure on an effective area at its contact."""
MOST_BEAM_MODES: Final = 1000
PORTS_AND_LANDS: Final = (("bore_radius", "lip_width"), ("bore_radius", "face_width"), ("port_radius", "land_width"))
"""Keys of the radius of a port and of the width of the land around it."""
LOADS: Final = ("force", "pressure", "point_force", "gravity")
"""Keys of the prescribed loads of all kinds."""


class KnownStress(Protocol):
    """The stress of a striker under known contact forces."""

    def largest(self, *, coarsely: bool, since: float = math.nan) -> ReedStress:
        """Return the largest stresses of the run, and those before and after the time ``since`` of a landing [s]."""

    def histories(self, also: Collection[float] = ()) -> Iterator[tuple[str, Array]]:
        """Yield the name of each place that may fail and its stress over time [Pa]: (n + 1,) uniaxial at a free
        surface, > 0 in tension, or (n + 1, 6) tensors xx, yy, zz, yz, xz, xy.

        ``also``: further places, as distances from the root [m].
        """

    def spots(self, worst: float) -> Iterator[tuple[str, Array, Array]]:
        """Yield name of the part, position (d,) [m] and stress as `histories` of the places that are reported as hot
        spots; ``worst``: place of the largest stress, a distance from the root [m]."""


def is_loaded(body: Structure) -> bool:
    """Return whether a body has prescribed loads."""
    return any(getattr(body, key, None) is not None for key in LOADS)


def is_curved(body: Structure) -> bool:
    """Return whether a body has a stress-free curvature."""
    return getattr(body, "curvature", None) is not None


def check_along(kind: str, reach: float, at: float | None, key: str) -> None:
    """Raise a `KeyProblem` of ``key`` for a distance ``at`` beyond the length ``reach`` of a body [m], 0 of one without
    positions."""
    if at is None:
        return
    if not reach:
        raise KeyProblem(key, f"a {kind.replace('_', ' ')} has no positions; remove the key")
    if at > reach:
        raise KeyProblem(
            key, f"{write_quantity(at, 'length')} must lie on the reed, which ends at {write_quantity(reach, 'length')}"
        )


@dataclass(frozen=True)
class Traits:
    """Properties of every body of a kind, whatever its table states.

    Attributes:
        needs_gmsh: its Green's function is computed on a mesh by gmsh, and saved in the user's store.
        revolved: it is a solid of revolution; pictures show it cut open.
        is_reduced: its Green's function is a model reduction of matrices, for a band and a tolerance.
        face_as_drawn: its contact face is positioned by a CAD file; a reed from another CAD file may be placed above.
        reed_as_drawn: it may be that reed: flat, from a STEP file.
        plane: its contact face remains plane under any load.
        has_rings: its contact face may be divided into rings.
        is_solved: its Green's function must be computed or read from a file before the run.
        has_weight: `Structure.weight` is implemented.
        stress: how the stress in a striker is known: by `Structure.stress`, by the field of its elements, or not.
        moved_by: keys of its initial conditions and loads; empty if the body cannot strike.
    """

    needs_gmsh: bool = False
    revolved: bool = False
    is_reduced: bool = False
    face_as_drawn: bool = False
    reed_as_drawn: bool = False
    plane: bool = False
    has_rings: bool = False
    is_solved: bool = False
    has_weight: bool = False
    stress: Literal["closed form", "field", "not"] = "not"
    moved_by: tuple[str, ...] = ()


@dataclass(frozen=True)
class Inputs:
    """Data that determine a Green's function together with the method.

    Attributes:
        content: values of keys in JSON; files count by their content.
        classes: classes whose code computes it.
    """

    content: Mapping[str, object]
    classes: tuple[type, ...]


@dataclass(frozen=True)
class LipFace:
    """The struck face as the table of a body describes it.

    Attributes:
        ring: mean radius and width of a flat ring [m]; ``None`` for other faces.
        no_lip: reason why it cannot be a lip, and the remedy, as far as the table tells; "" if it may be one.
    """

    ring: tuple[float, float] | None = None
    no_lip: str = ""


@dataclass(frozen=True)
class LocalShare:
    """Local compliance that the struck patch of a solid adds to that of the body as a whole.

    Attributes:
        compliance: mean displacement of a half-space under the patch's uniform load, per force [m/N]; 0 without a patch
            of a solid: beams, plates, rods, springs, measured records.
        sizes: keys that state the size of the patch.
        unknown: reason why it is not known, and the remedy; "" if it is.
    """

    compliance: float = 0.0
    sizes: tuple[str, ...] = ()
    unknown: str = ""


@dataclass(frozen=True)
class SampleScene:
    """Rest of the example scene of a kind (`seatfem init`).

    Attributes:
        motion: line of TOML with the initial motion of a kind that is usually the striker; "" for the others.
        opposite: kind of the other body.
        filter_width: averaging time of the peak force, if the default is too short; "" for the default.
        contact: lines of TOML of [contact]; "" for its defaults.
    """

    motion: str = ""
    opposite: str = "cantilever"
    filter_width: str = ""
    contact: str = ""


class Structure(Table):
    """A body: its table in a scene, and its methods for the plan, the Green's function and the contact.

    A kind is a subclass with ``kind: Literal["name"]``; its docstring and its fields are its chapter in docs/scene/.
    The defaults here suit a body in closed form without files, contact face and motion.
    """

    kind: str

    group: ClassVar[str] = "seats"
    """Heading under which lists of kinds show it: one of `seatfem.fields.GROUPS`."""
    traits: ClassVar[Traits] = Traits()
    """Properties of every body of this kind."""
    sample_scene: ClassVar[SampleScene] = SampleScene()
    """Rest of its example scene."""
    least_cover: ClassVar[float] = 0.0
    """Least share of a struck face that must lie under a rigid face of it; 0 of solids, which strike with theirs."""
    _beside_greens: ClassVar[frozenset[str]] = frozenset(
        {"mesh", "greens", "model", "n_modes", "velocity", "deflection", "force"}
    )
    """Keys on which g does not depend (motion), or only through the method (mesh, band, level)."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Add the keys of the kind's ``shape`` before the other keys of the kind."""
        super().__pydantic_init_subclass__(**kwargs)
        if (shape := vars(cls).get("shape")) is None:
            return
        inherited = {name for base in cls.__mro__[1:] if issubclass(base, Structure) for name in base.model_fields}
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

    def doubts(self) -> Contradictions:
        """Yield a land that is more than twice as wide as the radius of its port: the two may be swapped."""
        for port, land in PORTS_AND_LANDS:
            if {port, land} <= type(self).model_fields.keys() and getattr(self, land) > 2 * getattr(self, port):
                radius, width = (write_quantity(getattr(self, key), "length") for key in (port, land))
                yield land, f"{width} beside {port} = {radius}; did you mean {port} = {width!r}, {land} = {radius!r}?"

    # Narrower interfaces of some kinds

    @property
    def thin_plate(self) -> ThinPlate | None:
        """Return the body if it is a plate, which bends differently at each arc of a lip, else ``None``."""
        return None

    @property
    def elastic(self) -> Elastic | None:
        """Return the body if it is made of finite elements, else ``None``."""
        return None

    @property
    def drawn(self) -> Drawn | None:
        """Return the body if its mesh is generated from a geometry, with any element size, else ``None``."""
        return None

    # Description of the body

    def outline_loops(self) -> tuple[Array, ...]:
        """Return the loops of a flat body, (n, 3) of x, y [m] and bulges as in `loops`; () of others."""
        return ()

    @property
    def own_axis(self) -> tuple[float, ...]:
        """Return the direction that is aligned with the length of the reed; (): the body's x axis."""
        return ()

    def files(self) -> tuple[Path, ...]:
        """Return the files named in the table."""
        return tuple(file for key in type(self).model_fields if isinstance(file := getattr(self, key), Path))

    def problems(self) -> Iterator[Finding]:
        """Yield the problems found on opening its files."""
        return iter(())

    @property
    def struck_face(self) -> str:
        """Return the name of the face that is struck."""
        return "contact"

    def part(self) -> Part:
        """Return its faces for pictures and lists. Raises `GeometryError` if it has none."""
        raise GeometryError(f"seat.kind = {self.kind!r} has no faces; take a cad, mesh or drawn seat")

    def rise(self) -> tuple[float, float]:
        """Return by how much the struck face of a body from a file rises over a plane, and its largest side [m]."""
        return 0.0, 0.0

    def other_fits(self) -> tuple[GreensFunction, ...]:
        """Return the Green's functions fitted to its record with other samples of the noise."""
        return ()

    def fit_advice(self, role: str, greens: GreensFunction) -> Iterator[Advice]:
        """Yield advice on the misfit of its ``greens`` to its record; ``role``: its table."""
        yield from ()

    def fit_pictures(self, greens: GreensFunction, width: float) -> list[Picture]:
        """Return the pictures of its fitted ``greens``; ``width``: averaging time of forces [s]."""
        return []

    def file_notes(self) -> tuple[str, ...]:
        """Return what its file states, leaves open or holds besides, as the user might not expect."""
        return ()

    def inputs(self) -> Inputs:
        """Return the data that determine its Green's function together with the method."""
        return Inputs(self.model_dump(mode="json", exclude=set(self._beside_greens)), (type(self),))

    @property
    def loose(self) -> str:
        """Return the reason why nothing supports the body; "" if it is or may be supported."""
        return ""

    @property
    def lip_face(self) -> LipFace:
        """Return the struck face as the table describes it."""
        return LipFace(no_lip=NO_RING)

    @property
    def local_share(self) -> LocalShare:
        """Return the local compliance of the struck patch."""
        return LocalShare()

    def region(self) -> lip.AnyLip | None:
        """Return the flat ring, disc, or strips that are struck, undivided, however much of the body is modelled;
        ``None`` of a body without such a face.

        Raises:
            ModelError: a face from a file that is neither ring nor strip.
        """
        return None

    def views(self, *, coarse: bool = False) -> BodyViews:
        """Return its outlines in section and plan, for drawings; a labelled symbol if the shape is not known.

        Args:
            coarse: whether few triangles suffice for a body from a file.

        Raises:
            ModelError, GeometryError: a file whose faces cannot be found.
        """
        named = f" ({self.files()[0].name})" if self.files() else ""
        return BodyViews(self.kind.replace("_", " ") + named, symbol="box")

    def views_at(self, at: float, *, coarse: bool = False) -> BodyViews:
        """Return the `views` of a body with its contact ``at`` a distance from the root [m]."""
        return self.views(coarse=coarse)

    # As a striker

    @property
    def front(self) -> tuple[float, float]:
        """Return Young's modulus [Pa] and the density [kg/m^3] behind its contact face; of steel where it states no
        material."""
        material = getattr(self, "material", None)
        solid = NAMED_MATERIALS["steel"] if material is None else material.mean
        return solid.young, solid.density

    def place(self, at: float | None) -> float:
        """Return the distance of its contact from the root [m], stated as ``at``; 0 if it has no positions, as at the
        struck end of a rod."""
        return at or 0.0

    def find_plan_distance(self, place: float, at: float) -> float:
        """Return how far in plan a ``place`` lies from the contact, both distances from the root [m]."""
        return place - at

    def heights(self, points: Array) -> Array:
        """Return the (n,) heights of the stress-free shape over a flat one, at points (n, 2) relative to the centre of
        the contact [m]. Raises a `KeyProblem` for points outside the data."""
        return np.zeros(len(points))

    def start_at(self, at: float) -> float:
        """Return the initial deflection away from the seat [m], of a beam at a distance from its root."""
        return 0.0

    def start_shape(self) -> Array:
        """Return the (n, 2) distances from the root and initial deflections [m] that are drawn; none if unknown."""
        return np.zeros((0, 2))

    @property
    def spring_points(self) -> Array:
        """Return the default places (n, 2) of springs relative to the contact's centre [m]."""
        return np.zeros((1, 2))

    def as_beams(self, greens: GreensFunction) -> tuple[Body, ...]:
        """Return one beam with the motion of a plate that has this Green's function; none without an equivalent."""
        return ()

    def check_place(self, place: Place, key: str) -> None:
        """Raise a `KeyProblem` of ``key`` unless a force can act at the place."""
        if isinstance(place, np.ndarray):
            raise KeyProblem(
                key,
                f"a {self.kind.replace('_', ' ')} has no places across its face; remove the key, or take a plate: a "
                "flapper, sheet, disc or ring_plate",
            )
        check_along(self.kind, 0.0, place, key)

    def cover_doubts(self, seat: Structure, at: float, offset: tuple[float, float], arcs: int) -> Iterator[Finding]:
        """Yield a key of the scene, and why it is doubtful, if too little of the seat's face and its own lie on each
        other, for a contact ``at`` a distance from the root [m], with an ``offset`` [m], in so many arcs."""
        yield from ()

    def limits(self) -> tuple[Advice, ...]:
        """Return advice if its table exceeds the limits of its theory."""
        return ()

    def assumed(self) -> tuple[str, ...]:
        """Return the defaults of its table that a user may not expect, as text "reed.KEY = VALUE"."""
        return ()

    def flight_time(self, gap: float) -> float:
        """Return the time in which it crosses an opening without loads, at the velocity at which it starts [s]; 0 if
        it starts with none."""
        speed = getattr(self, "velocity", None) or getattr(getattr(self, "release", None), "velocity", None) or 0.0
        return gap / abs(speed) if speed < 0 else 0.0

    def too_thick(self) -> str:
        """Return the reason why its theory does not hold at all, and the remedy; "" if it does."""
        return ""

    def contact_problems(self, at: float | None, seat: Structure) -> Contradictions:
        """Yield keys to change, and why, if it cannot touch a ``seat`` at the distance ``at`` from the root [m]."""
        check_along(self.kind, 0.0, at, "contact.at")
        yield from ()

    def parts_problems(self, key: str) -> Contradictions:
        """Yield a ``key`` that shifts, tilts or divides its contact, and why it cannot have that."""
        yield key, f"a body of kind {self.kind!r} touches with one rigid face; remove the key, or take a plate"

    def pushed_at(self, body: Body, place: Place, by: Push = "force") -> Array:
        """Return the (M, n) modal forces of unit forces at a place, or the points of one, of ``body`` [1/sqrt(kg)];
        ``by``: a pressure is scaled to a total force of one.

        Raises `GreensFunctionError` for a body without modes.
        """
        if (modal := body.greens.modal) is None or len(modal.omega) == 0:
            raise GreensFunctionError(f"load: a reed of kind {self.kind!r} has no modes that a load could move")
        return np.asarray(modal.shapes[:, :1])

    @property
    def states_contact(self) -> bool:
        """Return whether it touches with a face of its own, in place of all of the struck face that it covers."""
        return True

    def covering(self) -> Self:
        """Return the body without the contact face that its table states."""
        return self

    def meets(self, face: lip.AnyLip | None) -> lip.AnyLip | None:
        """Return a face of seat or stopper as the body meets it, with a port for each of its parts; ``None`` of a body
        that touches with one rigid face."""
        return None

    def lips(self, face: lip.AnyLip | None, behind: lip.AnyLip | None = None) -> tuple[lip.AnyLip, ...]:
        """Return its own contact face, and those of a stopper ``behind`` and of a seat that it `meets`, in parts; none
        of a body that touches with one rigid face."""
        return ()

    def solved(self, method: Method, *, mesh_error: bool = True, progress: Progress = silent) -> SolvedSheet:
        """Return the modes of a plate and its Green's function by a method. Raises `ModelError` of other bodies."""
        raise ModelError(f"reed.kind = {self.kind!r}: a plate lands; give a flapper, sheet, disc or ring_plate")

    @property
    def wave_speed(self) -> float:
        """Return the speed [m/s] of incoming waves towards the struck end; 0 if the body admits none."""
        return 0.0

    def check_gauge(self, at: float, table: str, role: str) -> None:
        """Raise a `KeyProblem` of the ``table`` unless the strain at a distance [m] is known in this ``role``."""
        words = f"of a {self.kind.replace('_', ' ')} no strain is known at places; take a rod or a cantilever"
        raise KeyProblem(f"{table}.at", words)

    def strain_at(self, place: float, force: Array, dt: float, body: Body, at: At = None) -> Array:
        """Return the strain (n + 1,) at a place [m], > 0 in tension, under contact forces as in `stress`; of a seat or
        stopper, under the force (n + 1,) that presses on it."""
        raise NotImplementedError

    def weight(self, body: Body) -> tuple[Array, float]:
        """Return the (M,) modal forces of a unit force distributed like the mass [1/sqrt(kg)], and the mass [kg]."""
        raise NotImplementedError

    def stress(self, force: Array, dt: float, body: Body, at: At) -> KnownStress | None:
        """Return its stress under a contact force (n + 1,) [N], or several forces (n + 1, p), positive away from the
        seat; ``None`` if its stress is not known."""
        return None

    # Levels of modelling

    @property
    def loss(self) -> float:
        """Return the modal damping ratio common to all modes; 0 if there is none."""
        return float(getattr(self, "damping_ratio", 0.0))

    def levels(self) -> tuple[Applicability, ...]:
        """Return all levels of modelling with the reasons for or against each, cheapest first."""
        return (Applicability("closed form", True, 0.0, f"kind = {self.kind!r}: nothing to discretise"),)

    def level(self, error: float) -> Applicability:
        """Return the level that the table names, or else the cheapest with a modelling error of at most ``error``."""
        return self.levels()[0]

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        """Return the method by the keys of the table, at the `level` for this ``error``."""
        return Method(self.level(error).level, rings=rings)

    def elements_of(self, method: Method) -> AnyLevel:
        """Return the level of a method's finite elements; that of the method where it has none."""
        return method.level

    def sizes(self, method: Method) -> Sizes:
        """Return the element sizes of a method [m]; zero where its keys do not determine them."""
        return Sizes(0.0, 0.0)

    def beyond(self, level: AnyLevel) -> GreensFunction | None:
        """Return a Green's function with the leading effect that a level neglects; ``None`` if none is known."""
        return None

    def shear_error(self, at: float | None) -> float:
        """Return the relative error of its compliance at a distance from the root by shear that its theory omits."""
        return 0.0

    @property
    def band_limit(self) -> tuple[float, str]:
        """Return the widest band [Hz] in which its theory holds, and in words what lies above it, with a remedy."""
        return math.inf, ""

    def solve_in_wider_band(
        self, greens: GreensFunction, lips: tuple[lip.AnyLip, ...], progress: Progress = silent
    ) -> tuple[GreensFunction, float] | None:
        """Return the Green's function of the ports of these lips with the modes of a wider band, and its ratio to that
        of ``greens``; ``None`` where its theory allows none."""
        return None

    def narrow_bands(self, greens: GreensFunction, *, in_arcs: bool) -> tuple[tuple[GreensFunction, float], ...]:
        """Return the Green's function of a seat without its highest modes, and the factor from the change by each to
        the error by its band; none where the band of its method causes no error."""
        return ()

    # Estimates before its Green's function is computed

    def counted(self) -> str:
        """Return in words what was read of its file, "" if nothing has to be said. Raises as `patch`."""
        return ""

    def patch(self) -> Patch | None:
        """Return the size of the contact face and the body behind it; ``None`` if the face is not known."""
        return None

    def estimate(self) -> GreensFunction | None:
        """Return an estimate of its Green's function from its contact face alone; ``None`` if that is not known."""
        return None

    @property
    def endless_stiffness(self) -> float:
        """Return the stiffness of the spring with which an endless body is compared [N/m]; 0 of other bodies."""
        return 0.0

    @property
    def _model_words(self) -> str:
        """Return the name of its closed form in results."""
        return f"{self.kind.replace('_', ' ')}, closed form"

    def closed_form(self) -> GreensFunction:
        """Return the Green's function in closed form, of bodies that are not solved."""
        raise NotImplementedError

    # Computation

    def solve(self, task: Task) -> Solved:
        """Return its Green's function as the task asks for it."""
        n_modes = task.method.n_modes
        greens = self.body(None, n_modes).greens if n_modes else self.closed_form()
        return Solved(greens, about={"seat_model": self._model_words}, plane=self.traits.plane)

    def meshed(self, solved: Solved, method: Method, progress: Progress) -> Solved:
        """Return what a method has ``solved`` and was kept without its mesh, with mesh and modes to be drawn."""
        return solved

    def system_of_equations(self) -> model.SecondOrderModel | None:
        """Return the matrices of a plate, or in its files; ``None`` if it has no matrices."""
        return None

    def stress_problems(self, asked: str, *, tensors: bool = False) -> Iterator[str]:
        """Yield why what is ``asked`` of its stress as a striker, or of its stress ``tensors``, is not known."""
        if self.traits.stress == "not" or (tensors and self.traits.stress != "field"):
            known, others = ("stress tensors are", "a plate") if tensors else ("stress is", "a cantilever or a plate")
            words = f"{asked} is asked of a body of kind {self.kind!r}, whose {known} not known"
            yield f"{words}: remove it, or use {others}"

    def field_problems(self) -> Iterator[str]:
        """Yield why its stress as a struck body cannot be computed."""
        yield f"a seat of kind {self.kind!r} has no finite elements; remove the table"

    def covered_problems(self, width: float | None) -> Contradictions:
        """Yield keys of a plate to change, and why, where it is to touch this body with all that it covers; ``width``:
        stated of its contact [m]."""
        yield from ()

    def body(self, greens: GreensFunction | None = None, n_modes: int = 0, at: At = None) -> Body:
        """Return the body with the motion that the table states.

        Args:
            greens: its Green's function, unless it is known in closed form.
            n_modes: number of beam modes, in place of the key; 0: the key counts.
            at: distance of the contact, or of each of several contacts (ports), from the root [m].
        """
        return Body(self.closed_form() if greens is None else greens)


def motion_key(body: Structure) -> str:
    """Return the first key of initial conditions or loads that is set; "" for a body at rest."""
    return next((key for key in body.traits.moved_by if getattr(body, key) is not None), "")


HOMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "blocks": "bar block plate",
        "closed_forms": "rigid_mass rod spring",
        "from_files": "cad mesh",
        "measured": "frf",
        "plates": "disc flapper held_disc ring_plate",
        "reeds": "cantilever clamped_clamped stepped timoshenko tip_mass",
        "sheet": "sheet plate",
        "stored": "greens matrices modes",
        "turned": "annular ball conical stopper",
    }
)
"""Modules of the kinds here, and the names under which scenes may mean those of each."""


def kinds_of(named: Collection[str] = ()) -> tuple[type[Structure], ...]:
    """Return all kinds, sorted by name, or, without loading others, those that scenes may mean by the names ``named``;
    all if one of these is no kind's name."""
    for module, names in HOMES.items():
        is_meant = not named or not set(named).isdisjoint(names.split())
        if is_meant and Path(__file__).with_name(f"{module}.py").is_file():
            import_now(f"{__package__}.{module}")
    kinds = tuple(sorted(kinds_below(Structure), key=kind_of))
    meant = {each: {kind_of(each), *each.also} & set(named) for each in kinds}
    if set(named) - set().union(*meant.values()):
        return kinds_of()
    return tuple(each for each in kinds if meant[each] or not named)
