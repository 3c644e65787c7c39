# ruff: noqa: I001 (one import a module)
from seatfem.jobs import (
    cluster as cluster,
    desk as desk,
    folders as folders,
    processes as processes,
    program as program,
    remote as remote,
    worker as worker,
)
