"""How much model a seat requires: which descriptions apply to it, and the cheapest of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from seatfem.structures.kinds.parts import Material, OrthotropicMaterial
from seatfem.structures.kinds.seats import BarSeat, BlockSeat, DrawnSeat, Plate, RevolvedSeat

Level = Literal["rod", "axisymmetric", "harmonics", "sector", "3d"]
CHEAPEST_FIRST: Final[tuple[Level, ...]] = ("rod", "axisymmetric", "harmonics", "sector", "3d")
QUARTERS: Final = 4  # sectors of a body of revolution, a bar, a block: wide enough to be meshed well


@dataclass(frozen=True)
class Applicability:
    """Whether a level describes a seat.

    Attributes:
        applies: the level can be run at all.
        error: relative error of g that the level itself makes at the band edge; 0 where it leaves nothing out.
        reason: in words.
    """

    level: Level
    applies: bool
    error: float
    reason: str


class LevelError(ValueError):
    """A level that does not describe the seat; the message names key, reason and what does."""


def applicable(seat: DrawnSeat) -> tuple[Applicability, ...]:
    """Every level, the cheapest first, and what speaks for or against it."""
    return (_rod(seat), _axisymmetric(seat), _harmonics(seat), _sector(seat), _solid(seat))


def choose_level(seat: DrawnSeat, error: float) -> Applicability:
    """The level the scene names, or the cheapest whose own error is at most ``error``; of a spring, whose
    compliance finite elements give, the cheapest that leaves nothing out.

    Raises:
        LevelError: the named level does not apply.
    """
    found = applicable(seat)
    if seat.model in ("auto", "spring"):
        limit = error if seat.model == "auto" else 0.0
        return next(level for level in found if level.applies and level.error <= limit)
    named = next(level for level in found if level.level == seat.model)
    if not named.applies:
        others = ", ".join(level.level for level in found if level.applies)
        raise LevelError(f"seat.model = {seat.model!r} does not apply: {named.reason}; what applies: {others}")
    return named


def love_error(seat: BarSeat) -> float:
    """Relative delay of waves at the band edge that a rod without lateral inertia leaves out, nu^2 k^2 r^2/2.

    r^2 = (width^2 + height^2)/12 is the polar radius of gyration squared, k = w/c_0. Source: Love, A Treatise on the
    Mathematical Theory of Elasticity, article 278.
    """
    material = _isotropic(seat)
    k = 2 * math.pi * seat.greens.bandwidth / math.sqrt(material.young / material.density)
    return material.poisson**2 * k**2 * (seat.width**2 + seat.height**2) / 24


def clamp_error(seat: BarSeat) -> float:
    """Relative error of g by the clamped end, which cannot contract sideways: it shortens the rod.

    The static compliance falls by (0.33 to 0.5) nu^2 sqrt(width height)/length over nu = 0.15 to 0.45 and sides of 1:1
    to 1:8 (examples/bar_as_rod.py); g after a few reflections is off by about twice that, so 1.0 is taken.
    """
    return _isotropic(seat).poisson ** 2 * math.sqrt(seat.width * seat.height) / seat.length


def _isotropic(seat: BarSeat) -> Material:
    assert not isinstance(seat.material, OrthotropicMaterial)
    return seat.material


def _rod(seat: DrawnSeat) -> Applicability:
    if not isinstance(seat, BarSeat):
        return Applicability("rod", False, math.inf, "only a straight bar struck on its whole end is a rod")
    if isinstance(seat.material, OrthotropicMaterial) or seat.supports or seat.rayleigh is not None:
        return Applicability(
            "rod", False, math.inf, "the closed form knows an isotropic rod with one clamped end and modal damping"
        )
    delay, end = love_error(seat), clamp_error(seat)
    reason = f"lateral inertia delays waves at the band edge by {delay:.1g}, the clamped end changes g by {end:.1g}"
    return Applicability("rod", True, delay + end, f"{reason}: a rod leaves both out")


def _axisymmetric(seat: DrawnSeat) -> Applicability:
    if obstacle := _not_revolved(seat):
        return Applicability("axisymmetric", False, math.inf, obstacle)
    if _arc(seat) is not None:
        return Applicability(
            "axisymmetric", False, math.inf, "only an arc of the ring is struck: the load is not the axis's"
        )
    return Applicability(
        "axisymmetric", True, 0.0, "body, supports and load are symmetric about the axis: nothing is left out"
    )


def _harmonics(seat: DrawnSeat) -> Applicability:
    if obstacle := _not_revolved(seat):
        return Applicability("harmonics", False, math.inf, obstacle)
    if _arc(seat) is None:
        return Applicability(
            "harmonics",
            False,
            math.inf,
            "the whole ring is struck: harmonic 0 alone, the axisymmetric model, is enough",
        )
    return Applicability(
        "harmonics", True, 0.0, "a body of revolution, loaded off its axis: Fourier harmonics in the angle"
    )


def sectors(seat: DrawnSeat) -> int:
    """Equal sectors between planes of symmetry that the body and its load can be cut into; 1: none."""
    if isinstance(seat, RevolvedSeat | BarSeat | BlockSeat):
        return QUARTERS
    if isinstance(seat, Plate) and seat.struck is None:
        return QUARTERS if seat.layout == "row" else 2 * seat.ports
    return 1


def _sector(seat: DrawnSeat) -> Applicability:
    number = sectors(seat)
    if number < 2:
        return Applicability("sector", False, math.inf, "body and load cannot be cut into equal sectors")
    if _arc(seat) is not None:
        return Applicability("sector", False, math.inf, "only an arc of the ring is struck: the sectors differ")
    if _is_orthotropic(seat):
        return Applicability("sector", False, math.inf, "an orthotropic material turns from sector to sector")
    return Applicability(
        "sector", True, 0.0, f"one of {number} sectors between planes of symmetry stands for the whole"
    )


def _solid(seat: DrawnSeat) -> Applicability:
    if _arc(seat) is not None:
        return Applicability("3d", False, math.inf, "the drawn contact face is the whole ring, not an arc of it")
    return Applicability("3d", True, 0.0, "the whole body")


def _not_revolved(seat: DrawnSeat) -> str:
    if not isinstance(seat, RevolvedSeat):
        return "the geometry is no solid of revolution"
    if _is_orthotropic(seat):
        return "an orthotropic material need not be the same in every meridian"
    return ""


def _is_orthotropic(seat: DrawnSeat) -> bool:
    return any(isinstance(m, OrthotropicMaterial) for m in (seat.material, *seat.materials.values()))


def _arc(seat: DrawnSeat) -> float | None:
    return seat.arc if isinstance(seat, RevolvedSeat) else None
