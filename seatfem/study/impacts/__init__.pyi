# ruff: noqa: I001 (one import a module)
from seatfem.study.impacts import (
    contact as contact,
    drives as drives,
    gas as gas,
    landings as landings,
    layout as layout,
    life as life,
    plate_stress as plate_stress,
    touches as touches,
    validity as validity,
)
