"""The local compliance of struck patches, and laws that hold it, too: it counts once (docs/methods.md)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from impact.greens.base import Array
from impact.march.laws import HertzOnPatch, Law
from seatfem.fields import Contradictions
from seatfem.structures.kinds.structure import Structure
from seatfem.study.scene.laws import ContactLaw
from seatfem.study.scene.lips import ContactGeometry
from seatfem.study.scene.problems import scene_error
from seatfem.units import write_quantity


def law_of_part(law: ContactLaw, share: float, *bodies: Structure) -> Law:
    """Return the law of a ``share`` of the contact between ``bodies``; of all of it without the local compliance of
    their patches, where the law holds that, too."""
    local = sum(body.local_share.compliance for body in bodies) if law.holds_indentation else 0.0
    return law.take_out_patches(local) if local > 0 and share == 1.0 else law.law(share)


def holds_patches(geometry: ContactGeometry) -> bool:
    """Return whether the law at the seat holds the local compliance of patches: these are then loaded as a whole."""
    bodies = geometry.seat, geometry.reed
    return geometry.contact.law.holds_indentation and any(body.local_share.compliance > 0 for body in bodies)


def unknown_shares(geometry: ContactGeometry) -> Contradictions:
    """Yield contacts under a law that holds the indentation of both bodies, of patches whose part in it is not known:
    faces of an unknown share, and faces in parts, which share one indentation."""
    for table, law, parts, body in _contacts(geometry):
        if not law.holds_indentation:
            continue
        words = f"{law.kind!r} holds the local indentation of both bodies"
        remedy = "or state a law of kind signorini or spring"
        for role, each in ((table, body), ("reed", geometry.reed)):
            own = each.local_share
            where = "seat" if role == "contact" else role
            if own.unknown:
                yield f"{table}.law", f"{words}; the {where}, of kind {each.kind!r}, {own.unknown}, {remedy}"
            elif own.compliance > 0 and parts > 1:
                key = (
                    "contact.ports = 1 and contact.rings = 1"
                    if table == "contact"
                    else "stopper.arcs = 1 without a profile"
                )
                yield f"{table}.law", f"{words}; the shares of {parts} parts are not known: take {key}, {remedy}"


def _contacts(geometry: ContactGeometry) -> Iterator[tuple[str, ContactLaw, int, Structure]]:
    contact, stopper = geometry.contact, geometry.stopper
    seat, holds = geometry.seat, contact.law.holds_indentation
    arcs = contact.ports or 1
    if contact.ports is None and holds and not (seat.lip_face.no_lip or seat.local_share.unknown):
        arcs = geometry.usual_ports
    yield "contact", contact.law, arcs * contact.rings, geometry.seat
    if stopper is not None:
        yield "stopper", stopper.law, stopper.parts.count, stopper.body


def check_patches(geometry: ContactGeometry, laws: Sequence[Law], force: Array) -> None:
    """Raise `SceneError` for a patch that is smaller than the contact at the largest of its forces, (n,) of one contact
    or (n, p) [N]."""
    for number, law in enumerate(laws):
        if not isinstance(law, HertzOnPatch):
            continue
        largest = float(force.reshape(len(force), -1)[:, number].max(initial=0.0))
        if largest <= law.largest:
            continue
        table, _, _, body = tuple(_contacts(geometry))[min(number, 1)]
        pairs = (("seat" if table == "contact" else table, body), ("reed", geometry.reed))
        keys = " and ".join(f"{role}.{key}" for role, each in pairs for key in each.local_share.sizes)
        raise scene_error(
            f"{table}.law",
            f"the contact becomes larger than the struck patch: of {write_quantity(largest, 'force')} the law without "
            f"the patch's own local compliance is known up to {write_quantity(law.largest, 'force')}; make {keys} at "
            f"least {(largest / law.largest) ** (1 / 3):.3g} times as large",
        )
