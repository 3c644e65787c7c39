# ruff: noqa: I001 (one import a module)
from seatfem.study.identify import (
    figure as figure,
    fit as fit,
    intervals as intervals,
    record as record,
    shots as shots,
)
