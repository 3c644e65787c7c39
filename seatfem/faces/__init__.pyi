# ruff: noqa: I001 (one import a module)
from seatfem.faces import (
    cli as cli,
    exchange as exchange,
    other_verbs as other_verbs,
    plan_view as plan_view,
    progress_bars as progress_bars,
    report as report,
    scene_verbs as scene_verbs,
    tables as tables,
    terminal as terminal,
    verdict as verdict,
)
