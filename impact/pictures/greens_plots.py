"""Figure of a Green's function: impulse and step response, receptance."""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens
from impact.greens.poles import receptance
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, sheet, zero_line
from impact.quantities import percent, scaled, text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PER_PULSE = 48  # samples per pulse, with which the sampled convolution is exact to about 1e-4
EXCITED = 1e-3  # least compliance of a pole that counts as a mode, over the port's total compliance
_UNSEEN = 1e-9  # shape at a port below which it is round-off, over the largest
_WINDOW = math.log(100.0)  # exponent of the window of a sampled receptance at its end: 1 %
_LEGEND = 0.45  # space above the curves for the legend, over their height


def plot_greens(
    greens: GreensFunction,
    path: str | os.PathLike[str] | None = None,
    *,
    duration: float,
    width: float,
    title: str = "Driving-point Green's function",
    reference: GreensFunction | None = None,
    port: str | int = 0,
) -> Figure:
    """Draw g(t) just after the impulse and over ``duration`` [s], the step response and the receptance.

    The thick line is g after a Hann pulse of total ``width`` [s] (see `GreensFunction.filtered`). ``reference``:
    another Green's function of the same body, dashed. The receptance of a modal function is in closed form; otherwise
    it is the transform under an exponential window over ``duration``. Returns the figure, written to a ``path`` if one
    is given. Raises `PictureError` without matplotlib, `GreensFunctionError` for no such port, `ValueError` unless 0 <
    ``width`` <= ``duration``.
    """
    if not 0 < width <= duration < math.inf:
        raise ValueError(f"width = {width:g} s and duration = {duration:g} s must be finite with 0 < width <= duration")
    bodies = [greens] if reference is None else [greens, reference]
    shown = [_at_port(body, body.port_index(port)) for body in bodies]
    early = min(15 * width, duration)
    with sheet(path, 7.2, 5.6) as figure:
        figure.suptitle(title)
        axes = figure.subplots(2, 2)
        _impulse(axes[0, 0], shown, early, width)
        _impulse(axes[0, 1], shown, duration, width)
        axes[0, 0].set_title("Impulse response, first moments")
        axes[0, 1].set_title("Impulse response")
        low, high = axes[0, 0].get_ylim()
        axes[0, 0].set_ylim(low, high + _LEGEND * (high - low))
        axes[0, 0].legend(loc="upper right")
        _step(axes[1, 0], shown, duration)
        _receptance(axes[1, 1], shown, duration, width)
        figure.supxlabel(error_text(greens.error_estimate, width), fontsize=8, color=GREY)
    return figure


def _at_port(greens: GreensFunction, port: int) -> tuple[GreensFunction, int]:
    """Return modes at one port, without those of no amplitude there: most of those of a complete ring."""
    if (modal := greens.modal) is None:
        return greens, port
    alone = modal.combined(np.eye(len(modal.ports))[:, [port]], (modal.ports[port],))
    size = np.abs(alone.shapes[:, 0])
    visible = size > _UNSEEN * size.max(initial=0.0)
    return alone.of_modes(visible), 0


def error_text(error: ErrorEstimate, width: float) -> str:
    """Return the error estimate in one line."""
    if error.total is None:
        return f"error of g after a {1e6 * width:g} µs pulse: not known"
    if error.total == 0.0:
        return "closed form: no error of reduction or mesh"
    parts = [
        f"{name} {'not known' if value is None else percent(value)}"
        for name, value in (("reduction", error.reduction), ("mesh", error.mesh))
    ]
    return f"estimated error of g after a {1e6 * width:g} µs pulse, relative to its largest value: {', '.join(parts)}"


def sampled_filter(greens: GreensFunction, times: int, width: float, i: int = 0) -> tuple[Array, Array]:
    """Return (t, g after a unit Hann pulse), t = 0 ... ``times`` * width/48, by one convolution of the sampled step
    response.

    As `GreensFunction.filtered`, much cheaper on a uniform grid: integral of p'(s) S(t - s) ds by the trapezoidal rule,
    which is of second order across the start of S, because p' is a full period of a sine.
    """
    h = width / _PER_PULSE
    t = np.asarray(h * np.arange(times + 1), dtype=np.float64)
    step = greens.step_response(t, i, i)
    step[0] *= 0.5  # mean across the jump of a bare compliance
    phase = 2 * np.pi * np.arange(_PER_PULSE) / _PER_PULSE
    slope = 2 * np.pi / width**2 * np.sin(phase)
    return t, np.asarray(h * np.convolve(step, slope)[: len(t)])


def _impulse(axes: Axes, shown: list[tuple[GreensFunction, int]], duration: float, width: float) -> None:
    rate, time_unit = scaled(duration, "s")
    main = [sampled_filter(g, math.ceil(duration / width * _PER_PULSE), width, i) for g, i in shown]
    greens, port = shown[0]
    start = float(greens.initial_value()[port, port])
    largest = max(float(np.abs(curve).max()) for _, curve in main)
    if math.isfinite(start):
        largest = max(largest, abs(start))
    factor, unit = scaled(largest, "m/(N s)")
    t = np.linspace(0.0, duration, 3001)[1:]
    raw = factor * greens.impulse_response(t, port, port)
    axes.plot(rate * t, raw, color=BLUE, linewidth=0.5, alpha=0.55, label="g(t)")
    styles: tuple[tuple[str, str, str], ...] = ((BLUE, "-", ""), (ORANGE, "--", ", reference"))
    for (time, curve), (colour, style, note) in zip(main, styles, strict=False):
        label = f"after a {1e6 * width:g} µs pulse{note}"
        axes.plot(rate * time, factor * curve, color=colour, linestyle=style, label=label)
    if math.isfinite(start) and start > 0:
        label = f"g(0+) = {text(start, 'm/(N s)')}"
        axes.plot(0.0, factor * start, "o", color=GREEN, markersize=5, clip_on=False, zorder=4, label=label)
    zero_line(axes)
    margin = 0.02 * duration
    axes.set(xlim=(-rate * margin, rate * duration), ylim=(-1.25 * factor * largest, 1.35 * factor * largest))
    low = min(float(curve.min()) for _, curve in main)
    if low > -0.3 * largest:
        axes.set_ylim(bottom=1.3 * factor * min(low, -0.08 * largest))
    axes.set(xlabel=f"time [{time_unit}]", ylabel=f"g [{unit}]")


def _step(axes: Axes, shown: list[tuple[GreensFunction, int]], duration: float) -> None:
    t = np.linspace(0.0, duration, 3001)
    curves = [g.step_response(t, i, i) for g, i in shown]
    greens, port = shown[0]
    static = float(greens.static_compliance()[port, port])
    rate, time_unit = scaled(duration, "s")
    factor, unit = scaled(curves[0], "m/N")
    axes.plot(rate * t, factor * curves[0], color=BLUE)
    if len(curves) > 1:
        axes.plot(rate * t, factor * curves[1], color=ORANGE, linestyle="--")
    if math.isfinite(static):
        axes.axhline(factor * static, color=GREEN, linewidth=1.0, linestyle=(0, (5, 2)))
        note = f"static {text(static, 'm/N')} = 1/({text(1 / static, 'N/m')})"
        axes.set_title(note, loc="right", color=GREEN, fontsize=8)
    zero_line(axes)
    axes.set(xlim=(0.0, rate * duration), xlabel=f"time [{time_unit}]", ylabel=f"displacement per force [{unit}]")
    axes.set_title("Step response")


def _receptance(axes: Axes, shown: list[tuple[GreensFunction, int]], duration: float, width: float) -> None:
    greens, port = shown[0]
    high = 3 / width
    modal_forms = [_modal(g, duration, high) for g, _ in shown]
    modes = np.zeros(0) if modal_forms[0] is None else modal_forms[0].frequencies_hz[modal_forms[0].frequencies_hz > 0]
    low = min(1 / duration, 0.3 * float(modes.min())) if modes.size else 1 / duration
    curves = []
    for (g, i), modal in zip(shown, modal_forms, strict=True):
        if modal is None:
            curves.append(_windowed(g, i, low, high, duration))
            continue
        peaks = modal.frequencies_hz[(modal.frequencies_hz > low) & (modal.frequencies_hz < high)]
        f = np.unique(np.concatenate([np.geomspace(low, high, 1200), peaks]))  # includes every peak
        with np.errstate(divide="ignore", invalid="ignore"):
            h = np.abs(receptance(modal, f, i, i))
        curves.append((f[np.isfinite(h)], h[np.isfinite(h)]))
    factor, unit = scaled(curves[0][1], "m/N")
    rate, frequency_unit = scaled(math.sqrt(low * high), "Hz")
    top = max(float(h.max()) for _, h in curves)
    bottom = max(min(float(h.min()) for _, h in curves), 1e-9 * top)
    axes.set(xscale="log", yscale="log")
    axes.set(xlim=(rate * low, rate * high), ylim=(factor * bottom / 2, 2 * factor * top))
    for (f, h), colour, style in zip(curves, (BLUE, ORANGE), ("-", "--"), strict=False):
        axes.plot(rate * f, factor * h, color=colour, linestyle=style, linewidth=1.1)
    static = float(greens.static_compliance()[port, port])
    if math.isfinite(static):
        axes.axhline(factor * static, color=GREEN, linewidth=1.0, linestyle=(0, (5, 2)))
    used = modes[(modes >= low) & (modes <= high)]
    axes.vlines(
        rate * used, 0.0, 0.04, transform=axes.get_xaxis_transform(), color=GREY, linewidth=0.6, zorder=3, label="poles"
    )
    axes.axvline(rate / width, color=GREY, linewidth=0.8, linestyle=":")
    axes.text(rate / width, 0.98, " 1/width", transform=axes.get_xaxis_transform(), va="top", color=GREY, fontsize=7)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.set(xlabel=f"frequency [{frequency_unit}]", ylabel=f"|receptance| [{unit}]")
    axes.set_title("Receptance" + (", windowed" if modal_forms[0] is None else ""))
    if modal_forms[0] is not None and used.size:
        first = lowest_excited(modal_forms[0], port)
        lowest = "" if first is None else f", lowest excited {text(first, 'Hz')}"
        axes.set_title(f"{used.size} poles{lowest}", loc="right", color=GREY, fontsize=8)


def lowest_excited(greens: ModalGreens, port: int = 0) -> float | None:
    """Return the frequency [Hz] of the lowest oscillator with at least `EXCITED` of the port's compliance, since weaker
    ones may not be modes."""
    elastic = greens.omega > 0
    compliance = (greens.shapes[elastic, port] / greens.omega[elastic]) ** 2
    whole = float(np.sum(compliance)) + float(greens.residual.static()[port, port])
    excited = greens.frequencies_hz[elastic][compliance >= EXCITED * whole]
    return float(excited.min()) if excited.size else None


def _modal(greens: GreensFunction, duration: float, high: float) -> ModalGreens | None:
    """Return the function as modes, if it is modal or has all relevant modes up to ``high`` [Hz]; else ``None``."""
    if greens.modal is not None:
        return greens.modal
    dt = 1 / (8 * high)
    kernel = greens.step_kernel(dt, math.ceil(duration / dt))
    return kernel.modal if kernel.weights is None else None


def _windowed(greens: GreensFunction, port: int, low: float, high: float, duration: float) -> tuple[Array, Array]:
    """Return (frequencies [Hz], |receptance| [m/N]) from the step response under an exponential window."""
    n = math.ceil(8 * high * duration)
    h = duration / n
    t = h * np.arange(n + 1)
    weights = np.diff(greens.step_response(t, port, port), prepend=0.0) * np.exp(-_WINDOW * t / duration)
    f = np.asarray(np.fft.rfftfreq(4 * n, h), dtype=np.float64)
    inside = (f >= low) & (f <= high)
    return f[inside], np.abs(np.fft.rfft(weights, 4 * n))[inside]
