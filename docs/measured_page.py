"""Writes docs/measured.md and the line of README.md: published measurements, our results, and why both differ.

    .venv/bin/python docs/measured_page.py

Runs the comparison of `seatfem verify --measured`; texts and numbers are those of tests/measured.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import ascii_lowercase
from typing import Final

import numpy as np
from markers import between

from impact.files.safe_files import write_whole
from seatfem.verify import ComparedSet, Comparison, measured_table, with_uncertainty

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))
from tests.known_answers.round_bars import bar_frequency  # noqa: E402
from tests.measured import striker_shot  # noqa: E402

ROOTS: Final = "../tests/known_answers/round_bars.py"
HEAD: Final = """\
# Measured

Published measurements, beside the predictions of this program. `seatfem verify --measured` prints the tables;
`docs/measured_page.py` writes this page from them. The sets are in `tests/measured`: one file of numbers, typed in
from their sources, and one that predicts them by the public functions. Files of others are not shipped.

Measured numbers and their uncertainties are the source's, unless the row says otherwise. The uncertainty of a
prediction includes the mesh error, the uncertainty of fitted numbers, and the tolerances of the source's data. Two
numbers overlap if their difference is at most the sum of both uncertainties. A set with as many fitted as predicted
numbers does not count. Where numbers disagree, the set says why; the verb fails if that changes.

"""
UNUSED: Final = """\
## Damping

The modal test of the plates is also the only measured source of a damping ratio here: 0.28 to 1.9 % over thirteen
modes of a bolted aluminium rig, with a median of 0.44 %. The [default](scene/reeds.md) of this program is none. Use
this range if you have no measurement of a metal part.

## Sources that were not used

Only the beginning of these could be read, which gives no number to compare:

- contact times of falling spheres on plates, Appl. Sci. 16 (2026) 89: the abstract says that plate thicknesses follow
  from them within 3 % for an inelasticity parameter below 1.5; its tables could not be read
- a steel sphere on a steel beam, doi 10.1177/1687814016668089: the abstract says that the first of several
  sub-impacts has the duration of Hertz's theory
- R. Cross, Am. J. Phys. 76 (2008) 908 (balls, springs and rods) and 1999 (the bounce of a ball); D. Gugan, Am. J.
  Phys. 68 (2000) 920 (croquet balls); Am. J. Phys. 82, 280 (balls on rods): durations were measured, but none is given
  at the beginning
- reeds: strains of a reed that opens through an oil film (Yoshizumi and others, AJK2011-07019), papers of the Purdue
  conferences on reed frequencies, lifts and strains: only their abstracts

These could be read, but do not suit:

- edge gaps of reed valves, 0.11 to 0.61 um (abstract of "Edge gap as a geometric parameter to characterize the
  sealing performance of compressor valves"): inferred from leakage; here the gap is an input (`contact.gap`)
- a rod of steel of 0.700 m that a hammer touches for 401 us (Pico Technology, Wave speed in a solid): mass and face
  of the hammer are not given. A flat face leaves after 277 us, rounded ones of 20 to 100 mm and 0.2 to 10 kg after
  136 to 378 us, so that any result could be called agreement
- a SuperBall, 8.4 ms from drops of 0.4 to 1.6 m (Azbuki): size and stiffness of the ball could not be read
- Newton's cradle (Lovett and others, 1988): a scene cannot have chains of balls
- random restitution of a steel sphere (arXiv 1104.0049): caused by its roughness, which is not modelled
- the beam of pyEMA and SDyPy, seven frequencies from 176 to 4182 Hz and shapes: a stack of glued layers of unknown
  size
- the plate of permas4edu (example 006): its size is given, its frequencies are in no text
- a bronze disc, four frequencies from 193 to 1320 Hz: its shape is a file of others
- the Brake-Reuss beam (BRBtesting): a bolted joint that slips, which is not linear
- two wires of FeenoX's examples: its author calls the measured values wrong by a factor of two
- a steel plate of a course (experimental-modal-analysis-steel-plate): its records are missing
"""


def page(compared: Sequence[ComparedSet]) -> str:
    """Return the page: counts, a table of the sets, one section each, and the sources that were not used."""
    table = "\n".join(["| set | fitted | predicted | overlap |", "|---|---|---|---|", *map(row_of_set, compared)])
    return HEAD + f"{agreement(compared)}.\n\n{table}\n\n" + "".join(section(each) for each in compared) + UNUSED


def agreement(compared: Sequence[ComparedSet]) -> str:
    """Return how many predicted numbers of the sets that count agree, and how many numbers were fitted."""
    sets = [each for each in compared if each.record.counts]
    rows = [row for each in sets for row in each.rows]
    fits = sum(len(each.record.fitted) for each in sets)
    return (
        f"{sum(row.overlap for row in rows)} of {len(rows)} predicted numbers agree within both uncertainties, "
        f"in {len(sets)} sets with {fits} fitted numbers"
    )


def title_of(compared: ComparedSet) -> str:
    """Return the title of a set's section, "Bar on bar"."""
    return compared.record.name.replace("_", " ").capitalize()


def row_of_set(compared: ComparedSet) -> str:
    """Return a set's row of the first table, with a link to its section."""
    title = title_of(compared)
    overlaps = sum(row.overlap for row in compared.rows)
    link = f"[{title}](#{title.lower().replace(' ', '-')})"
    return f"| {link} | {len(compared.record.fitted)} | {len(compared.rows)} | {overlaps} |"


def dispersion(compared: ComparedSet) -> str:
    """Return the crests of a striker's shot by the axisymmetric model, by the roots of Pochhammer and Chree, and by a
    rod without dispersion; what the phase velocities of both differ by."""
    record = compared.record
    model = striker_shot.speeds(record, 2)
    exact, plain = model.copy(), model.copy()
    numbers = model[1:, 0]
    exact[1:, 1] = [bar_frequency(float(k), float(record.geometry["poisson"])) / k for k in numbers]
    plain[:, 1] = 1.0
    off = np.abs(model[1:, 1] / exact[1:, 1] - 1)
    courses = [striker_shot.crests(record, each) for each in (model, exact, plain)]
    lines = [
        f"The waves of a round bar are known exactly: [roots]({ROOTS}) of the frequency equation of Pochhammer (1876) "
        "and Chree (1889). The phase velocities of the axisymmetric model differ from them by at most "
        f"{off.max():.1e} up to a wave number of {numbers[-1]:.2g} over the radius, where they have fallen to "
        f"{exact[-1, 1]:.3f} of that of a rod.\n",
        "| crest | measured | axisymmetric model | Pochhammer and Chree | rod without dispersion |",
        "|---|---|---|---|---|",
        *(
            f"| {name} | {with_uncertainty(row.published.value, row.published.uncertainty, 'us')} | "
            + " | ".join(f"{course[k]:.2f} us" for course in courses)
            + " |"
            for k, (name, row) in enumerate(zip(striker_shot.CRESTS, compared.rows, strict=True))
        ),
    ]
    return "\n".join(lines) + "\n\n"


def section(compared: ComparedSet) -> str:
    """Return the section of one set."""
    record = compared.record
    fits = [fitted(compared, name) for name in record.fitted]
    reasons = repeated_reasons(compared.rows)
    lines = [
        f"## {title_of(compared)}\n",
        f"{record.about}\n",
        f"{record.finding}\n",
        f"Source: {record.source.title}. {record.source.address}. Licence: {record.source.licence}.",
        f"Read: {record.source.read}.\n" if record.source.read else "",
        *([f"Fitted: {'; '.join(fits)}.\n"] if fits else []),
        "| quantity | measured | ours | overlap |",
        "|---|---|---|---|",
        *(row_of(row, reasons) for row in compared.rows),
    ]
    below = "".join(f"\n({letter}) {reason}\n" for reason, letter in reasons.items())
    more = dispersion(compared) if record.name == striker_shot.__name__.rpartition(".")[2] else ""
    return "\n".join(lines) + f"\n{below}\n" + more


def repeated_reasons(rows: Sequence[Comparison]) -> dict[str, str]:
    """Return the letters of the reasons that several rows share, which stand once below the table."""
    counts = Counter(row.published.note for row in rows if not row.overlap)
    return dict(zip((reason for reason, count in counts.items() if count > 1), ascii_lowercase, strict=False))


def fitted(compared: ComparedSet, name: str) -> str:
    """Return "modulus 62.93 ± 0.73 GPa, to the frequency of mode 4"."""
    fit = compared.record.fitted[name]
    value = compared.fits.get(name)
    if value is None:
        return f"{name}, {fit['to']}"
    return f"{name} {with_uncertainty(value.value, value.uncertainty, fit['unit'])}, to {fit['to']}"


def row_of(row: Comparison, letters: Mapping[str, str]) -> str:
    """Return a row of the table, with the reason of a disagreement or its letter."""
    measured = with_uncertainty(row.published.value, row.published.uncertainty, row.published.unit)
    ours = with_uncertainty(row.ours.value, row.ours.uncertainty, row.published.unit)
    reason = f" ({letters[row.published.note]})" if row.published.note in letters else f": {row.published.note}"
    verdict = "yes" if row.overlap else f"no{reason}"
    return f"| {row.published.name} | {measured} | {ours} | {verdict} |"


def main() -> None:
    compared = measured_table()
    write_whole(DOCS / "measured.md", page(compared).encode())
    readme = DOCS.parent / "README.md"
    line = (
        f"Against published measurements (`seatfem verify --measured`): {agreement(compared)} "
        "([which do not, and why](docs/measured.md))."
    )
    write_whole(readme, between(readme.read_text(encoding="utf-8"), "measured", line).encode())


if __name__ == "__main__":
    main()
