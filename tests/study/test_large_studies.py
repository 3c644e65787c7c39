"""Studies of more scenes than can be checked at once: priced by some of them, bounded, with progress."""

import pytest

from seatfem.faces.cli import DONE, run_command
from tests.bounded import assert_refused, bounded

SCENE = """
seat = { kind = "spring", stiffness = "1e6 N/m" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "100 us" }
"""
DRAWN = (
    '\nscene = "scene.toml"\ndesign = "monte_carlo"\nnumber = {0}\nlimit = {0}\n[vary]\n'
    '"reed.velocity" = {{ from = "-2 m/s", to = "-1 m/s" }}\n'
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


@pytest.mark.slow
def test_a_plan_of_many_scenes_is_a_price_at_once(folder, capfd):
    for count in (100_000, 1_000_000):
        (folder / f"{count}.toml").write_text(DRAWN.format(count))
    with bounded():
        assert run_command(["plan", str(folder / "100000.toml")]) == DONE
    words = " ".join(capfd.readouterr().out.split())
    assert "100000 scenes: about" in words
    assert "based on 1000 scenes" in words
    assert_refused(["plan", str(folder / "1000000.toml")], capfd, "1000000.toml:4: number: 1000000 ", " 100000")
