"""Stress in bodies of finite elements: at points and on surfaces, from the contact forces of a run."""

from typing import TYPE_CHECKING

from impact.names import lazy_names

if TYPE_CHECKING:
    from seatfem.structures.fields.peaks import LargestStress as LargestStress
    from seatfem.structures.fields.peaks import largest as largest
    from seatfem.structures.fields.peaks import principal as principal
    from seatfem.structures.fields.peaks import von_mises as von_mises
    from seatfem.structures.fields.recovery import StressField as StressField
    from seatfem.structures.fields.recovery import at_time as at_time
    from seatfem.structures.fields.recovery import histories as histories
    from seatfem.structures.fields.recovery import recover as recover
    from seatfem.structures.fields.sites import Sites as Sites
    from seatfem.structures.fields.sites import at_points as at_points
    from seatfem.structures.fields.sites import on_surface as on_surface
    from seatfem.structures.fields.sites import plate_nodes as plate_nodes
    from seatfem.structures.fields.sites import plate_points as plate_points
    from seatfem.structures.fields.sites import plate_stress as plate_stress
    from seatfem.structures.fields.solids import elements_of as elements_of
    from seatfem.structures.fields.solids import solid_stress as solid_stress

_PLACES = {
    "seatfem.structures.fields.peaks": "LargestStress largest principal von_mises",
    "seatfem.structures.fields.recovery": "StressField at_time histories recover",
    "seatfem.structures.fields.sites": "Sites at_points on_surface plate_nodes plate_points plate_stress",
    "seatfem.structures.fields.solids": "elements_of solid_stress",
}
__all__ = sorted(" ".join(_PLACES.values()).split())
__getattr__ = lazy_names(__name__, _PLACES)
