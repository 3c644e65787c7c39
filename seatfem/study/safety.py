"""Safety factors and margins of plans and error bars, each with its reason; sources of error in words; limits of a
study's effort.

Those of the error budget itself, on the sum of its sources, are `impact.runs.variations.SAFETY` and `STRESS_SAFETY`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

# What a plan aims at.
AIM: Final = 0.8  # part of the target that a plan may use up: predictions are not exact, a second round costs more
SPARE: Final = 1.3  # where the target is out of reach: the least error, times this, is aimed at
FREE: Final = 0.1  # part of the cost that may be spent on an error of nothing instead of all that is allowed
SIMPLER: Final = 1.5  # cost of a seat without waves over that of one with them, up to which it is taken
ENDLESS: Final = 1e9  # bar in place of an infinite one, of a measure that a model makes vanish: they can be compared
STEP_UP: Final = 2.5  # ratio of the targets of the alternatives to the target
FINEST: Final = 0.05  # part of the tightest target looked at that the finest rungs of a ladder must reach
MODES_SHARE: Final = 0.5  # the same of the modes of a plate that strikes
ARCS_SHARE: Final = 0.5  # part of the target that the arcs of a lip may use up
ACROSS_SHARE: Final = 0.25  # the same of the rings across them
LIP_SHARE: Final = 0.25  # the same of one port in their place: with 0.5, arcs after it cost more than arcs at once
LEVEL_SHARE: Final = 4  # without a plan: the part of the target that a level may use up by itself

# What a plan predicts of the bars that its run will state, over what it sees beforehand.
DOUBT: Final = 2.0  # the surrogate's waves, over which the seat's may be stronger
DOUBT_OF_ARCS: Final = 3.0  # the same of a lip in arcs: with 2, four of 100 measures were outside their bars
DOUBT_OF_COARSE: Final = 1.3  # of a coarse real seat in place of the surrogate, which knew 0.6 to 5 times the truth
OVERSTATED: Final = 20.0  # by which waves of a surrogate in arcs may be too strong; above, no coarse seat is made
LONGEST_LOOK: Final = {False: 1.5, True: 4.0}
"""[s] that a coarse real seat may take, predicted, drawn or from a file: a plan is quick."""
DOUBT_OF_ONE_PORT: Final = 3.0  # of one port in place of arcs: with 1.5, runs found three of seven choices too coarse
ONE_PORT_BAR: Final = 1.5  # the bar that a run states for one port, over what arcs on a half-space change
MESH_BAR: Final = 2.0  # the bar that a run states for its mesh, over the error that the mesh has
MESH_BAR_OF_ARCS: Final = 3.0  # the same of the arcs of a lip, which see less of the body and more of its surface
PATCH_BAR: Final = 2.0  # what a run states for its patch, over what the static compliance has of it
UNKNOWN_PATCH: Final = 0.03  # of the compliance, of a patch that nothing is known of
UNKNOWN_BODY: Final = 0.25  # band times filter width, for a body nothing is known of
FEWER_POLES: Final = 0.7  # highest pole of a reduction that is counted on, over the usual one
STIFFER: Final = 0.5  # g of the seat that confirms the number of reed modes, over the surrogate's
REED_MARGIN: Final = 1.3  # on what a reed's modes change with a surrogate seat
OFF: Final = 0.02  # relative change of g behind its sensitivity: large beside round-off, small beside 1

# What bars and plans compare with: one change may be small by accident, two seldom are.
FEWER: Final = 1.4  # ratio of the reed's numbers of modes whose change is what is left, and ...
HALF: Final = 2.0  # ... another one, whose change is taken for twice of what is left
FEW: Final = 10  # reed modes below which leaving some of them out tells little; ...
MANY: Final = 40  # ... then this number does
MUCH_SHORTER: Final = 8  # a stated step over the shortest that it is compared with: waves may cross within the step
OF_MODES: Final = ((1.6, 0.65), (2.56, 0.3))
"""By ratio, the error of a plate's modes over what those above that part of the highest change: of second order (0.64
and 0.18), and more of the second: the first alone was too small for three of 108 measures of seed 403."""
UNEVEN: Final = 1.3
"""Compliance of a plate's contact beyond its last mode over that of the modes down to 1/2.56 of it, above which these
are too few to tell how the next ones go on: twice what modes leave that lie evenly, 1/(2.56 - 1)."""
BEYOND: Final = (1.0, 2.0)
"""Over the highest mode, where one may lie that nothing tells of: its blow may miss the reed's at one of the two."""
OPENING: Final = 0.1
"""By how much an opening that ends a group of contacts, and one that does not, may be off: at most, and ..."""
OF_IMPULSE: Final = 10.0  # ... so many times what the impulse is off
OF_DRAWS: Final = 1.2
"""Of the largest change among 24 draws of a record, 2.3 deviations: with the budget's own factor 4 deviations. A mode
that is too weak to be told is left out, and may change as much as noise does (seed 415: 3.6 deviations)."""
SHORT: Final = 0.3  # part of the run up to which an impact is marched alone with half the step, above: the run
SHEAR_SHARE: Final = 0.05  # of the target, from which on the shear of the reed counts

# What no bar is below, of a source that can err: relative, by its name.
FLOORS: Final = {"mesh": 1e-5, "reduction": 1e-5, "patch": 1e-5, "record": 1e-5}
"""Squares of 0.3 %, to which g is known in the band at best. A measure may not follow g to first order, as the plateau
of a rod's force on a seat that hardly yields, ``rho c A v``: then no coarser run changes it, the second order is
left."""
FLOOR_OF_SPRING: Final = 2e-3
"""The same of a spring in place of waves: a surrogate or a first velocity knows them to some 4 %, whose square this is.
Waves that come back into a clamped reed's landing changed 0.3 % of its impulse where both saw nothing."""
WITHIN_PARTS: Final = 4e-3
"""Relative, what the parts of a lip in arcs leave beside their number: each bears one pressure and moves as its mean.
How the rim of the land is weighed moved an impulse by 0.2 to 0.5 % (benchmarks/points has pressures at points)."""

# How much finer a round is than the one before, and what it may take.
LEAST_FINER: Final = 1.6  # factor by which a source is made smaller at least: less is not worth a round ...
MOST_FINER: Final = 4.0  # ... and at most, in one go: the orders of convergence are not exact
MESH_ORDER: Final = 1.0  # of convergence that is counted on, as clamped corners may have it
RESERVE: Final = 0.2  # part of the error allowed that is kept in reserve for the other sources
MOST_ROUNDS: Final = 4  # of a run, unless it is told otherwise
LONGEST: Final = 600.0  # a seat, or a further round, that takes longer [s] is not chosen, only obeyed
MEMORY: Final = 0.8  # part of the available memory that is used: predictions are that good
MOST_OFF: Final = 30.0  # by which a predicted time is corrected at most, from the rounds before
TELLING: Final = 1.0  # [s]: what was predicted to take less tells of one-off costs, such as compiling
LOOSER: Final = (0.02, 0.05, 0.1)  # tolerances, where none was stated and the one planned cannot be had


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
"""Stages of a run whose names are shown in other words."""
BODIES: Final[Mapping[str, str]] = {"striker": "reed", "stopper": "stopper", "seat": "seat"}


def in_words(source: str) -> str:
    """Return a source of error of the budget in words; one that is new by its name."""
    body, _, its = source.partition("'s ")
    if its and body in BODIES:
        return f"{OF_A_BODY.get(its, its.replace('_', ' '))} of the {BODIES[body]}"
    return SOURCES.get(source, source.replace("_", " "))


@dataclass(frozen=True)
class Effort:
    """Limits on what a study may take.

    Attributes:
        workers: processes; ``None``: one a core, as far as the memory does.
        rounds: of refinement of each scene, at most.
        limit: seconds of the clock for one scene.
        retry: whether scenes that have no numbers in the journal are tried again.
        cluster: address of a scheduler of dask, whose workers take the place of processes here.
    """

    workers: int | None = None
    rounds: int = MOST_ROUNDS
    limit: float = 3600.0
    retry: bool = False
    cluster: str | None = None


USUAL = Effort()
