"""How a body is computed: apart from what it is (a structure), and from what is asked of it (a scene)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["rod", "axisymmetric", "harmonics", "sector", "3d"]
"""Descriptions of a body by finite elements, or in their place."""
AnyLevel = Literal["closed form", "spring", "rod", "axisymmetric", "harmonics", "sector", "3d"]
"""The same with what needs no finite elements, and with their static compliance alone."""

Reduction = Literal["auto", "krylov", "modes", "transient", "lanczos", "second_order"]
"""Reductions by name; "auto" chooses."""


@dataclass(frozen=True)
class Aims:
    """What a reduction must reach.

    Attributes:
        bandwidth: highest frequency that must be right [Hz].
        duration: how long g is needed [s].
        tolerance: largest relative error of g inside the bandwidth.
    """

    bandwidth: float
    duration: float
    tolerance: float


@dataclass(frozen=True)
class Method:
    """How one body's Green's function is computed.

    Attributes:
        level: how much of the body is modelled.
        bandwidth: of the reduction [Hz]; ``None`` where nothing is reduced.
        tolerance: of the reduction.
        reduction: by name; "auto" chooses.
        max_vectors: most Krylov vectors or Lanczos steps; ``None``: the reduction's own limit.
        size, contact_size: of the elements, in the bulk and on the struck faces [m]; ``None``: from the bandwidth.
        order: of the elements.
        rings: parts of the struck patch, each a port; ``None``: as a file has them.
        n_modes: of a body known by its own modes, such as a beam; ``None`` where it has none.
    """

    level: AnyLevel = "closed form"
    bandwidth: float | None = None
    tolerance: float = 0.01
    reduction: Reduction = "auto"
    max_vectors: int | None = None
    size: float | None = None
    contact_size: float | None = None
    order: int = 2
    rings: int | None = 1
    n_modes: int | None = None
