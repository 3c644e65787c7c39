"""Safety factors and margins of error bars, each with its reason; sources of error in words; limits on the
cost of a study.

The safety factor on the sum of an error budget is `impact.runs.variations.safety`. "Target" is the relative accuracy
that the scene asks for; a "share" is a fraction of it, or of the named quantity.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

LEVEL_SHARE: Final = 4  # target over the error that a level of the seat may have at first

# Safety factors on models that stand for better ones.
DOUBT: Final = 3.0
"""Factor by which waves in the seat may exceed those of the estimate (with 2, 4 % of bars were too small), and those of
a seat struck along a lip those of the same struck as a whole (2.6 on a thin plate, tests/study/test_surrogates.py)."""
DOUBT_OF_COARSE: Final = 1.3  # that factor for a coarsely meshed seat; the estimate had 0.6 to 5 times the truth
ONE_PORT_BAR: Final = 1.5  # bar that a run states for one port, over the change by arcs on a half-space

# Coarser and finer models compared for bars; two comparisons, as one change may vanish by chance.
FEWER: Final = 1.4  # ratio of the numbers of reed modes whose change equals the truncation error, and ...
HALF: Final = 2.0  # ... a second ratio, whose change is twice the truncation error
FEW: Final = 10  # number of reed modes below which a comparison with fewer modes says little; ...
MANY: Final = 40  # ... they are then compared with this number as well
OF_MODES: Final = ((1.6, 0.65), (2.56, 0.3))
"""Ratio r, and the truncation error of a plate's modes over the change without those above 1/r of the highest: second
order gives 0.64 and 0.18; 0.3, as the first alone was too small for three of 108 measures."""
ONE_FELT, MANY_FELT = 2.0, 4.0
"""Limits of `modes_felt`, the effective number of modes above 1/2.56 of the highest in a contact: below the first
(middle of a disc, ring all around: 1.0 to 1.6) one mode dominates; from the second on (tip of a strip 6.5, lip in arcs
13 to 28) the highest modes predict the effect of the truncated ones. A flapper's paddle has 2.3."""
BEYOND: Final = ((1.0, 0), (2.0, 0), (1.0, 4))
"""Modes in place of all that yields beyond the highest: (their frequency over its, octaves they span or 0 for one). One
alone may be hidden by the filter."""
HIDDEN: Final = 1.5
"""Factor on the change by the modes of `BEYOND` where one mode dominates, as the time step damps higher ones: with 1, 8
of 186 bars of discs, whose highest modes alone were known, were too narrow, by 1.45 at most."""
ALONE: Final = 2.0  # that factor where no mode can be left out, so that `BEYOND` is the only comparison
HARDLY: Final = 0.7
"""Share of what yields beyond a plate's band below which the modes of a wider band are little of it, so that `BEYOND`
counts, too: a small disc may feel its next mode beyond that band (tests/study/test_plate_modes_felt.py)."""
OPENING: Final = 0.1
"""Largest relative error assumed for the opening time that separates two groups of contacts, and ..."""
OF_IMPULSE: Final = 10.0  # ... that error over the relative error of the impulse
OF_DRAWS: Final = 1.2
"""Factor on the largest change among 24 random draws of a record, 2.3 standard deviations: with the budget's own factor
4. A mode too weak to be identified is missing, which may change as much as noise does (largest seen: 3.6)."""
SHORT: Final = 0.3  # largest part of the run that a hard impact lasts and is marched alone for the error of the step
SHEAR_SHARE: Final = 0.05  # share of the target from which on the shear of the reed counts

# Lower limits of the relative error bars, by source of error.
FLOORS: Final = {"mesh": 1e-5, "reduction": 1e-5, "patch": 1e-5, "record": 1e-5}
"""The square of 0.3 %, the error of g in the band at best. A measure may be stationary in g, such as the plateau of a
rod's force on a stiff seat, ``rho c A v``: a coarser run then shows no change, and only the second order remains."""
FLOOR_OF_SPRING: Final = 2e-3
"""Floor for a spring in place of waves: the square of some 4 %, the error of their effect in an estimate or an initial
velocity. Waves returning during a clamped reed's landing changed its impulse by 0.3 % where both showed nothing."""
WITHIN_PARTS: Final = 4e-3
"""Relative error of a lip in arcs that does not depend on their number, as each arc has one pressure and mean motion.
Weighting the rim of the land differently moved an impulse by 0.2 to 0.5 % (benchmarks/points: pressures at points)."""

# Refinement from one round to the next, and limits on its cost.
MOST_ROUNDS: Final = 9  # most rounds of a run by default
LONGEST: Final = 600.0  # longest expected time [s] of a further round that is begun without --max-time
MEMORY: Final = 0.8  # fraction of the available memory that workers use, as their need is measured on few scenes
FAILURES: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors of packages, factorisations and disk, after which the round before or an estimate serves; others are bugs."""
LOOSER: Final = (0.02, 0.05, 0.1)  # tolerances tried in turn, if none was stated, where the first one is out of reach


SOURCES: Final[Mapping[str, str]] = {
    "mesh": "mesh error",
    "reduction": "reduced model of the seat",
    "time_step": "time step",
    "model": "simplified model of seat or reed",
    "patch": "division of the contact face",
    "striker": "model of the reed",
    "stopper": "stopper",
    "record": "noise of the measured record",
    "lip": "single contact point instead of the lip",
}
OF_A_BODY: Final[Mapping[str, str]] = {"mesh": "mesh error", "reduction": "reduced model"}
STAGES: Final[Mapping[str, str]] = {"striker": "reed", "patch error": "contact face error"}
"""Displayed names of stages of a run."""
BODIES: Final[Mapping[str, str]] = {"striker": "reed", "stopper": "stopper", "seat": "seat"}


def source_in_words(source: str) -> str:
    """Return a source of error in words; one without an entry in `SOURCES` by its name, underscores as blanks."""
    body, _, its = source.partition("'s ")
    if its and body in BODIES:
        return f"{OF_A_BODY.get(its, its.replace('_', ' '))} of the {BODIES[body]}"
    return SOURCES.get(source, source.replace("_", " "))


@dataclass(frozen=True)
class Effort:
    """Limits on the computing effort of a study.

    Attributes:
        workers: number of processes; ``None``: one per core, as far as the memory allows.
        rounds: most rounds of refinement of each scene.
        limit: wall time of one scene [s].
        retry: whether scenes without results in the journal are tried again.
        cluster: address of a dask scheduler, whose workers replace local processes.
    """

    workers: int | None = None
    rounds: int = MOST_ROUNDS
    limit: float = 3600.0
    retry: bool = False
    cluster: str | None = None


USUAL = Effort()
