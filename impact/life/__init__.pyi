# ruff: noqa: I001 (one import a module)
from impact.life.curves import Curve as Curve, LifeError as LifeError, basquin as basquin, tabled as tabled
from impact.life.cycles import Cycles as Cycles, from_peak as from_peak, rainflow as rainflow, reversals as reversals
from impact.life.damage import Life as Life, life as life, margin as margin
from impact.life.maps import PointMap as PointMap, cycle_map as cycle_map, margin_map as margin_map
from impact.life.mean_stress import (
    Gerber as Gerber,
    Goodman as Goodman,
    MeanStress as MeanStress,
    Morrow as Morrow,
    SmithWatsonTopper as SmithWatsonTopper,
    Walker as Walker,
)
from impact.life.multiaxial import (
    Crossland as Crossland,
    DangVan as DangVan,
    Multiaxial as Multiaxial,
    Papadopoulos as Papadopoulos,
)
from impact.life.places import Demand as Demand, Judged as Judged, judged as judged
from impact.life.pressed import hertz_path as hertz_path
from impact.life.strength import (
    SpeedMargin as SpeedMargin,
    Strength as Strength,
    criterion as criterion,
    speed_margin as speed_margin,
)
