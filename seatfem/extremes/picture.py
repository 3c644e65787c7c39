"""The map: axes by rows, their decades by columns, coloured by verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from impact.atomic import whole_file
from seatfem.extremes.cell import Cell, Outcome
from seatfem.extremes.table import VERDICTS

COLOURS = {"right": "#3b7dbf", "warned": "#e3b23c", "refused": "#b9bec4", "wrong": "#c0392b"}
MEANING = {
    "right": "right within the stated error",
    "warned": "answered, with the advice that says what is wrong",
    "refused": "refused, with the reason",
    "wrong": "wrong",
}


def draw_map(cells: Sequence[Cell], outcomes: Mapping[str, Outcome], path: Path) -> None:
    """One row per axis, one square per cell with its value; the covering array below, in rows of the same width."""
    import matplotlib  # pictures are optional

    matplotlib.use("Agg", force=False)
    from matplotlib import pyplot as plt
    from matplotlib.patches import Patch, Rectangle

    rows = _rows([cell for cell in cells if cell.name in outcomes])
    width = max(len(row) for _, row in rows)
    figure, axes = plt.subplots(figsize=(0.52 * width + 4.2, 0.27 * len(rows) + 1.0))
    for y, (_, row) in enumerate(rows):
        for x, cell in enumerate(row):
            verdict = outcomes[cell.name].verdict
            axes.add_patch(Rectangle((x + 0.03, y + 0.06), 0.94, 0.88, color=COLOURS[verdict], linewidth=0))
            dark = verdict in ("right", "wrong")
            axes.text(
                x + 0.5, y + 0.52, _label(cell), ha="center", va="center", fontsize=5.5,
                color="white" if dark else "black",
            )  # fmt: skip
    axes.set(xlim=(0, width), ylim=(len(rows), 0), xticks=[], yticks=[y + 0.5 for y in range(len(rows))])
    axes.set_yticklabels([name for name, _ in rows], fontsize=7)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    count = {v: sum(o.verdict == v for o in outcomes.values()) for v in VERDICTS}
    handles = [Patch(color=COLOURS[v], label=f"{MEANING[v]} ({count[v]})") for v in VERDICTS]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), ncols=2, frameon=False, fontsize=7)
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=160, bbox_inches="tight")
    plt.close(figure)


def _rows(cells: Sequence[Cell]) -> list[tuple[str, list[Cell]]]:
    by_axis: dict[str, list[Cell]] = {}
    for cell in cells:
        by_axis.setdefault(cell.axis, []).append(cell)
    width = max((len(v) for k, v in by_axis.items() if k != "pairwise"), default=20)
    rows = []
    for axis, row in by_axis.items():
        parts = [row[i : i + width] for i in range(0, len(row), width)]
        rows += [(axis if i == 0 else "", part) for i, part in enumerate(parts)]
    return rows


def _label(cell: Cell) -> str:
    value = cell.value.partition(":")[0]
    return value.replace("e-0", "e-").replace("e+0", "e") if len(value) <= 9 else value[:8] + "."
