# ruff: noqa: I001 (one import a module)
from seatfem.jobs import (
    desk as desk,
    folders as folders,
    processes as processes,
    cluster as cluster,
    worker as worker,
)
