"""Whether the bodies of a scene can meet as they lie: the reed above what it is to strike."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from impact.quantities import percent
from seatfem.structures.errors import ModelError
from seatfem.structures.outlines import covered_share

if TYPE_CHECKING:
    from seatfem.structures.kinds.structure import Finding
    from seatfem.study.scene.models import Scene

PLATE: Final = 0.97
"""Least share of a struck face that a plate covers: all of it, but for what chords of arcs and sampled points leave."""
BEAM: Final = 0.1
"""The same of a beam, which strikes with one rigid face: with its tip over the middle of a lip it covers a half or a
third, and whatever covers less than a tenth of a ring does not lie over the port."""


def misplaced(scene: Scene) -> Iterator[Finding]:
    """Yield that the reed lies beside the face that it is to strike, in plan, or does not reach across it."""
    contact, reed, seat = scene.contact, scene.reed, scene.seat
    if reed.reach is None and not reed.meets_lips:  # solids strike with a face of their own, as it is stated
        return
    at = reed.free_point if contact.at is None else contact.at
    try:
        over, face = reed.views(at, coarse=True).turned_over(), seat.views(coarse=True)
    except ModelError:  # of faces that cannot be found, which are told where they are needed
        return
    share, least = covered_share(face, over, contact.offset), PLATE if reed.meets_lips else BEAM
    if share is None or share >= least:
        return
    low, high = over.extent
    sides = " x ".join(f"{1e3 * side:.4g}" for side in high - low)
    (a, b), (c, d) = face.contact_box
    struck = f"{1e3 * (c - a):.4g} x {1e3 * (d - b):.4g} mm"
    limit = "all of it" if reed.meets_lips else percent(least)
    words = (
        f"in plan the reed, {sides} mm, covers {percent(share)} of the struck face of the seat, {struck} "
        f"(limit: {limit})"
    )
    if any(contact.offset):
        x, y = (1e3 * each for each in contact.offset)
        text = f"[{x:.4g} mm, {y:.4g} mm]: {words}: the port lies beside the reed; move it nearer"
        yield ("contact", "offset"), text
    elif contact.at is not None:
        text = f"{1e3 * contact.at:.4g} mm: {words}: it lies beside the port; move the contact, or take a wider reed"
        yield ("contact", "at"), text
    else:
        yield ("reed",), f"{words}: take a wider reed or paddle, or a smaller port"
