# ruff: noqa: I001 (one import a module)
from impact.after import (
    histories as histories,
    landings as landings,
    loads as loads,
    measures as measures,
    regime as regime,
    result as result,
    rods as rods,
    stresses as stresses,
)
