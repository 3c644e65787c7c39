"""What can be wrong with a flat reed over its lip: each is told with key, value and limit."""

from pathlib import Path

import pytest

from seatfem.faces.cli import run_command
from tests.gallery import FLAPPER, LIP, STEEL

SCENE = """
[seat]
{seat}[reed]
{reed}
release = {{ mode = 1, velocity = "-2 m/s" }}
[contact]
{contact}
[run]
duration = "80 us"
{more}
"""
THICK = FLAPPER.replace("0.3 mm", "5 mm") + 'greens = { bandwidth = "300 kHz" }'
SHEET = f"""kind = "sheet"
outline = [["0 mm", "-4 mm"], ["24 mm", "8 mm"], ["24 mm", "-8 mm"], ["0 mm", "4 mm"]]
clamped = [["0 mm", "-4 mm"], ["0 mm", "4 mm"]]
contact_at = ["16 mm", "0 mm"]
thickness = "0.3 mm"
{STEEL}"""
HELD = f"""kind = "sheet"
outline = [["0 mm", "-8 mm"], ["24 mm", "-8 mm"], ["24 mm", "8 mm"], ["0 mm", "8 mm"]]
holes = [[["2 mm", "-1 mm"], ["4 mm", "-1 mm"], ["4 mm", "1 mm"], ["2 mm", "1 mm"]]]
clamped = {{ hole = ["20 mm", "0 mm"] }}
contact_at = ["16 mm", "0 mm"]
thickness = "0.3 mm"
{STEEL}"""
GAP = 'gap = "1 um"\n'
STOPPER = '[stopper]\nkind = "spring"\nstiffness = "1 N/um"\n'


@pytest.mark.slow(only=("waves",))
@pytest.mark.parametrize(
    ("reed", "contact", "more", "told"),
    [
        (FLAPPER, GAP + 'offset = ["30 mm", "0 mm"]', "",
         ("contact.offset: [30 mm, 0 mm]", "covers 0 %", "reed has 8 mm", "change the")),
        (FLAPPER, GAP + 'offset = ["3 mm", "0 mm"]', "",
         ("contact.offset: [3 mm, 0 mm]", "limit: all", "reed has 8 mm", "change the")),
        (FLAPPER.replace("16 mm", "9 mm"), GAP, "",
         ("contact.offset", "reaches 6 mm", "reed has 4.5 mm", "change the")),
        (FLAPPER.replace("0.3 mm", "7 mm"), GAP, "", ("reed.thickness", "7 mm", "6 mm", "neck_width", "cad")),
        (THICK, GAP, "", ("reed.thickness", "5 mm", "0.39", "limit 0.33", "to 217 kHz", "'cad' or 'mesh'")),
        (SHEET, GAP, "", ("reed.outline", "crosses", "edges 1 and 3")),
        (HELD, GAP, "", ("reed.clamped", "hole (0.02, 0) m", "one of its holes")),
        (FLAPPER, GAP, STOPPER + 'lift = "-1 mm"', ("stopper.lift", "-1 mm", "could not leave", "more than 0 mm")),
        (FLAPPER, 'gap = "-1 um"\ntilt = "0.3 deg"', "", ("contact.gap", "-1 um", "must be >= 0")),
        (FLAPPER, GAP + "ports = 2048\nrings = 4", "", ("contact.ports", "2048", "4096", "take fewer")),
    ],
    ids=["misses", "reaches_off", "small", "thick", "waves", "crosses", "hole", "stopper", "gap", "parts"],
)  # fmt: skip
def test_it_is_told(reed, contact, more, told, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(seat=LIP, reed=reed, contact=contact, more=more), encoding="utf-8")
    assert run_command(["run", str(path), "-o", str(tmp_path / "out")]) == 2
    out, words = capsys.readouterr()
    assert out == ""
    for part in told:
        assert part in " ".join(words.split())
    assert "Traceback" not in words
    assert not list(tmp_path.glob("out/*"))
