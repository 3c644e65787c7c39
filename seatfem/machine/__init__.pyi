# ruff: noqa: I001 (one import a module)
from seatfem.machine import (
    code as code,
    compiling as compiling,
    doctor as doctor,
    libraries as libraries,
    resources as resources,
)
