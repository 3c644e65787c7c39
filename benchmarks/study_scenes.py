"""Processor time of scenes of a study of the PEEK sleeve: planned alone, begun as the first ones ended, side by side.

    python benchmarks/study_scenes.py [SCENES]

The three are taken in turn, scene by scene, so that other programs slow all of them alike. Those side by side differ in
gap and release alone and are compared with runs of the same scenes in full: their values by the same plan, and with
the error bars of the sample, where it is planned for the tighter target of such studies.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np
from scenes import SLEEVE
from table import Table, publish

from seatfem.structures.store import VARIABLE
from seatfem.study.scene import load_scene
from seatfem.study.sweep.outcome import Outcome, carry_out
from seatfem.study.sweep.sampled import BAR, LEAST, SAFETY, settings
from seatfem.study.sweep.side_by_side import side_by_side
from seatfem.study.sweep.start import PILOTS, chosen

ROUNDS = 4
SCENES = 20
LANES = 64
MEASURES = ("impulse_Ns", "filtered_peak_force_N")


def reeds(count: int) -> list[dict[str, str]]:
    """Scenes that differ in reed, release and gap."""
    rng = np.random.default_rng(1)
    return [
        {
            "reed.thickness": f"{rng.normal(0.4, 0.004):.6f} mm",
            "reed.release.tip_deflection": f"{rng.normal(1, 0.05):.6f} mm",
            "contact.gap": f"{rng.uniform(0, 0.1):.6f} mm",
        }
        for _ in range(count)
    ]


def begun(scenes: list[dict[str, str]], **more: object) -> dict[str, object]:
    """What scenes after these begin with."""
    first = carry_out(SLEEVE, {**scenes[0], **more}, ROUNDS, {}, leads=True, stress=False)
    others = [carry_out(SLEEVE, {**each, **more}, ROUNDS, first.start, leads=True, stress=False) for each in scenes[1:]]
    return dict(chosen([each.start for each in (first, *others) if each.start]))


def timed(rows: list[float], *given: object, **named: object) -> Outcome:
    """Of one scene, its processor time added to ``rows``."""
    start = process_time()
    found = carry_out(SLEEVE, *given, stress=False, **named)  # type: ignore[arg-type]
    rows.append(process_time() - start)
    return found


def main(count: int) -> None:
    """All of it; two minutes of a processor that has nothing else to do."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ[VARIABLE] = str(Path(folder) / "store")
        scenes = reeds(count + PILOTS + 1)
        start = begun(scenes[: PILOTS + 1])
        alone, after, lanes = list[float](), list[float](), list[float]()
        rounds = {"alone": list[int](), "after": list[int]()}
        for changed in scenes[PILOTS + 1 :]:
            own = {**changed, **start["seat"]}  # type: ignore[dict-item]
            rounds["alone"].append(int(timed(alone, own, ROUNDS, {}).summary["accuracy_rounds"]))  # type: ignore[arg-type]
            rounds["after"].append(int(timed(after, changed, ROUNDS, start).summary["accuracy_rounds"]))  # type: ignore[arg-type]
        more = dict(settings(load_scene(SLEEVE)))
        contact = [{k: v for k, v in each.items() if k != "reed.thickness"} for each in reeds(LANES)]
        start = begun(contact[: PILOTS + 1], **more)
        side_by_side(SLEEVE, more, contact[:1], 1, start, ())  # compiled
        begin = process_time()
        beside = side_by_side(SLEEVE, {**contact[0], **more}, contact, 1, start, ())
        lanes.append((process_time() - begin) / len(contact))
        places = np.linspace(PILOTS + 1, LANES - 1, LEAST + count).round().astype(int)
        full = [timed([], {**contact[k], **more}, 1, start, once=True) for k in places]
    values, bars, found = (
        np.array([[float(row.summary[name]) for name in names] for row in rows])  # type: ignore[arg-type]
        for rows, names in (
            (full, MEASURES),
            (full, [BAR + name for name in MEASURES]),
            ([beside[k] for k in places], MEASURES),
        )
    )
    sample, held = np.arange(len(places)) % 2 == 0, np.arange(len(places)) % 2 == 1
    bound = SAFETY * np.abs(bars / values)[sample].max(axis=0)
    off = np.abs(found / values - 1).max()
    within = (np.abs(bars / values)[held] <= bound).mean()
    notes = (
        f"{count} scenes of the PEEK sleeve, in turn.",
        "",
        f"Side by side and in full by one plan: values differ by {off:.1e} at most. Of {held.sum()} scenes that are "
        f"not in the sample {within:.0%} of the measures have own error bars within that of the sample "
        f"({', '.join(f'{100 * share:.2g} %' for share in bound)}).",
    )
    ways = {"planned by itself": alone, "begun as the first ones ended": after, "side by side, measures alone": lanes}
    told = [*(f"{np.mean(each):.2f}" for each in rounds.values()), ""]
    table = tuple(
        (name, f"{np.mean(spent):.3g}", number, f"{500 * np.mean(spent):.0f}")
        for (name, spent), number in zip(ways.items(), told, strict=True)
    )
    columns = ("a scene", "processor time [s]", "rounds", "a thousand on two cores [s]")
    publish("study_scenes", Table("Scenes of a study", notes, columns, table))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SCENES)
