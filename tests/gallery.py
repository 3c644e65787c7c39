"""Scenes of many tests: their tables, and how a test reads, runs and refuses one; a gallery of runs made once."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from seatfem.faces.cli import run_command
from seatfem.jobs.folders import claimed
from seatfem.machine.code import VARIABLE
from seatfem.structures.sheets import modes_in_process, solved_sheet
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import Scene, SceneError, load_scene

Told = pytest.CaptureFixture[str]
Patch = pytest.MonkeyPatch
"""What a test is given: what the program printed, and what it may replace for a while."""
STEEL = 'material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }\n'
FLAPPER = (
    f'kind = "flapper"\nroot_width = "8 mm"\ntaper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "15 mm"\n'
    f'paddle_diameter = "16 mm"\nthickness = "0.3 mm"\n{STEEL}'
)
"""With modes at 196.6, 915.2 (torsion) and 1644 Hz; without its table's name, as the other bodies."""
LIP = f"""kind = "annular"
bore_radius = "5 mm"
lip_width = "1 mm"
lip_edge_radius = "0 mm"
{STEEL}"""
"""A lip from 5 to 6 mm, that the flapper covers."""
BAR = (
    '\nkind = "bar"\nlength = "10 mm"\nwidth = "2 mm"\nheight = "3 mm"\ndamping_ratio = 0.05\n'
    'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\nmodel = "3d"\n'
    'mesh = { size = "2 mm", contact_size = "2 mm" }\ngreens = { bandwidth = "100 kHz" }\n'
)
"""A slender block as a seat; without its table's name."""
REED_ON_SPRING = (
    '\n[seat]\nkind = "spring"\nstiffness = "27.8 N/um"\n[reed]\nkind = "cantilever"\nlength = "25.4 mm"\n'
    'damping_ratio = 0.03\nrelease = { tip_deflection = "1 mm" }\n[run]\nduration = "0.75 ms"\nfilter_width = "8 us"\n'
    "[accuracy]\n"
)
"""A beam that lands once; what is asked of its accuracy follows."""


def spring(stiffness: str) -> str:
    """Return the keys of a spring."""
    return f'kind = "spring"\nstiffness = "{stiffness}"\n'


def mass(grams: float, velocity: str) -> str:
    """Return the keys of a rigid mass that is thrown."""
    return f'kind = "rigid_mass"\nmass = "{grams:g} g"\nvelocity = "{velocity}"\n'


def write_scene(folder: Path, *parts: str, name: str = "scene.toml") -> Path:
    """Return the file of a scene's text in ``folder``."""
    path = folder / name
    path.write_text("".join(parts), encoding="utf-8")
    return path


def load_text(folder: Path, *parts: str, name: str = "scene.toml", changed: dict[str, Any] | None = None) -> Scene:
    """Return the scene of a text, which is kept in ``folder`` under ``name``."""
    return load_scene(write_scene(folder, *parts, name=name), changed)


def refusal(load_it: Callable[..., object], *given: object, **named: object) -> str:
    """Return what is said of a scene that is refused: ``load_it(*given)`` must raise `SceneError`."""
    with pytest.raises(SceneError) as caught:
        load_it(*given, **named)
    return str(caught.value)


def summary_of(scene: Scene, folder: Path, **how: Any) -> dict[str, Any]:
    """Return the summary of a run without pictures."""
    return dict(run_scene(scene, folder, pictures=False, **how).summary)


def run_alone(scene: Path, folder: Path) -> Path:
    """Return the folder of `seatfem run` of a scene, which began with an empty store and found nothing in memory."""
    modes_in_process.cache_clear()
    solved_sheet.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(folder / "store"))
        code = run_command(["run", str(scene), "--no-pictures", "--quiet", "-o", str(folder / "run")])
    assert code in (0, 1), scene
    return folder / "run"


def read_summary(run: Path) -> dict[str, Any]:
    """Return the summary.json of a run."""
    return dict(json.loads((run / "summary.json").read_text(encoding="utf-8")))


@dataclass(frozen=True)
class Gallery:
    """Runs of whole scene files, each made once for all tests of all workers: nobody writes into what it returns."""

    folder: Path
    patience: float = 1800.0  # s, for a run that another worker makes

    def run_of(self, scene: Path) -> Path:
        """Return the folder of the run of a scene, made now or by another test before."""
        home = self.folder / scene.stem
        with claimed(self.folder / f"{scene.stem}.lock", self.patience) as is_ours:
            assert is_ours, f"{scene.stem}: no run within {self.patience:g} s"
            if not (home / "done").exists():
                run_alone(scene, home)
                (home / "done").touch()
        return home / "run"
