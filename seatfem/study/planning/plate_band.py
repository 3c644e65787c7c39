"""Number of modes of a plate that strikes: pre-runs with ever more of them, as long as its theory holds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from impact.bodies.body import Body
from impact.greens.base import GreensFunction
from impact.progress import Progress
from impact.runs.budget import SAFETY, larger, times
from seatfem.study.accuracy.other_bodies import with_other_modes
from seatfem.study.accuracy.prerun import Bench, first_look, relative_changes, stand_in_of
from seatfem.study.accuracy.sensitivity import COARSE, Changes
from seatfem.study.impacts.contact import striker_of
from seatfem.study.method import REED_BAND, as_stated, is_given, stated_method
from seatfem.study.safety import MODES_SHARE
from seatfem.study.scene import Scene

LEAST: Final = 1.3  # factor by which a band is widened at a time, at least ...
MOST: Final = 3.0  # ... and at most
MARGIN: Final = 1.3  # on what an error of second order asks for
LOOKS: Final = 3  # bands looked at


@dataclass(frozen=True)
class PlateBand:
    """A scene whose striker is a plate, with its band stated.

    Attributes:
        scene: with it.
        left: relative, measure by measure, what its highest modes leave, as the budget states it.
    """

    scene: Scene
    left: Changes


def in_a_band(scene: Scene, seat: GreensFunction, stopper: Body | None, progress: Progress) -> PlateBand | None:
    """Return the band that the accuracy asks for, or the file states, or the plate's theory ends with; ``None`` for a
    striker that is no plate.

    ``seat``: what stands for it, undivided or in the scene's arcs.
    """
    if (reed := scene.reed.thin_plate) is None:
        return None
    stated = is_given(scene, REED_BAND)
    aim, most = MODES_SHARE * scene.accuracy.target / SAFETY, reed.widest_band
    for _ in range(LOOKS):
        band = stated_method(scene).reed.bandwidth
        assert band is not None
        errors = _left(scene, seat, stopper, progress)
        worst = max((errors[name] for name in scene.accuracy.judged), default=0.0)
        if stated or worst <= aim or band >= most * (1 - 1e-9):
            break
        factor = min(max(MARGIN * (worst / aim) ** 0.5, LEAST), MOST)
        wider = stated_method(scene).replaced({REED_BAND: float(f"{min(factor * band, most):.2g}")})
        scene = as_stated(scene, replace(wider, time_step=None))
    return PlateBand(scene, errors)


def _left(scene: Scene, seat: GreensFunction, stopper: Body | None, progress: Progress) -> Changes:
    striker = stand_in_of(scene, progress)
    bench = Bench(scene, seat, first_look(scene, seat, striker, stopper), striker, stopper)
    dt = bench.affordable(scene.run.filter_width / COARSE)
    own = bench.measures(dt=dt)
    errors: Changes = {}
    for other, share in with_other_modes(striker_of(scene, greens=striker)):
        change = times(share, relative_changes(own, replace(bench, other=other).measures(dt=dt)))
        errors = larger(change, errors or change)
    return errors
