"""Which cases there are: every specimen with every mutation that suits it, so often that the total is reached."""

from collections.abc import Sequence
from random import Random

from .corpus import Specimen
from .trial import Case, mutations_of


def cases(specimens: Sequence[Specimen], total: int, seed: int, *, only: str = "") -> tuple[Case, ...]:
    """At least ``total`` cases (fewer with ``only``), in an order that mixes them; the first ones are a fair sample."""
    weight = sum(specimen.share for specimen in specimens)
    found: list[Case] = []
    for specimen in specimens:
        names = mutations_of(specimen)
        count = max(1, round(total * specimen.share / weight))
        draws = [Case(specimen, names[k % len(names)], k // len(names), seed) for k in range(count)]
        found += draws if only in specimen.name else []
    Random(seed).shuffle(found)
    return tuple(found)
