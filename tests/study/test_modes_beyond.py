"""What a plate's modes beyond its band change of a landing is what the error bar knows of them."""

from pathlib import Path

import pytest

import impact
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.modes import in_wider_band
from tests.as_stated import seat_of, striker_of
from tests.gallery import load_text
from tests.steps import Scene, stated_method, values_of_record

STEP = 5e-8


def scene_of(folder: Path, band: float) -> Scene:
    """Return a flapper struck in the middle of its paddle by a stiff spring."""
    return load_text(
        folder,
        '[seat]\nkind = "spring"\nstiffness = "40 N/um"\n[reed]\nkind = "flapper"\nroot_width = "8 mm"\n'
        'taper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "12 mm"\npaddle_diameter = "13 mm"\n'
        'thickness = "0.5 mm"\nmaterial = "steel"\ndamping_ratio = 0.01\ncontact_radius = "3 mm"\n'
        f'contact_width = "0.5 mm"\ngreens = {{ bandwidth = "{band:g} kHz" }}\n'
        'release = { velocity = "-1 m/s" }\n[contact]\ngap = "1 um"\n[run]\nduration = "60 us"\nfilter_width = "4 us"\n'
        "[accuracy]\ntarget = 0.1\n",
    )


def landing_of(scene: Scene, striker: impact.Body) -> tuple[float, float]:
    """Return impulse [N s] and filtered peak [N]."""
    problem = problem_of(scene, striker, impact.Body(seat_of(scene, mesh_error=False).greens))
    record = record_of(scene, problem, STEP)
    values = values_of_record(record, record.landings)
    return values["impulse"], values["filtered_peak"]


@pytest.mark.slow
@pytest.mark.parametrize("band", [30, 60])
def test_the_bar_reaches_what_four_times_the_band_changes(band: float, tmp_path: Path) -> None:
    """The bar of the measure that changes more is 1 to 2.5 times what four times the band changes."""
    scene, wide = scene_of(tmp_path, band), scene_of(tmp_path, 4 * band)
    striker, seat = striker_of(scene), seat_of(scene, mesh_error=False)
    run = ComputedRun(scene, stated_method(scene), seat, problem_of(scene, striker, impact.Body(seat.greens)))
    here, there = landing_of(scene, striker), landing_of(wide, striker_of(wide))
    others = [(share, landing_of(scene, body)) for body, share in in_wider_band(run)]
    assert len(others) >= 2
    bars = [max(share * abs(values[k] - here[k]) / here[k] for share, values in others) for k in range(2)]
    errors = [abs(there[k] - here[k]) / here[k] for k in range(2)]
    most = max(range(2), key=lambda k: errors[k])
    assert errors[most] > 5e-3
    assert errors[most] < bars[most] < 2.5 * errors[most]
    assert errors[1 - most] < bars[1 - most] < bars[most] * 2.5
