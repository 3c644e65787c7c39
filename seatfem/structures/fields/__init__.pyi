# ruff: noqa: I001 (one import a module)
from seatfem.structures.fields.peaks import (
    LargestStress as LargestStress,
    largest as largest,
    principal as principal,
    von_mises as von_mises,
)
from seatfem.structures.fields.recovery import (
    StressField as StressField,
    at_time as at_time,
    histories as histories,
    recover as recover,
)
from seatfem.structures.fields.sites import (
    Sites as Sites,
    at_points as at_points,
    on_surface as on_surface,
    plate_nodes as plate_nodes,
    plate_points as plate_points,
    plate_stress as plate_stress,
)
from seatfem.structures.fields.solids import elements_of as elements_of, solid_stress as solid_stress
