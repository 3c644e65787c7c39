"""What every kind of structure answers, whatever role it plays: reed, seat or stopper."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final

from impact.bodies.body import Body
from impact.greens.base import GreensFunction
from impact.progress import Progress
from seatfem.fields import kind_of, kinds_below
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.patch import Column, Patch
from seatfem.structures.estimates.surrogate import Face, Surrogate, unknown
from seatfem.structures.kinds.striking import At, Striking
from seatfem.structures.method import AnyLevel, Applicability, Level, Method
from seatfem.structures.outlines import BodyViews
from seatfem.structures.solved import Solved

if TYPE_CHECKING:
    from impact.measured.frf import FrequencyResponse
    from impact.measured.pole_choice import Candidate
    from seatfem.structures.estimates.costs import Numbers
    from seatfem.structures.inspection.parts import Part
    from seatfem.structures.lip import AnyLip
    from seatfem.structures.natural_modes import NaturalModes, Wanted

NO_RING: Final = (
    "as it is given here, is not struck on a flat ring; remove the key, or take one that is, such as annular"
)
Finding = tuple[tuple[str | int, ...], str]
"""A key, from the structure's own table on, and what is wrong with it."""


class Structure(Striking):
    """A body: its table in a scene, and what the program asks of it.

    A kind is a subclass with ``kind: Literal["name"]``; its docstring and its fields are its chapter in docs/scene/.
    What is said here holds for a body in closed form without files, patch and motion.
    """

    group: ClassVar[str] = "seats"
    """Under which name lists of kinds have it: one of `seatfem.fields.GROUPS`."""
    not_of_greens: ClassVar[tuple[str, ...]] = ("mesh", "greens", "model", "n_modes", "velocity", "deflection", "force")
    """Keys that say how a body is computed, which its method knows, and how it moves."""

    needs_gmsh: ClassVar[bool] = False
    """Whether gmsh must run to compute it."""
    revolved: ClassVar[bool] = False
    """Whether it is a solid of revolution, which pictures cut open."""
    is_reduced: ClassVar[bool] = False
    """Whether its Green's function is a reduction of matrices, for a band and a tolerance."""
    is_meshed: ClassVar[bool] = False
    """Whether it has finite elements, whose cost is known beforehand."""
    is_kept: ClassVar[bool] = False
    """Whether its Green's function is worth a file in the user's store."""
    is_drawn: ClassVar[bool] = False
    """Whether its mesh is made from a drawing, as fine as it is asked for."""
    face_as_drawn: ClassVar[bool] = False
    """Whether its struck face has a place in a CAD file, where a reed from another file may lie over it."""
    reed_as_drawn: ClassVar[bool] = False
    """Whether it may be such a reed: flat, in a STEP file."""
    plane: ClassVar[bool] = False
    """Whether its patch moves as a plane, whatever presses it."""
    has_rings: ClassVar[bool] = False
    """Whether its struck patch may be divided into rings."""

    sample_motion: ClassVar[str] = ""
    """Its motion in such a scene, of a kind that usually strikes; "" of one that usually is struck."""
    sample_opposite: ClassVar[str] = "cantilever"
    """The kind that it meets there."""
    sample_filter: ClassVar[str] = ""
    """Width of the mean behind the peak force there, where the usual one is too short for what strikes."""

    # What it is

    def files(self) -> tuple[Path, ...]:
        """Return the files that it names."""
        return tuple(file for key in type(self).model_fields if isinstance(file := getattr(self, key), Path))

    def problems(self) -> Iterator[Finding]:
        """Report what is wrong with its files, once they are opened."""
        return iter(())

    def content(self) -> dict[str, object]:
        """Return what its Green's function depends on beside the method, as JSON values; files stand for themselves."""
        return self.model_dump(mode="json", exclude=set(self.not_of_greens))

    def made_by(self) -> tuple[type, ...]:
        """Return the classes whose code its Green's function depends on."""
        return (type(self),)

    def part(self) -> Part | None:
        """Return its faces, to be shown; ``None`` of a body without any."""
        return None

    @property
    def loose(self) -> str:
        """Return why it is certain to move away when it is struck; "" where something may hold it."""
        return ""

    @property
    def struck_ring(self) -> tuple[float, float] | None:
        """Return the mean radius and width of the flat ring that is struck [m]; ``None`` where another face is."""
        return None

    @property
    def no_lip(self) -> str:
        """Return why there is no `lip`, as far as the table says, and what would help; "" where there may be one."""
        return "" if self.struck_ring is not None else NO_RING

    def lip(self, arcs: int = 1, rings: int = 1) -> AnyLip | None:
        """Return the flat ring-shaped face that is struck, in parts; ``None`` where `no_lip` says why there is none.

        Raises:
            ModelError: a face of a file that is no lip.
        """
        from seatfem.structures.lip import Lip  # scenes without lips need none

        return None if self.struck_ring is None else Lip(*self.struck_ring, arcs, rings)

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
    def is_swept(self) -> bool:
        """Return whether hexahedra can be swept through it, of a body that is meshed."""
        return False

    @property
    def given_mesh(self) -> str:
        """Return the name of the file whose mesh is taken as it is; "" where a mesh can be made finer, or there is
        none."""
        return ""

    @property
    def beam_modes(self) -> int | None:
        """Return the modes of a body that is known by its own, as a beam; ``None`` of others."""
        return None

    @property
    def loss(self) -> float:
        """Return the modal damping ratio, as far as it is uniform."""
        return 0.0

    def loss_at(self, frequency: float) -> float:
        """Return the damping ratio of modes at a frequency [rad/s]."""
        return self.loss

    @property
    def slowest(self) -> float:
        """Return the slowest waves in it [m/s]; infinite where they are not known."""
        return math.inf

    def levels(self, band: float | None = None) -> tuple[Applicability, ...]:
        """Return every level of modelling with what speaks for or against it, the cheapest first; ``band``: edge
        [Hz]."""
        return (Applicability("closed form", True, 0.0, f"kind = {self.kind!r}: nothing to discretise"),)

    def level(self, error: float) -> Applicability:
        """Return the cheapest level whose own error is at most ``error``, or the one that the table names."""
        return self.levels()[0]

    def stated(self, error: float = 0.0, rings: int | None = 1) -> Method:
        """Return the method that the table states, at the cheapest level whose own error is at most ``error``."""
        return Method(self.level(error).level, rings=rings, n_modes=self.beam_modes)

    def discrete(self, level: AnyLevel) -> Level:
        """Return the level of the finite elements: a spring's are of the cheapest that leaves nothing out."""
        return "3d"

    def elements_of(self, method: Method) -> Level:
        """Return the level of a method's finite elements: the arcs of a lip leave no sectors alike."""
        return "3d" if method.in_arcs else self.discrete(method.level)

    def memory(self, method: Method, duration: float) -> float:
        """Return how long its g must be right in a run of ``duration`` [s]."""
        return duration

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
    def model_words(self) -> str:
        """Return what its closed form is called in results."""
        return f"{self.kind.replace('_', ' ')}, closed form"

    def closed_form(self) -> GreensFunction | None:
        """Return the body in closed form, where there is one."""
        return None

    @property
    def form_error(self) -> float:
        """Return the relative error of g by the closed form, beside what `beyond` knows."""
        return 0.0

    def beyond(self, level: AnyLevel) -> GreensFunction | None:
        """Return what a level leaves out, to first order: a body that has it; ``None``: nothing is known."""
        return None

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        """Return the body itself where that costs nothing, else what stands for it in pre-runs of ``duration`` [s].

        ``face``: of what touches it.
        """
        if (exact := self.closed_form()) is not None:
            return Surrogate(exact, True, f"the {self.kind} itself")
        return unknown(f"kind = {self.kind!r} does not state the size of the struck face", face)

    def numbers(self, method: Method, coarser: float = 1.0) -> Numbers | None:
        """Return its finite elements in numbers, with elements ``coarser`` times as large; ``None`` where they have
        none."""
        return None

    def measured(self) -> FrequencyResponse | None:
        """Return the response that its poles are fitted to."""
        return None

    def draws(self) -> tuple[GreensFunction, ...]:
        """Return the same body as other noise of its record would have it; none of a body without a record."""
        return ()

    def tried_poles(self) -> tuple[Candidate, ...]:
        """Return the poles of each order that the fit to its record looked at; none of a body without a record."""
        return ()

    # Computing it

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        """Return its Green's function by a method, for runs of ``duration`` [s]; ``mesh_error``: by a coarser mesh,
        too."""
        greens = self.closed_form() if method.n_modes is None else self.body(None, method.n_modes).greens
        assert greens is not None
        return Solved(greens, about={"seat_model": self.model_words}, plane=self.plane)

    def natural_modes(self, wanted: Wanted, watch: Stopwatch, progress: Progress) -> NaturalModes | None:
        """Return its modes, complete by inertia, whatever excites them; ``None`` where there is nothing to take them
        from."""
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


def kinds_of() -> tuple[type[Structure], ...]:
    """Return every kind that there is, by name: subclasses whose ``kind`` is stated."""
    return tuple(sorted(kinds_below(Structure), key=kind_of))
