"""The ladder of remedies for CAD that cannot be meshed as it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from seatfem.structures.shapes import GeometryError


@dataclass(frozen=True)
class Rung:
    """``heal``: sew and repair the shapes first; ``curvature``: least elements per full turn; ``options``: gmsh's."""

    name: str
    heal: bool = False
    curvature: int = 0
    options: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


MESH_ADAPT, FRONTAL = 1, 4
LADDER = (
    Rung("as it is"),
    Rung("shapes healed", heal=True),
    Rung("shapes healed, finer where it curves", heal=True, curvature=16),
    Rung(
        "shapes healed, other meshing algorithms",
        heal=True,
        curvature=16,
        options=MappingProxyType({"Mesh.Algorithm": MESH_ADAPT, "Mesh.Algorithm3D": FRONTAL}),
    ),
)


class LadderError(RuntimeError):
    """Every rung failed; the message tells what failed on each, and where."""


def climb(what: str, rungs: Sequence[Rung], attempt: Callable[[Rung], None], where: Callable[[], str]) -> list[str]:
    """Try the rungs in turn until one holds; returns notes on those that failed and on the one that held.

    ``what``: is meshed; ``where``: the place of the last failure. A `GeometryError` is no failure to mesh and ends the
    climb. Raises `LadderError` after the last rung.
    """
    failed: list[str] = []
    for rung in rungs:
        try:
            attempt(rung)
        except GeometryError:
            raise
        except Exception as error:
            place = where()
            failed.append(f"{rung.name}: {error}" + (f" ({place})" if place else ""))
        else:
            return [*(f"not meshed {text}" for text in failed), f"meshed with {rung.name}"] if failed else []
    raise LadderError(f"{what}: cannot be meshed; " + "; ".join(failed))
