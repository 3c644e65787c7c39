# ruff: noqa: I001 (one import a module)
from seatfem.structures.reduction import (
    eigen_search as eigen_search,
    factorization as factorization,
    greens as greens,
    krylov as krylov,
    lip_modes as lip_modes,
    modal as modal,
    modes as modes,
    reducer as reducer,
    harmonics as harmonics,
    second_order as second_order,
    spectrum as spectrum,
    transient as transient,
)
