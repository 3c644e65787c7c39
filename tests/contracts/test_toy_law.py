"""A new contact law is one class: no file knows this one, and scenes, plans and runs carry it out."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field

from impact.march.laws import Law, compiled_law
from seatfem.fields import Stiffness
from seatfem.study.scene.laws import ContactLaw, laws
from tests.steps import SceneError, begin_plan, load_scene, run_scene

SCENE = """
seat = {{ kind = "spring", stiffness = "1 GN/m" }}
reed = {{ kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }}
contact = {{ law = {{ kind = "{kind}", stiffness = "1 N/um" }} }}
run = {{ duration = "0.3 ms", filter_width = "10 us", time_step = "0.2 us" }}
accuracy = {{ target = "30 %" }}
"""

SOFT = """
from typing import Literal
from impact.march.laws import LinearSpring
from seatfem.fields import Stiffness
from seatfem.study.scene.laws import ContactLaw

class Soft(ContactLaw):
    kind: Literal["toy_soft"]
    stiffness: Stiffness

    def law(self, share=1.0):
        return LinearSpring(share * self.stiffness)
"""
ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join((str(Path(__file__).parents[2]), "."))}


@pytest.fixture
def toy() -> Iterator[None]:
    class Rubber(ContactLaw):
        """A spring that takes half of its force when the bodies part."""

        kind: Literal["toy_rubber"]
        stiffness: Stiffness = Field(description="force per penetration")

        def law(self, share: float = 1.0) -> Law:
            k = share * self.stiffness

            def force(pen: float, start: float, dt: float) -> float:
                return k * pen if pen >= start else 0.5 * k * pen

            return compiled_law(force)

    yield
    del Rubber.model_fields["kind"]


def written(folder: Path, kind: str) -> Path:
    path = folder / f"{kind}.toml"
    path.write_text(SCENE.format(kind=kind), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_a_toy_law_is_run(tmp_path: Path) -> None:
    """Half the energy is lost: restitution 1/sqrt(2), to what steps of a 500th of the blow leave."""
    scene = load_scene(written(tmp_path, "toy_rubber"))
    assert begin_plan(scene).level == "closed form"
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    spring = run_scene(load_scene(written(tmp_path, "spring")), tmp_path / "spring", pictures=False).summary
    assert summary["restitution"] == pytest.approx(0.5**0.5, rel=5e-3)
    assert summary["peak_force_N"] == pytest.approx(spring["peak_force_N"], rel=5e-3)


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_its_keys_are_checked_and_its_name_is_listed(tmp_path: Path) -> None:
    path = written(tmp_path, "toy_rubber")
    path.write_text(path.read_text().replace('stiffness = "1 N/um" }', "stifness = 1 }"))
    with pytest.raises(SceneError, match=r"contact.law.stifness:.*'stiffness'"):
        load_scene(path)
    with pytest.raises(SceneError, match=r"contact.law.kind: 'rubber'.*'toy_rubber'"):
        load_scene(written(tmp_path, "rubber"))


def test_a_toy_law_is_gone_afterwards(tmp_path: Path) -> None:
    assert {law.__module__ for law in laws()} == {"seatfem.study.scene.laws"}
    with pytest.raises(SceneError, match=r"'toy_rubber' .*'signorini', 'spring', .*'table_joint'$"):
        load_scene(written(tmp_path, "toy_rubber"))


@pytest.mark.slow
def test_a_law_in_a_file_of_its_own_counts_when_it_is_imported_between_ours(tmp_path: Path) -> None:
    """A law that is imported after the tables of scenes are made, before they are read, is found."""
    (tmp_path / "toy_soft.py").write_text(SOFT, encoding="utf-8")
    program = "import seatfem.study.scene.contact, toy_soft; from seatfem.study.scene import load_scene; " + (
        "print(load_scene('soft.toml').contact.law.law())"
    )
    written(tmp_path, "toy_soft").rename(tmp_path / "soft.toml")
    run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, env=ENVIRONMENT)
    assert (run.returncode, "LinearSpring" in run.stdout) == (0, True), run.stderr
