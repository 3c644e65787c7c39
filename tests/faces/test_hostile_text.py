"""Nothing that a file or an argument holds steers the terminal."""

import json
import re
import subprocess
import sys
import unicodedata

import pytest
from rich.table import Table

from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.faces.terminal import Console, progress_bars, visible

EVIL = "\x1b]0;owned\x07\x1b[2J\x1b[31m\x9b5m\x9d\u202egnp.exe\u2066\u200b\x08\x7f\r[red]b[/red]:skull:"
SPRING = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
RUN = '[run]\nduration = "400 us"\n'  # until it has landed and left
QUOTED = json.dumps(EVIL)  # as TOML writes it too
OWN = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")  # what rich writes for colours and bars


def seen(text):
    """Return the text, once it has nothing that a terminal acts upon but line ends and rich's colours."""
    strange = {c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")} - {"\n", "\t"}
    assert not strange, strange
    return text


@pytest.mark.slow
def test_every_unseen_character_is_told():
    for code in range(sys.maxunicode + 1):
        character = chr(code)
        if unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") and character not in "\n\t":
            if 0x600 <= code <= 0x8E2 or 0x110BD <= code <= 0x1D17A or 0x13430 <= code < 0x13460:
                continue  # marks of numbers, of music and of hieroglyphs: they are seen
            assert visible(character).startswith("\\"), hex(code)
    assert visible("naïve µm ° – 日本 \n\t") == "naïve µm ° – 日本 \n\t"
    assert visible("\x1b[1m\u202e") == "\\x1b[1m\\u202e"


@pytest.mark.parametrize("terminal", [True, False])
def test_messages_tables_and_bars(terminal, capsys):
    console = Console(stderr=True, force_terminal=terminal, width=200)
    console.print(EVIL)
    table = Table(EVIL, title=EVIL)
    table.add_row(EVIL)
    console.print(table)
    with progress_bars(console) as progress:
        progress(EVIL, 0.5)
        progress(EVIL, 1.0)
    text = seen(OWN.sub("", capsys.readouterr().err).replace("\r", ""))
    assert text.count("[red]b[/red]:skull:") >= 4


def folder_of(tmp_path, **files):
    for name, text in files.items():
        (tmp_path / name.replace("_", ".")).write_text(text, encoding="utf-8")
    return tmp_path / "scene.toml"


@pytest.mark.slow(but="greens")
@pytest.mark.parametrize("words", ["run", "plan", "greens", "plan --json"])
def test_titles_are_printed_visibly(words, tmp_path, capsys, monkeypatch):
    """A title steers no terminal, and JSON stays JSON."""
    monkeypatch.chdir(tmp_path)
    verb, *options = words.split()
    scene = folder_of(tmp_path, scene_toml=f"title = {QUOTED}\n{SPRING}{BALL}{RUN}")
    assert run_command([verb, str(scene), *options]) == DONE
    out, err = capsys.readouterr()
    seen(out + err)
    assert not options or json.loads(out)["title"] == EVIL


@pytest.mark.parametrize(
    "text",
    [
        f"{QUOTED} = 1\n{SPRING}{BALL}{RUN}", f"{SPRING}{QUOTED} = 1\n{BALL}{RUN}",
        SPRING.replace('"20 N/um"', QUOTED) + BALL + RUN, f'[seat]\nkind = "greens"\nfile = {QUOTED}\n{BALL}{RUN}',
        f'[seat]\nkind = "mesh"\nfile = "a.inp"\n{BALL}{RUN}', f"[seat]\nkind = {QUOTED}\n{BALL}{RUN}",
        f"\x1b[2J{SPRING}", f'"a\\nseatfem: all is well" = 1\n{SPRING}{BALL}{RUN}',
    ],
)  # fmt: skip
def test_what_is_refused_is_told_visibly(text, tmp_path, capsys):
    scene = folder_of(tmp_path, scene_toml=text, a_inp=f"*NODE, SYSTEM={EVIL}\n")
    assert run_command(["run", str(scene), "-o", str(tmp_path / "out")]) == BAD_INPUT
    out, err = capsys.readouterr()
    assert len(seen(out + err)) > 20
    assert "\nseatfem: all is well" not in err


@pytest.mark.slow
def test_a_traceback_that_was_asked_for(tmp_path):
    scene = folder_of(tmp_path, scene_toml=f"[seat]\nkind = 'greens'\nfile = {QUOTED}\n")
    done = subprocess.run(
        [sys.executable, "-m", "seatfem", "run", str(scene), "--debug"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "Traceback" in seen(done.stderr)
