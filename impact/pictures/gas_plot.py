"""Figure by matplotlib of the gas of a reed valve."""

from __future__ import annotations

import math
import os

import numpy as np

from impact.gas import BACK, FORWARD, OTHER, Compressor, GasHistory, Prescribed
from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, sheet, zero_line


def plot_gas(
    drive: Compressor | Prescribed,
    history: GasHistory,
    angle: Array,
    volume: Array,
    path: str | os.PathLike[str],
    *,
    stop: float = math.nan,
    title: str = "Reed valve in its compressor",
) -> None:
    """Plot cylinder pressure, mean lift and mass flow against the crank angle; p over V if the volume is known.

    ``angle`` (n + 1,) [deg] and ``volume`` (n + 1,) [m^3], empty if it is not known, of the cylinder at the times of
    the gas's ``history``; ``stop``: lift at which the reed meets the stopper [m], nan without one.

    Raises `PictureError` without matplotlib.
    """
    other = "discharge" if drive.side == "suction" else "suction"
    with sheet(path, 7.2, 8.4 if len(volume) else 6.0) as figure:
        figure.suptitle(title)
        rows = [1.0, 1.0, 1.0] + ([1.3] if len(volume) else [])
        grid = figure.add_gridspec(len(rows), 1, height_ratios=rows)
        pressure, lift, flow = (figure.add_subplot(grid[k, 0]) for k in range(3))
        pressure.plot(angle, 1e-5 * history.pressure, color=BLUE, label="cylinder")
        for name, plenum, style in (("suction", drive.suction, "--"), ("discharge", drive.discharge, ":")):
            pressure.axhline(1e-5 * plenum.pressure, color=GREY, linestyle=style, linewidth=1.0, label=f"{name} plenum")
        pressure.set(title="Pressure in the cylinder", ylabel="p [bar]")
        lift.plot(angle, 1e3 * history.lift, color=GREEN, label=f"reed ({drive.side} valve)")
        if not math.isnan(stop):
            lift.axhline(1e3 * stop, color=GREY, linestyle="--", linewidth=1.0, label="stopper")
        lift.set(title="Mean lift of the reed", ylabel="lift [mm]")
        flow.plot(angle, 1e3 * history.flow(FORWARD, BACK), color=ORANGE, label=f"reed ({drive.side} valve)")
        if np.any(history.states[:, OTHER]):
            flow.plot(angle, 1e3 * history.flow(OTHER), color=BLUE, linestyle="--", label=f"ideal {other} valve")
        flow.set(title="Mass flow, forward positive", ylabel="flow [g/s]", xlabel="crank angle [deg]")
        for axes in (pressure, lift, flow):
            first, last = float(angle[0]), float(angle[-1])
            axes.set_xlim(first, last)
            step = next(
                (s for s in (15, 30, 45, 90, 180) if (last - first) / s <= 10), 360 * np.ceil((last - first) / 3600)
            )
            axes.set_xticks(np.arange(np.ceil(first / step) * step, last + 1e-6 * step, step))
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
        for axes in (lift, flow):
            zero_line(axes)
        if len(volume):
            diagram = figure.add_subplot(grid[3, 0])
            diagram.plot(1e6 * volume, 1e-5 * history.pressure, color=BLUE)
            for plenum, style in ((drive.suction, "--"), (drive.discharge, ":")):
                diagram.axhline(1e-5 * plenum.pressure, color=GREY, linestyle=style, linewidth=1.0)
            diagram.set(title="Indicator diagram", xlabel="V [cm³]", ylabel="p [bar]")
