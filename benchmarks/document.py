"""Write docs/performance.md from the tables in results/."""

from __future__ import annotations

import json
from pathlib import Path

from table import RESULTS, Table

TABLES = (
    "profiles",
    "study_scenes",
    *(
        "poles",
        "fft",
        "engines",
        "rod_kernels",
        "batch",
        "batch_large",
        "many_ports",
        "rings",
        "lips",
        "lip_within_arcs",
        "lip_speed",
        "imports",
    ),
    *("plan_time", "budget_cost", "cost_model", "life", "life_of_seat"),
    *("assembly", "factorization", "modes", "small_seats", "cost_vs_dof", "demo_greens"),
)
PICTURES = {
    "cost_vs_dof": "![Time and memory against unknowns](images/cost_vs_dof.png)\n",
    "profiles": "![Shares of the processor time by room](images/profiles.png)\n",
}
DOCUMENT = Path(__file__).parents[1] / "docs" / "performance.md"
HEAD = """# Performance

Written by `python benchmarks/document.py` from the tables that the scripts beside it leave in `benchmarks/results/`:
first the contact march, then finite elements. Rerun them on your machine: ratios carry over, times do not.

Measured, where a section does not say otherwise, on {machine}. Other programs were running: read times as
upper bounds.

`make history` measures the main parts against a kernel of NumPy beside them, commit by commit:

![Main parts over a kernel of NumPy, by commit](images/history.png)
"""


def main() -> None:
    """One section per table."""
    loaded = [json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8")) for name in TABLES]
    usual = loaded[1]["machine"]
    parts = [HEAD.format(machine="; ".join(f"{key} {value}" for key, value in usual.items()))]
    for name, fields in zip(TABLES, loaded, strict=True):
        processor = fields.pop("machine")["processor"]
        parts.append(Table(**fields).markdown())
        parts += [f"Measured on {processor}, by an earlier program.\n"] if processor != usual["processor"] else []
        parts += [PICTURES[name]] if name in PICTURES else []
    DOCUMENT.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
