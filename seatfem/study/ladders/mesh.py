"""Ladders of the meshes: element sizes in the bulk and at the contact, and the order of the elements."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.runs.variations import Terms
from seatfem.structures.estimates.surrogate import ERRORS, mesh_error
from seatfem.structures.kinds import Structure
from seatfem.structures.method import MOST_MODES, Method
from seatfem.study.ladders.ladder import RATIO, BodyLadder, ComputedRun, Elements, Ladder, Neighbour, Option
from seatfem.study.method import CONTACT_SIZE, ORDER, SIZE, RunMethod
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.sensitivity import Changes
from seatfem.study.safety import MESH_BAR, MESH_BAR_OF_ARCS, MESH_ORDER
from seatfem.study.scene import Run
from seatfem.units import write_quantity

COARSEST_OF_ARCS: Final = 0.1  # error of g by a mesh for a lip in arcs: coarser ones cost a round more than they save
COARSER: Final = (-2, -1)  # powers of `RATIO` in a trade


@dataclass(frozen=True)
class ElementSize(BodyLadder):
    """Element sizes of a body; the coarser mesh behind the stated error is the neighbour."""

    falls: bool = True

    def describe(self, value: float) -> str:
        """Return a size with its unit."""
        return write_quantity(value, "length", 3)

    def finer(self, value: float, factor: float, run: Run, reed: Structure) -> float | None:
        """Return a smaller size, the mesh converging with order `MESH_ORDER`."""
        return float(f"{value / factor ** (1 / MESH_ORDER):.2g}") if self.role == "seat" else None

    def neighbours(self, run: ComputedRun) -> Terms | None:
        """Return the run on the coarser mesh, or g larger by the stated error of the mesh."""
        if self.key == CONTACT_SIZE:  # made coarser with the bulk
            return ()
        solved = run.solved(self.role)
        assert solved is not None
        if solved.coarser is None:
            return run.with_larger_g(self.role, solved.greens.error_estimate.mesh)
        return ((run.with_greens(self.role, solved.coarser, 1 / (solved.refinement - 1)),),)

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield the meshes for each error of g."""
        if self.key != SIZE or not context.reduced or option.seat.exact:
            yield option
            return
        band = option.seat.bandwidth or 0.0
        for error, changes in _meshes(context, band):
            method = replace(context.elements(band, context.tolerances[0], error), level=option.seat.level)
            run = replace(option.method, seat=method)
            elements = Elements(error, *context.elements_of(method), method.tolerance)
            yield replace(option, method=run, changes={**option.changes, **changes}, elements=elements)

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield coarser meshes."""
        if self.key == SIZE and self.role == "seat" and centre.seat.size is not None:
            for k in COARSER:
                values = {key: value / RATIO**k for key in (SIZE, CONTACT_SIZE) if (value := centre.value(key))}
                yield Neighbour(f"mesh / {RATIO**k:.2f}", "mesh", values)


def _meshes(context: PlanningContext, band: float) -> Iterator[tuple[float, Mapping[str, Changes]]]:
    """Yield the errors of g that meshes are made for, and what they leave in the measures, if known beforehand; none is
    finer than the first that leaves less than any target considered can tell."""
    if not context.drawn:
        yield 0.0, {}
        return
    before = None
    for error in ERRORS:
        if context.arcs is not None and error > COARSEST_OF_ARCS:
            continue
        sizes = context.sizes(band, error)
        if sizes != before:
            assert context.patch is not None
            of_mesh = mesh_error(context.patch, band, sizes, context.stated.seat.order)
            bar = MESH_BAR if context.arcs is None else MESH_BAR_OF_ARCS
            yield error, {SIZE: (changes := context.per_g(bar * of_mesh))}
            if context.sensitivity.worst(changes) <= context.sensitivity.finest:
                return
        before = sizes


def too_many_modes(context: PlanningContext, method: Method) -> bool:
    """Return whether the modes of a body in space, struck in arcs, would be too many to look for."""
    model, _ = context.elements_of(method)
    return model is not None and not model.section and model.kept is not None and model.kept > MOST_MODES


@dataclass(frozen=True)
class ElementOrder(Ladder):
    """The order of the seat's elements; the mesh error is that of either."""

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield linear elements."""
        if centre.seat.size is not None:
            yield Neighbour("order 1", "order", {ORDER: 1})
