# ruff: noqa: I001 (one import a module)
from seatfem.study.identify import (
    fit as fit,
    intervals as intervals,
    record as record,
    shots as shots,
)
