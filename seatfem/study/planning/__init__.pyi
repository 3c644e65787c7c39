# ruff: noqa: I001 (one import a module)
from seatfem.study.planning import (
    costs as costs,
    deciding as deciding,
    plan as plan,
    planner as planner,
    reasons as reasons,
)
