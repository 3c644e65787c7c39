"""All kinds of structures that there are, by name."""

from __future__ import annotations

from typing import Literal, get_args, get_origin

from seatfem.structures.kinds.structure import Structure


def kinds_of(base: type[Structure] = Structure) -> tuple[type[Structure], ...]:
    """Every kind that there is, by name: subclasses whose ``kind`` is stated."""
    found: list[type[Structure]] = []
    for each in base.__subclasses__():
        found += [*([each] if kind_of(each) else []), *kinds_of(each)]
    return tuple(sorted(dict.fromkeys(found), key=kind_of))


def kind_of(table: type[Structure]) -> str:
    """The name of a kind; "" of what several kinds have in common."""
    annotation = table.__annotations__.get("kind")
    field = table.model_fields.get("kind")
    annotation = field.annotation if field is not None else annotation
    return str(get_args(annotation)[0]) if get_origin(annotation) is Literal else ""
