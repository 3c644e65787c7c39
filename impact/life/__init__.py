"""Fatigue under repeated blocks of stress: cycles, mean stress, S-N curves, Miner's sum, criteria of several axes."""

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from impact.life.curves import Curve as Curve
    from impact.life.curves import LifeError as LifeError
    from impact.life.curves import basquin as basquin
    from impact.life.curves import tabled as tabled
    from impact.life.cycles import Cycles as Cycles
    from impact.life.cycles import from_peak as from_peak
    from impact.life.cycles import rainflow as rainflow
    from impact.life.cycles import reversals as reversals
    from impact.life.damage import Life as Life
    from impact.life.damage import life as life
    from impact.life.damage import margin as margin
    from impact.life.maps import PointMap as PointMap
    from impact.life.maps import cycle_map as cycle_map
    from impact.life.maps import margin_map as margin_map
    from impact.life.mean_stress import Gerber as Gerber
    from impact.life.mean_stress import Goodman as Goodman
    from impact.life.mean_stress import MeanStress as MeanStress
    from impact.life.mean_stress import Morrow as Morrow
    from impact.life.mean_stress import SmithWatsonTopper as SmithWatsonTopper
    from impact.life.mean_stress import Walker as Walker
    from impact.life.multiaxial import Crossland as Crossland
    from impact.life.multiaxial import DangVan as DangVan
    from impact.life.multiaxial import Multiaxial as Multiaxial
    from impact.life.multiaxial import Papadopoulos as Papadopoulos
    from impact.life.places import Demand as Demand
    from impact.life.places import Judged as Judged
    from impact.life.places import judged as judged
    from impact.life.pressed import hertz_path as hertz_path
    from impact.life.strength import SpeedMargin as SpeedMargin
    from impact.life.strength import Strength as Strength
    from impact.life.strength import criterion as criterion
    from impact.life.strength import speed_margin as speed_margin

__all__ = [
    "Crossland",
    "Curve",
    "Cycles",
    "DangVan",
    "Demand",
    "Gerber",
    "Goodman",
    "Judged",
    "Life",
    "LifeError",
    "MeanStress",
    "Morrow",
    "Multiaxial",
    "Papadopoulos",
    "PointMap",
    "SmithWatsonTopper",
    "SpeedMargin",
    "Strength",
    "Walker",
    "basquin",
    "criterion",
    "cycle_map",
    "from_peak",
    "hertz_path",
    "judged",
    "life",
    "margin",
    "margin_map",
    "rainflow",
    "reversals",
    "speed_margin",
    "tabled",
]

__getattr__ = lazy_names(
    __name__,
    {
        "impact.life.curves": "Curve LifeError basquin tabled",
        "impact.life.cycles": "Cycles from_peak rainflow reversals",
        "impact.life.damage": "Life life margin",
        "impact.life.maps": "PointMap cycle_map margin_map",
        "impact.life.mean_stress": "Gerber Goodman MeanStress Morrow SmithWatsonTopper Walker",
        "impact.life.multiaxial": "Crossland DangVan Multiaxial Papadopoulos",
        "impact.life.places": "Demand Judged judged",
        "impact.life.pressed": "hertz_path",
        "impact.life.strength": "SpeedMargin Strength criterion speed_margin",
    },
)
