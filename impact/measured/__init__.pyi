# ruff: noqa: I001 (one import a module)
from impact.measured import (
    amplitudes as amplitudes,
    frf as frf,
    passivity as passivity,
    pole_fit as pole_fit,
    vector_fitting as vector_fitting,
)
