"""The paper's case: figures 3, 5 and 6 and a table, for both readings of Table 1 and both rod lengths.

    python examples/paper_table1.py [FOLDER]

Figure 3: force on the constant stiffness K = EA/l. Figure 5: force on the rod with its waves. Figure 6: both during the
first contact, with the motions. The table says by how much the constant stiffness over- or under-estimates.
"""

import sys
from pathlib import Path

from impact import measures
from impact.paper import CASES, comparison, markdown, strike, strike_spring
from impact.paper_plots import plot_comparison, plot_contact_forces
from impact.table import write_rows


def main(folder: Path) -> None:
    wave = {case: strike(case.rod) for case in CASES}
    spring = {case: strike_spring(case.stiffness) for case in CASES}
    plot_contact_forces(
        spring, folder / "paper_figure_3.png", title="Figure 3: contact force, constant stiffness K = EA/l"
    )
    plot_contact_forces(
        wave, folder / "paper_figure_5.png", title="Figure 5: contact force, elastic rod with its waves"
    )
    plot_comparison(
        wave, spring, folder / "paper_figure_6.png", title="Figure 6: first contact, waves against constant K"
    )
    rows = [comparison(case, wave[case], spring[case]) for case in CASES]
    write_rows(folder / "paper_table1.csv", rows)
    (folder / "paper_table1.md").write_text(markdown(rows), encoding="utf-8")
    print(markdown(rows))

    impulses = (0.8876e-3, 1.0268e-3, 0.8093e-3, 0.8095e-3)  # converged in the step to the digits given
    for case, known in zip(CASES, impulses, strict=True):
        assert abs(measures.impulse(wave[case]) - known) < 5e-3 * known, (case, measures.impulse(wave[case]))
        # closed form of the free reed: its tip passes zero at 653.3246 µs at 2.13317 m/s
        first = measures.contact_groups(wave[case])[0, 0]
        assert abs(first - 653.3246e-6) <= wave[case].dt, first
        assert abs(measures.impact_velocity(wave[case]) - 2.13317) < 0.02 * 2.13317


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
