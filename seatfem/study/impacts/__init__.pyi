# ruff: noqa: I001 (one import a module)
from seatfem.study.impacts import (
    bodies as bodies,
    contact as contact,
    gas as gas,
    landings as landings,
    layout as layout,
    life as life,
    plate_stress as plate_stress,
    touches as touches,
    validity as validity,
)
