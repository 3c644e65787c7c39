"""One structure of several kinds, as a table of a scene."""

from __future__ import annotations

from typing import Annotated, Any, Union

from pydantic import Field

from seatfem.structures.kinds import Structure


def any_kind(kinds: tuple[type[Structure], ...]) -> Any:
    """One of these kinds of structures, by its ``kind``."""
    return Annotated[Union[kinds], Field(discriminator="kind")]  # noqa: UP007
