# ruff: noqa: I001 (one import a module)
from seatfem.study import (
    identify as identify,
    impacts as impacts,
    ladders as ladders,
    method as method,
    runs as runs,
    safety as safety,
    scene as scene,
    sweep as sweep,
    trade as trade,
)
