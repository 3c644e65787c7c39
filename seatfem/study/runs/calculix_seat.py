"""The seat of a scene as a deck for CalculiX holds it: its mesh, and our matrices of the same without damping."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.progress import Progress
from seatfem.structures.discretise import AnyMesh, matrices, supports_of
from seatfem.structures.formats.calculix_deck import CalculixBody, calculix_body
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.lands import FaceLip, face_lip, land_of
from seatfem.structures.lip import AnyLip
from seatfem.structures.method import Method
from seatfem.structures.model import SecondOrderModel
from seatfem.study.planning.plan import Plan

MOST: Final = 150_000  # unknowns of a seat that is marched by ccx
CHORDS: Final = 720  # of a round line


class DeckError(ValueError):
    """No deck can hold what the plan asks for; the message names the key, the reason and the remedy."""


@dataclass(frozen=True, eq=False)
class DeckSeat:
    """Seat as its deck has it.

    Attributes:
        deck: of the body.
        model: ours, undamped; its ports are the patch, or the parts of ``lip``.
        method: by which it was meshed.
        lip: the struck face in arcs, as the run has them; ``None`` where it is struck all around at once.
    """

    deck: CalculixBody
    model: SecondOrderModel
    method: Method
    lip: FaceLip | None = None

    @property
    def area(self) -> float:
        """Return the area of the patch on its mesh [m^2]."""
        return sum(port.area or math.nan for port in self.model.ports.values())

    @property
    def centre(self) -> Array:
        """Return the centroid (3,) of a flat patch that faces up along z [m]."""
        assert self.model.dofs is not None
        weights = sum((port.area or 0.0) * self.model.expand(port.vector)[2] for port in self.model.ports.values())
        return np.asarray(self.model.dofs.points @ weights / self.area)


def deck_seat(plan: Plan, progress: Progress) -> DeckSeat:
    """Return the seat as the run meshes it, its patch one port. Raises `DeckError`, `ModelError` for what decks
    lack."""
    body = _body(plan)
    method = replace(plan.method.seat, rings=1, lip=None)
    return _of_mesh(body, body.meshes(method, progress)[0], method, None, progress)


def whole_seat(plan: Plan, progress: Progress) -> DeckSeat:
    """Return all of the seat in space, its patch in the parts of the run, on this mesh. Raises as `deck_seat`."""
    body, division = _body(plan), plan.method.seat.division
    method = replace(plan.method.seat, level="3d", rings=1, lip=None)
    mesh, _ = body.meshes(method, progress)
    if (unknowns := 3 * mesh.quality.nodes) > MOST:
        raise DeckError(
            f"seat.mesh: the whole seat has {unknowns} unknowns in space (limit {MOST}), too many for ccx to march; "
            "state a larger seat.mesh.size and contact_size"
        )
    if division.arcs == 1:
        return _of_mesh(body, mesh, method, None, progress, division.rings)
    return _of_mesh(body, mesh, method, _as_face(body.lip(division.arcs, division.rings)), progress)


def _as_face(lip: AnyLip | None) -> FaceLip:
    """Return a ring of a body of revolution as any other face."""
    assert lip is not None
    if isinstance(lip, FaceLip):
        return lip
    edges = np.concatenate(lip.edge_lines(CHORDS))
    land = land_of(np.concatenate([edges, np.zeros((*edges.shape[:2], 1))], axis=2), (0.0, 0.0, 1.0))
    return face_lip(land, lip.arcs, lip.rings)


def _body(plan: Plan) -> Elastic:
    body = plan.scene.seat.elastic
    if body is None:
        raise DeckError(
            f"seat.kind = {plan.scene.seat.kind!r} has no finite elements to write a deck of; give one that is meshed"
        )
    if body.struck_arc is not None:
        raise DeckError("only an arc of the seat's ring is struck: a half section has none; remove seat.arc")
    if held := [support.kind for support in body.supports if support.kind != "sliding"]:
        raise DeckError(f"seat.supports: a {held[0]} support has no place in the deck; use clamped or sliding faces")
    assert not supports_of(body)
    return body


def _of_mesh(
    body: Elastic, mesh: AnyMesh, method: Method, lip: FaceLip | None, progress: Progress, rings: int = 1
) -> DeckSeat:
    level = body.elements_of(method)
    model = matrices(body, mesh, level, progress, rings=rings, lip=lip)
    undamped = SecondOrderModel(model.M, None, model.K, model.ports, model.dofs)
    copies = body.copies.get(level, 1)
    deck = calculix_body(model, body.solids(regions_of(mesh)), struck=body.struck_face, copies=copies)
    return DeckSeat(deck, undamped, method, lip)
