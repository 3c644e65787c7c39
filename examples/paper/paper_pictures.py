"""Figures of the paper's case and of the regime map, in the common style."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from paper_case import CASES, DENSITY, FILTER_WIDTH, LENGTHS, YOUNG, Case, Numbers
from printed_march import REED_LENGTH

import impact
from impact import measures
from impact.after.result import ImpactResult
from impact.after.rods import fixed_rod_modes
from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, sheet, zero_line
from impact.quantities import scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Pair = tuple[ImpactResult, ImpactResult]
_ROWS = ("deflection of the tip [mm]", "force [N]", "first contact: force [N]")
_READINGS = {"strip": "strip, A = 4.17e-9 m²", "area": "area, A = 4.17e-7 m²"}


def plot_greens_function(path: str | os.PathLike[str]) -> None:
    """Figure 3: Z g(l, t) of the fixed rod against c_0 t/l, (7) and its damped form, and the modal expansion (8).

    Raises:
        PictureError: matplotlib is missing.
    """
    damped = CASES[0].rod
    bare = impact.fixed_rod(young=YOUNG, density=DENSITY, area=CASES[0].area, length=CASES[0].length)
    transits = np.linspace(0.0, 16.0, 4001)
    time = damped.transit * transits
    with sheet(path, 7.2, 3.0) as figure:
        axes = figure.subplots()
        for rod, colour, style, label in (
            (bare, GREY, "-", "(7): wavefronts, undamped"),
            (damped, BLUE, "-", "10 % of damping, closed form"),
            (fixed_rod_modes(damped, 20), ORANGE, (0, (2, 2)), "(8): 20 modes, 10 % of damping"),
        ):
            response = damped.impedance * rod.impulse_response(time)
            axes.plot(transits, response, color=colour, linestyle=style, label=label)
        zero_line(axes)
        axes.set(xlim=(0, 16), ylim=(-1.25, 1.9), xlabel="c₀ t / l", ylabel="ρ c₀ A g(l, t)")
        axes.set_title("Figure 3: driving-point Green's function of the rod at x = l")
        axes.legend(loc="upper right", ncols=3, fontsize=7.5)


def plot_procedure(path: str | os.PathLike[str]) -> None:
    """Figure 4: how one step finds the contact force, for any two Green's functions.

    Raises:
        PictureError: matplotlib is missing.
    """
    boxes = (
        (2.0, 3.4, "Green's functions of reed and seat as poles;\ninitial shape $\\eta_n$, load p"),
        (2.0, 2.3, "both bodies move on by the exact recursion of\ntheir poles under the forces of the past"),
        (2.0, 1.2, "gap without a force in this step:\nh$_i$ = y(x*, t$_i$) − u(l, t$_i$)"),
        (6.4, 1.75, "h$_i$ < 0:  N$_i$ = −h$_i$ / (W$_0^{reed}$ + W$_0^{seat}$)"),
        (6.4, 0.9, "h$_i$ ≥ 0:  N$_i$ = 0"),
        (6.4, 3.0, "+N$_i$ on the reed, −N$_i$ on the seat,\nconstant over the step; i → i + 1"),
    )
    arrows = (
        ((2.0, 3.14), (2.0, 2.55)),
        ((2.0, 2.04), (2.0, 1.45)),
        ((3.38, 1.3), (4.95, 1.7)),
        ((3.38, 1.1), (5.75, 0.92)),
        ((6.4, 1.9), (6.4, 2.74)),
        ((4.97, 2.95), (4.05, 2.5)),
    )
    with sheet(path, 7.2, 3.6) as figure:
        axes = figure.subplots()
        for x, y, words in boxes:
            frame = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": BLUE, "linewidth": 1.0}
            axes.text(x, y, words, ha="center", va="center", bbox=frame)
        style: dict[str, Any] = {"arrowstyle": "-|>", "color": GREY, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
        for begin, end in arrows:
            axes.annotate("", end, begin, arrowprops=style)
        axes.plot([7.2, 8.3, 8.3], [0.9, 0.9, 3.0], color=GREY, linewidth=1.1)
        axes.annotate("", (7.85, 3.0), (8.3, 3.0), arrowprops=style)
        axes.set(xlim=(-0.3, 8.6), ylim=(0.6, 3.75))
        axes.axis("off")
        axes.set_title("Figure 4: numerical procedure")


def plot_responses(runs: Mapping[Case, Pair], path: str | os.PathLike[str], *, title: str) -> None:
    """Figures 5 and 6: deflection of the reed's tip, contact force, and the force of the first contact.

    One column for each case; ``runs``: (rod with waves, constant stiffness). Thin: force of each step; thick: mean over
    1 µs.

    Raises:
        PictureError: matplotlib is missing.
    """
    with sheet(path, 7.2, 6.6) as figure:
        figure.suptitle(title)
        panels = figure.subplots(3, len(runs))
        for (deflection, force, first), (case, pair) in zip(panels.T, runs.items(), strict=True):
            deflection.set_title(_READINGS[case.reading])
            groups = [measures.contact_groups(run)[0] for run in pair]
            window = (groups[0][0] - 4e-6, max(group[1] for group in groups) + 8e-6)
            for run, colour, style, label in (
                (pair[1], ORANGE, (0, (4, 2)), "constant K = EA/l"),
                (pair[0], BLUE, "-", "rod with waves"),
            ):
                line = {"color": colour, "linestyle": style, "label": label}
                deflection.plot(1e3 * run.time, 1e3 * run.striker_displacement, **line)
                for axes, seen in ((force, (0.0, run.time[-1])), (first, window)):
                    _force(axes, run, seen, **line)
            zero_line(deflection)
            deflection.set(xlim=(0.0, 1e3 * pair[0].time[-1]), xlabel="time [ms]")
        for axes, words in zip(panels[:, 0], _ROWS, strict=True):
            axes.set_ylabel(words)
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)


def plot_stiffness_sweep(
    stiffness: Array,
    springs: Sequence[Numbers],
    waves: Mapping[Case, Numbers],
    path: str | os.PathLike[str],
) -> None:
    """Peak, filtered peak and impulse on a constant stiffness, beside the answers of the rods with waves (points).

    Raises:
        PictureError: matplotlib is missing.
    """
    colours = dict(zip(CASES, (SKY, BLUE, PURPLE, ORANGE), strict=True))
    with sheet(path, 7.2, 6.4) as figure:
        figure.suptitle("“Completely different by selecting a different K”")
        panels = figure.subplots(3, 1, sharex=True)
        for axes, name, label in zip(
            panels,
            ("peak", "filtered_peak", "impulse"),
            ("peak of a step [N]", "peak, mean over 1 µs [N]", "impulse of 3 ms [mN s]"),
            strict=True,
        ):
            factor = 1e3 if name == "impulse" else 1.0
            values = [factor * getattr(numbers, name) for numbers in springs]
            axes.plot(stiffness, values, color="black", marker=".", markersize=3, label="constant stiffness K")
            for case, numbers in waves.items():
                answer = factor * getattr(numbers, name)
                axes.axhline(answer, color=colours[case], linewidth=0.8, linestyle=(0, (4, 2)))
                note = f"rod with waves, {case.reading}, {1e3 * case.length:g} mm"
                axes.plot(case.stiffness, answer, "o", color=colours[case], label=note, zorder=4)
            axes.set(xscale="log", ylabel=label)
        for axes in panels[:2]:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
        panels[2].set_ylim(bottom=0.0)
        panels[2].set_xlabel("K [N/m]; a rod stands at its EA/l")
        panels[2].legend(loc="lower right", ncols=2, fontsize=7)


def plot_time_steps(
    scheme: Mapping[float, Array],
    converged: Mapping[float, Sequence[float]],
    path: str | os.PathLike[str],
    plain: int,
) -> None:
    """Error of K = EA/l over the time step [s]: the article's scheme, and converged means over as long a time.

    ``scheme``: errors of pairs of numbers of modes and both lengths (16, 2) at each step, of which ``plain`` is the
    10 + 10 modes; ``converged``: of both lengths, at each width.

    Raises:
        PictureError: matplotlib is missing.
    """
    steps, widths = 1e6 * np.array(list(scheme)), 1e6 * np.array(list(converged))
    errors, means = 100 * np.stack(list(scheme.values())), 100 * np.array(list(converged.values()))
    agree = np.sum((errors[..., 0] > 0) & (errors[..., 1] > errors[..., 0]), axis=1)
    ticks = (0.2, 0.5, 1, 2, 5, 10, 20)
    with sheet(path, 7.2, 3.9) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, length, of_pairs, mean in zip(panels, LENGTHS, np.moveaxis(errors, 2, 0), means.T, strict=True):
            zero_line(axes)
            bounds = np.nanmin(of_pairs, axis=1), np.nanmax(of_pairs, axis=1)
            axes.vlines(steps, *bounds, color=ORANGE, linewidth=3.5, alpha=0.3, label="16 pairs, 3 to 20 modes each")
            note = "article's scheme, 10 + 10 modes"
            axes.plot(steps, of_pairs[:, plain], "o", color=ORANGE, markersize=4, label=note)
            axes.plot(widths, mean, color=BLUE, label="converged, mean over as long a time")
            axes.set(xscale="log", xlim=(0.16, 25), ylim=(-105, 75), xlabel="time step, or time of the mean [µs]")
            axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            axes.set_yticks(range(-100, 60, 20))
            axes.minorticks_off()
            axes.set_title(f"rod of {1e3 * length:g} mm (area)")
            for step in steps[agree == of_pairs.shape[1]]:
                axes.plot(step, 62, "v", color=GREEN, markersize=5)
        words = "▼ all pairs: K too high,\n     more so for the longer rod"
        panels[0].text(0.18, 62, words, color=GREEN, va="center", fontsize=7.5)
        panels[0].set_ylabel("peak on K = EA/l over peak on the rod − 1 [%]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7.5)


def plot_pressure(
    pressure: Callable[[Array, Array], Array],
    runs: Mapping[str, tuple[ImpactResult, Array]],
    path: str | os.PathLike[str],
) -> None:
    """The pressure p(x, t) along the reed, the tip's motion without and with it, and the forces on the last rod.

    ``runs``: result and closed motion without contact at its times, by words.

    Raises:
        PictureError: matplotlib is missing.
    """
    time, place = np.linspace(0.0, 1e-3, 400), np.linspace(0.0, REED_LENGTH, 60)
    field = 1e-3 * pressure(place[:, None], time[None, :])
    with sheet(path, 7.2, 5.0) as figure:
        (field_axes, force_axes), (tip_axes, first_axes) = figure.subplots(2, 2)
        largest = float(np.abs(field).max())
        image = field_axes.pcolormesh(1e3 * time, 1e3 * place, field, cmap="RdBu_r", vmin=-largest, vmax=largest)
        figure.colorbar(image, ax=field_axes, label="p [kPa]")
        field_axes.set(xlabel="time [ms]", ylabel="x from the root [mm]")
        field_axes.set_title("pressure, away from the seat positive")
        for (words, (run, closed)), colour in zip(runs.items(), (GREY, BLUE), strict=True):
            early = run.time <= 1e-3
            tip_axes.plot(1e3 * run.time[early], 1e3 * run.striker_displacement[early], color=colour, label=words)
            marks = np.linspace(0, measures.contact_groups(run)[0, 0] / run.dt, 24).astype(int)
            tip_axes.plot(1e3 * run.time[marks], 1e3 * closed[marks], ".", color=colour)
            force, start = measures.filtered_force(run, FILTER_WIDTH), measures.contact_groups(run)[0, 0]
            seen = (run.time > start - 5e-6) & (run.time < start + 60e-6)
            force_axes.plot(1e3 * run.time, force, color=colour)
            first_axes.plot(1e6 * (run.time[seen] - start), force[seen], color=colour)
        tip_axes.plot([], [], ".", color="black", label="sum (2) in closed form")
        zero_line(tip_axes)
        tip_axes.set(xlabel="time [ms]", ylabel="deflection of the tip [mm]")
        tip_axes.legend(loc="upper right")
        force_axes.set(xlabel="time [ms]", ylabel="force, mean over 1 µs [N]", ylim=(0, None), xlim=(0, 3))
        force_axes.set_title("rod of 30 mm (area)")
        first_axes.set_title("the same, first touch")
        first_axes.set(xlabel="time since the first touch [µs]", ylabel="force, mean over 1 µs [N]", ylim=(0, None))


def _force(axes: Axes, run: ImpactResult, window: tuple[float, float], **line: Any) -> None:
    seen = (run.time >= window[0]) & (run.time <= window[1])
    rate, unit = scaled(window[1], "s")
    axes.plot(rate * run.time[seen], run.force[seen], color=line["color"], linewidth=0.5, alpha=0.45)
    axes.plot(rate * run.time[seen], measures.filtered_force(run, FILTER_WIDTH)[seen], **line)
    top = max(1.05 * float(run.force[seen].max()), axes.get_ylim()[1])
    axes.set(xlim=(rate * window[0], rate * window[1]), ylim=(0.0, top), xlabel=f"time [{unit}]")
