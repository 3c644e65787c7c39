"""In how many arcs a lip is divided: pre-runs with ever fewer, of the striker itself on a half-space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.bodies.body import Body
from impact.progress import Progress
from impact.runs.budget import larger, safety, times
from seatfem.structures.estimates.arcs import in_arcs
from seatfem.structures.estimates.surrogate import Surrogate
from seatfem.structures.rings import MOST_PORTS, OF_TWICE, Division, arcs_joined, as_a_whole, divided_less, parts_behind
from seatfem.study.accuracy.prerun import MOST as MOST_STEPS
from seatfem.study.accuracy.prerun import Bench, first_look, relative_changes, stand_in_of
from seatfem.study.accuracy.sensitivity import COARSE, Changes
from seatfem.study.impacts.contact import striker_of
from seatfem.study.impacts.simpler import simpler_bodies
from seatfem.study.method import PORTS, as_stated, is_given, stated_method
from seatfem.study.safety import ARCS_SHARE
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import lip_of

FEWEST: Final = 16  # arcs: fewer tell nothing of how they converge
MOST: Final = 64  # that are chosen without being asked for


@dataclass(frozen=True)
class Arcs:
    """A scene with its lip in arcs.

    Attributes:
        scene: with their number stated.
        surrogate: its seat in pre-runs.
        left: what the arcs leave, relative, measure by measure.
    """

    scene: Scene
    surrogate: Surrogate
    left: Changes


def in_some_arcs(scene: Scene, surrogate: Surrogate, stopper: Body | None, progress: Progress) -> Arcs | None:
    """The lip in as many arcs as the accuracy asks for, or as the file states; ``None``: it is struck as a whole."""
    usual = stated_method(scene).ports
    if usual in (None, 1) or surrogate.exact or surrogate.patch is None:
        return None
    assert usual is not None
    stated = is_given(scene, PORTS)
    most = usual if stated else min(MOST, MOST_PORTS // scene.contact.rings)
    lip = lip_of(scene, most)
    assert lip is not None
    most = most if stated else lip.whole(most)
    finest = _with(scene, parts_behind(Division(most, scene.contact.rings)).arcs)
    seat = surrogate_in_arcs(finest, surrogate).greens
    striker, there = stand_in_of(finest, progress), Division.of(seat)
    bench = Bench(finest, seat, first_look(finest, seat, striker, stopper), striker, stopper)
    dt = bench.affordable(scene.run.filter_width / COARSE)
    found: dict[int, Mapping[str, float]] = {}

    def measures(arcs: int) -> Mapping[str, float]:
        if arcs not in found:
            fewer = None if striker is None else arcs_joined(striker, there, arcs)
            less = divided_less(seat, Division(arcs, there.rings))
            found[arcs] = Bench(finest, less, bench.window, fewer, stopper).measures(dt=dt)
        return found[arcs]

    def left_by(arcs: int) -> Changes:
        """What twice as many change, as the budget states it, and all that the most looked at do; of the most that can
        be, what half as many change."""
        if arcs == there.arcs:
            return times(OF_TWICE - 1, relative_changes(measures(arcs), measures(arcs // 2)))
        of_twice = times(OF_TWICE, relative_changes(measures(arcs), measures(2 * arcs)))
        return larger(of_twice, relative_changes(measures(arcs), measures(there.arcs)))

    chosen, aim = most, ARCS_SHARE * scene.accuracy.target
    while not stated and chosen // 2 >= FEWEST and lip.whole(chosen // 2) == chosen // 2:
        left = left_by(chosen // 2)
        if any(safety(name) * left[name] > aim for name in scene.accuracy.measures):
            break
        chosen //= 2
    here = _with(scene, chosen)
    return Arcs(here, surrogate_in_arcs(here, surrogate), left_by(chosen))


def in_more_arcs(scene: Scene, surrogate: Surrogate, arcs: Arcs, beside: Changes) -> Arcs:
    """Twice as many, where what stands ``beside`` them uses up half of the target: then they may use up half as much.

    ``scene``: with their number stated by the plan; ``surrogate``: of the whole lip.
    """
    target, asked = scene.accuracy.target, scene.accuracy.measures
    full = any(safety(name) * beside[name] > target / 2 for name in asked)
    few = any(safety(name) * arcs.left[name] > ARCS_SHARE / 2 * target for name in asked)
    twice = 2 * (stated_method(scene).ports or 1)
    if not (full and few) or twice * scene.contact.rings > MOST_PORTS:
        return replace(arcs, scene=scene)
    more = _with(scene, twice)
    return Arcs(more, surrogate_in_arcs(more, surrogate), times(0.5, arcs.left))


def of_simpler(bench: Bench) -> Mapping[str, Changes]:
    """What one port in place of the arcs, and a beam in place of the plate, change, relative, by the model's name.

    They are told, and not chosen: one port saves what 16 arcs cost, less than a second, and no bar holds its error; to
    know a beam's, the plate must be computed.
    """
    scene, division = bench.scene, Division.of(bench.seat)
    if division.arcs == 1 or bench.striker is None:
        return {}
    bodies = simpler_bodies(scene, striker_of(scene, None, bench.striker), division)
    dt, start = scene.run.filter_width / COARSE, bench.window.start
    longest = min(scene.run.duration - start, MOST_STEPS * dt)  # a beam stays longer than the plate does
    bench = replace(bench, window=replace(bench.window, duration=longest))
    here, whole = bench.measures(dt=dt), as_a_whole(bench.seat)
    found = {name: replace(bench, seat=whole, other=body).measures(dt=dt) for name, body in bodies}
    return {name: relative_changes({m: here[m] for m in here if m in there}, there) for name, there in found.items()}


def surrogate_in_arcs(scene: Scene, surrogate: Surrogate) -> Surrogate:
    """The surrogate of a seat whose lip is in the arcs that the scene states."""
    lip, whole, patch = lip_of(scene), surrogate.greens.modal, surrogate.patch
    assert lip is not None
    assert whole is not None
    assert patch is not None
    squared = (patch.c_p / patch.c_s) ** 2
    poisson = (squared - 2) / (2 * (squared - 1))
    young = 2 * patch.density * patch.c_s**2 * (1 + poisson)
    greens = in_arcs(whole, lip, young, poisson, patch.impedance)
    return Surrogate(greens, False, f"{surrogate.words}, in {lip.arcs} arcs", patch)


def _with(scene: Scene, arcs: int) -> Scene:
    return as_stated(scene, stated_method(scene).along(scene, arcs))
