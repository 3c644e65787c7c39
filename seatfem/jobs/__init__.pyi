# ruff: noqa: I001 (one import a module)
from seatfem.jobs import (
    cluster as cluster,
    crew as crew,
    folders as folders,
    foreman as foreman,
    processes as processes,
)
