"""All kinds of structures that there are, by name."""

from __future__ import annotations

from seatfem.fields import kind_of, kinds_below
from seatfem.structures.kinds.structure import Structure


def kinds_of() -> tuple[type[Structure], ...]:
    """Every kind that there is, by name: subclasses whose ``kind`` is stated."""
    return tuple(sorted(kinds_below(Structure), key=kind_of))
