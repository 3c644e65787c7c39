"""Figures 3 to 6 of the article, for two readings of Table 1 and both rod lengths; the table of its case, for three.

    python examples/paper/figures.py [FOLDER]

Figure 3: the driving-point Green's function of the rod. Figure 4: the procedure. Figures 5 and 6: deflection of the
reed and contact force for l = 3 mm and 30 mm, on the rod with its waves and on the constant stiffness K = EA/l.
"""

import sys
from pathlib import Path

from paper_case import CASES, LENGTHS, SHEETS, comparison, markdown, strike, strike_spring
from paper_pictures import plot_greens_function, plot_procedure, plot_responses

from impact import measures
from impact.files.csv_table import write_csv


def main(folder: Path) -> None:
    wave = {case: strike(case.rod) for case in (*CASES, *SHEETS)}
    spring = {case: strike_spring(case.stiffness) for case in wave}
    plot_greens_function(folder / "paper_figure_3.png")
    plot_procedure(folder / "paper_figure_4.png")
    for number, length in zip((5, 6), LENGTHS, strict=True):
        plot_responses(
            {case: (wave[case], spring[case]) for case in CASES if case.length == length},
            folder / f"paper_figure_{number}.png",
            title=f"Figure {number}: rod length is {1e3 * length:g} mm",
        )
    rows = [comparison(case, wave[case], spring[case]) for case in wave]
    write_csv(folder / "paper_table1.csv", rows[0], (row.values() for row in rows), digits=7)
    (folder / "paper_table1.md").write_text(markdown(rows), encoding="utf-8")
    print(markdown(rows))

    impulses = (0.8876e-3, 1.0268e-3, 0.8093e-3, 0.8095e-3, 0.8054e-3, 0.8055e-3)  # converged in the step
    for case, known in zip(wave, impulses, strict=True):
        assert abs(measures.impulse(wave[case]) - known) < 5e-3 * known, (case, measures.impulse(wave[case]))
        # closed form of the free reed: its tip passes zero at 653.3246 µs at 2.13317 m/s
        first = measures.contact_groups(wave[case])[0, 0]
        assert abs(first - 653.3246e-6) <= wave[case].dt, first
        assert abs(measures.impact_velocity(wave[case]) - 2.13317) < 0.02 * 2.13317


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
