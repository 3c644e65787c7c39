"""Safety factors and margins of plans and error bars, each with its reason; sources of error in words; limits of a
study's effort.

Those of the error budget itself, on the sum of its sources, are `impact.runs.variations.SAFETY` and `STRESS_SAFETY`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

# What a plan aims at.
AIM: Final = 0.8  # share of the target that a plan may use: predictions are not exact, a second round costs more
SPARE: Final = 1.3  # factor on the least error that is aimed at where the target is out of reach
FREE: Final = 0.1  # share of the cost that may be spent on a zero error instead of all that is allowed
SIMPLER: Final = 1.5  # largest cost of a seat without waves, over that of one with them, at which it is chosen
ENDLESS: Final = 1e9  # bar in place of an infinite one, of a measure that vanishes in a model: it can be compared
STEP_UP: Final = 2.5  # ratio of the targets of the alternatives to the target
FINEST: Final = 0.05  # share of the tightest target considered that the finest rungs of a ladder must reach
MODES_SHARE: Final = 0.5  # share of it that the most modes of a plate that strikes must reach
ARCS_SHARE: Final = 0.5  # share of the target that the arcs of a lip may use
ACROSS_SHARE: Final = 0.25  # share of the target that the rings across the arcs may use
LIP_SHARE: Final = 0.25  # share of the target that one port in place of arcs may use: with 0.5, arcs after it cost more
LEVEL_SHARE: Final = 4  # share of the target that a level may use by itself, as 1/n, without a plan

# What a plan predicts of the bars that its run will state, over what it sees beforehand.
DOUBT: Final = 2.0  # factor by which waves in the seat may be stronger than in the surrogate
DOUBT_OF_ARCS: Final = 3.0  # that factor for a lip in arcs: with 2, four of 100 measures were outside their bars
DOUBT_OF_COARSE: Final = 1.3  # that factor for a coarse real seat; the surrogate had 0.6 to 5 times the truth
OVERSTATED: Final = 20.0  # factor by which a surrogate in arcs may overstate waves; above it, no coarse seat is made
LONGEST_LOOK: Final = {False: 1.5, True: 4.0}
"""Longest predicted time [s] for a coarse real seat, drawn (false) or from a file (true): a plan is quick."""
DOUBT_OF_ONE_PORT: Final = 3.0  # safety factor of one port in place of arcs: with 1.5, 3 of 7 choices were too coarse
ONE_PORT_BAR: Final = 1.5  # bar that a run states for one port, over the change by arcs on a half-space
MESH_BAR: Final = 2.0  # bar that a run states for its mesh, over the error of the mesh
MESH_BAR_OF_ARCS: Final = 3.0  # that ratio for the arcs of a lip, which feel less of the body and more of its surface
PATCH_BAR: Final = 2.0  # bar that a run states for its patch, over the error of the static compliance
UNKNOWN_PATCH: Final = 0.03  # error of the compliance of a patch of which nothing is known, relative
UNKNOWN_BODY: Final = 0.25  # band times filter width, for a body nothing is known of
FEWER_POLES: Final = 0.7  # highest pole of a reduction that is counted on, over the usual one
STIFFER: Final = 0.5  # g of the seat, over the surrogate's, that confirms the number of reed modes
REED_MARGIN: Final = 1.3  # safety factor on the change by a reed's modes with a surrogate seat
OFF: Final = 0.02  # relative change of g for its sensitivity: large beside round-off, small beside 1

# What bars and plans compare with: one change may be small by accident, two seldom are.
FEWER: Final = 1.4  # ratio of the numbers of reed modes whose change is the error left, and ...
HALF: Final = 2.0  # ... another ratio, whose change is twice the error left
FEW: Final = 10  # number of reed modes below which fewer of them show little; ...
MANY: Final = 40  # ... this number is then compared with
MUCH_SHORTER: Final = 8  # least ratio of a stated step to the shortest compared: waves may cross within the step
OF_MODES: Final = ((1.6, 0.65), (2.56, 0.3))
"""By ratio, the error of a plate's modes over what those above that part of the highest change: of second order (0.64
and 0.18), and more of the second: the first alone was too small for three of 108 measures of seed 403."""
ONE_FELT, MANY_FELT = 2.0, 4.0
"""Modes above 1/2.56 of the highest that a contact feels: below the first, as the middle of a disc and a ring all
around (1.0 to 1.6), one is alone; from the second on, as a strip's tip (6.5) and a lip in arcs (13 to 28), they tell
what those beyond do. A flapper's paddle feels 2.3."""
BEYOND: Final = ((1.0, 0, MANY_FELT), (2.0, 0, MANY_FELT), (4.0, 0, ONE_FELT), (1.0, 4, MANY_FELT))
"""Beyond a plate's last mode, where a contact feels fewer than so many, one mode is tried at these times its frequency,
or modes over so many octaves from there. Of 180 numbers of free discs on springs from softer to a hundred times
stiffer than they, bands of 40 to 400 kHz, the highest modes alone were too small for 36, with one mode beyond for 3,
with octaves for 1; one two octaves on tells where the filter hides the nearer ones (6 mm, 40 kHz, 3 us: 14 % off)."""
HIDDEN: Final = 1.5
"""Factor on what these change at the step of a run, which smears what rings faster, where one is alone: with 1, 8 of
186 bars of these discs were too narrow, by 1.45 at most."""
ALONE: Final = 2.0  # that factor where no mode can be left out, so that nothing else tells
OPENING: Final = 0.1
"""Largest relative error of an opening that ends a group of contacts, or that does not, and ..."""
OF_IMPULSE: Final = 10.0  # ... that error over the relative error of the impulse
OF_DRAWS: Final = 1.2
"""Factor on the largest change among 24 draws of a record, 2.3 deviations: with the budget's own factor 4 deviations. A
mode that is too weak to be found is left out, and may change as much as noise does (seed 415: 3.6)."""
SHORT: Final = 0.3  # share of the run up to which an impact is marched alone with half the step; above, the run is
SHEAR_SHARE: Final = 0.05  # share of the target from which on the shear of the reed counts

# What no bar is below, of a source that can err: relative, by its name.
FLOORS: Final = {"mesh": 1e-5, "reduction": 1e-5, "patch": 1e-5, "record": 1e-5}
"""Squares of 0.3 %, to which g is known in the band at best. A measure may not follow g to first order, as the plateau
of a rod's force on a seat that hardly yields, ``rho c A v``: then no coarser run changes it, the second order is
left."""
FLOOR_OF_SPRING: Final = 2e-3
"""Floor of a spring in place of waves: a surrogate or a first velocity knows them to some 4 %, whose square this is.
Waves that come back into a clamped reed's landing changed 0.3 % of its impulse where both showed nothing."""
WITHIN_PARTS: Final = 4e-3
"""Relative error of a lip in arcs that does not depend on their number: each has one pressure and its mean motion. How
the rim of the land is weighed moved an impulse by 0.2 to 0.5 % (benchmarks/points has pressures at points)."""

# How much finer a round is than the one before, and what it may take.
LEAST_FINER: Final = 1.6  # least factor by which a source is made smaller: less is not worth a round ...
MOST_FINER: Final = 4.0  # ... and largest one, at once: the orders of convergence are not exact
MESH_ORDER: Final = 1.0  # order of convergence that is assumed, as clamped corners may have it
RESERVE: Final = 0.2  # share of the error allowed that is kept in reserve for the other sources
MOST_ROUNDS: Final = 4  # most rounds of a run by default
LONGEST: Final = 600.0  # longest time [s] of a seat, or a further round, that is chosen unless it is stated
MEMORY: Final = 0.8  # share of the available memory that is used: predictions are no better
MOST_OFF: Final = 30.0  # largest factor by which a predicted time is corrected from the rounds before
TELLING: Final = 1.0  # least predicted time [s] that is compared: shorter ones show one-off costs, such as compiling
LOOSER: Final = (0.02, 0.05, 0.1)  # tolerances tried in turn, if none was stated, where the planned one is out of reach


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
"""Stages of a run that are shown under other names."""
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
