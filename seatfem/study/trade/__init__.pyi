# ruff: noqa: I001 (one import a module)
from seatfem.study.trade import report as report, rungs as rungs, trade as trade
