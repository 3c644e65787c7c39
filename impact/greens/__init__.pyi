# ruff: noqa: I001 (one import a module)
from impact.greens import (
    base as base,
    modal as modal,
    oscillator as oscillator,
    poles as poles,
    sampled as sampled,
)
