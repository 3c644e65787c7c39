# ruff: noqa: I001 (one import a module)
from impact.life.strength import (
    Curve as Curve,
    LifeError as LifeError,
    SpeedMargin as SpeedMargin,
    Strength as Strength,
    basquin as basquin,
    criterion as criterion,
    speed_margin as speed_margin,
    tabled as tabled,
)
from impact.life.damage import (
    Cycles as Cycles,
    Gerber as Gerber,
    Goodman as Goodman,
    Life as Life,
    MeanStress as MeanStress,
    Morrow as Morrow,
    SmithWatsonTopper as SmithWatsonTopper,
    Walker as Walker,
    from_peak as from_peak,
    life as life,
    margin as margin,
    rainflow as rainflow,
    reversals as reversals,
)
from impact.life.places import (
    Demand as Demand,
    Judged as Judged,
    judged as judged,
)
from impact.life.multiaxial import (
    Crossland as Crossland,
    DangVan as DangVan,
    Multiaxial as Multiaxial,
    Papadopoulos as Papadopoulos,
    hertz_path as hertz_path,
)
from impact.life import (
    damage as damage,
    places as places,
    multiaxial as multiaxial,
    strength as strength,
)
