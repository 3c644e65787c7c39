# ruff: noqa: I001 (one import a module)
from seatfem.study.sweep import (
    best as best,
    cases as cases,
    charts as charts,
    effects as effects,
    runner as runner,
    side_by_side as side_by_side,
    study as study,
    sweep as sweep,
    table as table,
    variations as variations,
)
