"""What holds of every kind of body that may strike: its contact is found, its error told, and told as the reed's."""

from pathlib import Path
from typing import Final

import pytest

import impact
from impact.bodies.reeds import reed
from seatfem.structures.kinds.structure import kind_of
from tests.fuzz import samples
from tests.steps import Scene, kinds_of, load_scene, run_scene
from tests.study.small_scenes import write_oscillator
from tests.uff_sets import unit_set, write_sets

pytestmark = pytest.mark.slow

MESHES: Final = Path(__file__).parents[2] / "meshes"
HELD: Final = 'deflection = "1 um"\n'
SIZE: Final = 'mesh = { size = "4 mm" }\n'
GREENS: Final = 'greens = { bandwidth = "30 kHz", tolerance = "5 %" }\n'
SOLID: Final = f'material = "steel"\ndamping_ratio = 0.02\n{SIZE}{GREENS}'
DRAWN: Final = SOLID + HELD
BEAM: Final = 'length = "20 mm"\nn_modes = 6\nrelease = { tip_deflection = "20 um" }\n'
STRIKERS: Final = {
    "annular": 'bore_radius = "4 mm"\nlip_width = "1 mm"\n' + DRAWN,
    "ball": 'diameter = "10 mm"\n' + SOLID + 'velocity = "-0.1 m/s"\n',
    "bar": 'length = "20 mm"\nwidth = "4 mm"\nheight = "4 mm"\nmodel = "sector"\n' + DRAWN,
    "block": 'width = "8 mm"\ndepth = "8 mm"\nthickness = "8 mm"\npatch_width = "4 mm"\npatch_depth = "4 mm"\n' + DRAWN,
    "cad": f'file = "{(MESHES / "block.step").as_posix()}"\n' + DRAWN,
    "cantilever": BEAM,
    "clamped_clamped": BEAM,
    "conical": 'bore_radius = "4 mm"\nface_width = "2 mm"\n' + DRAWN,
    "disc": 'diameter = "20 mm"\nthickness = "0.5 mm"\ngreens = { bandwidth = "30 kHz" }\nvelocity = "-0.1 m/s"\n',
    "flapper": 'root_width = "8 mm"\ntaper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "15 mm"\n'
    'paddle_diameter = "16 mm"\nthickness = "0.5 mm"\ngreens = { bandwidth = "30 kHz" }\n' + HELD,
    "frf": 'file = "frf.csv"\n' + HELD,
    "greens": 'file = "reed.h5"\n' + HELD,
    "held_disc": 'outer_diameter = "20 mm"\ninner_diameter = "6 mm"\nthickness = "0.5 mm"\n'
    'greens = { bandwidth = "30 kHz" }\nrelease = { deflection = "20 um" }\n',
    "matrices": 'mass = "m.mtx"\nstiffness = "k.mtx"\ncontact = "port.csv"\nsystem = "SI"\ndamping_ratio = 0.05\n'
    'greens = { bandwidth = "20 kHz" }\n' + HELD,
    "mesh": f'file = "{(MESHES / "annular_seat.msh").as_posix()}"\n' + DRAWN.replace(SIZE, ""),
    "modes": 'file = "modes.uff"\nnode = 7\ndirection = "+z"\nsystem = "SI"\n' + HELD,
    "plate": 'ports = 3\nport_radius = "3 mm"\npitch = "10 mm"\nmargin = "5 mm"\nthickness = "4 mm"\n'
    'land_width = "1 mm"\nclamp_width = "2 mm"\n' + DRAWN,
    "rigid_mass": 'mass = "2 g"\nvelocity = "-0.5 m/s"\n',
    "ring_plate": 'outer_diameter = "20 mm"\ninner_diameter = "10 mm"\nthickness = "0.5 mm"\n'
    'greens = { bandwidth = "30 kHz" }\nvelocity = "-0.1 m/s"\n',
    "rod": 'young = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "10 mm"\narea = "10 mm^2"\nfar_end = "free"\n'
    'velocity = "-0.1 m/s"\n',
    "sheet": 'outline = [["0 mm", "-4 mm"], ["20 mm", "-3 mm"], ["20 mm", "3 mm"], ["0 mm", "4 mm"]]\n'
    'clamped = [["0 mm", "-4 mm"], ["0 mm", "4 mm"]]\ncontact_at = ["17 mm", "0 mm"]\nthickness = "0.5 mm"\n'
    'greens = { bandwidth = "30 kHz" }\n' + HELD,
    "stepped": BEAM.replace('length = "20 mm"', 'widths = [["0 mm", "8 mm"], ["20 mm", "4 mm"]]\nthickness = "0.3 mm"'),
    "stopper": 'radius = "8 mm"\nthickness = "5 mm"\ncontact_radius = "3 mm"\n' + DRAWN,
    "timoshenko": BEAM,
    "tip_mass": 'tip_mass = "0.05 g"\n' + BEAM,
}


def scene_of(kind: str, folder: Path) -> Scene:
    """Return a scene that opens 0.2 um before it touches, and leaves its step open."""
    write_files(folder)
    text = (
        f'[seat]\nkind = "spring"\nstiffness = "20 N/um"\n[reed]\nkind = "{kind}"\n{STRIKERS[kind]}'
        '[contact]\ngap = "0.2 um"\n[run]\nduration = "1 ms"\nfilter_width = "20 us"\n[accuracy]\ntarget = "20 %"\n'
    )
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return load_scene(folder / "scene.toml")


def write_files(folder: Path) -> None:
    """Write an oscillator as matrices and as its receptance, a beam's Green's function, the modes of a body."""
    write_oscillator(folder)
    impact.save_greens(reed(impact.Cantilever(200e9, 7850.0, 20e-3, 10e-3, 1e-3), n_modes=8).greens, folder / "reed.h5")
    write_sets(folder / "modes.uff", unit_set(), *samples.modes())


def test_every_kind_that_may_strike_is_here() -> None:
    assert set(STRIKERS) == {
        kind_of(each) for each in kinds_of() if each.traits.moved_by and each.__module__.startswith("seatfem.")
    }


@pytest.mark.slow(but="rod")
@pytest.mark.parametrize("kind", STRIKERS)
def test_a_striker_is_run_and_told_of(kind: str, tmp_path: Path) -> None:
    """It lands; what it is known to be off by is in the bars, or named beside them."""
    scene = scene_of(kind, tmp_path)
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    assert summary["reed_kind"] == kind
    assert summary["contact_count"] > 0
    if not scene.reed.traits.is_solved:
        return
    stated = [summary[f"reed_greens_error_{name}"] for name in ("mesh", "reduction")]
    for name, value in zip(("mesh", "reduction"), stated, strict=True):
        assert (f"striker's {name}" in str(summary["error_unknown"])) == (value is None)
    if any(value and value > 1e-12 for value in stated):  # more than round-off
        assert summary["error_striker_filtered_peak_force_N"] > 0
