# ruff: noqa: I001 (one import a module)
from impact.bodies import (
    body as body,
    loads as loads,
    reeds as reeds,
    time_series as time_series,
)
