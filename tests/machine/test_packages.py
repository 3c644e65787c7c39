"""Packages of others that fail while they are imported are named, with their extra and the command that mends them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from impact.names import how_to_mend

ROOT = Path(__file__).parents[2]
RUN = "import sys; from seatfem.faces.cli import run_command; sys.exit(run_command(sys.argv[1:]))"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ('raise ImportError("libpint.so: cannot open")', "libpint.so: cannot open"),
        ('raise AttributeError("module numpy has no float_")', "module numpy has no float_"),
        ("import no_such_dependency", "No module named 'no_such_dependency'"),
    ],
)
def test_a_broken_package_is_named(code: str, reason: str, tmp_path: Path) -> None:
    """It is no bug of this program, whatever its import raises."""
    (tmp_path / "scene.toml").write_text('[reed]\nkind = "ball"\ndiameter = "1 furlong"\n', encoding="utf-8")
    (tmp_path / "pint").mkdir()
    (tmp_path / "pint" / "__init__.py").write_text(code, encoding="utf-8")
    program = f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(ROOT)!r}]; {RUN}"
    command = [sys.executable, "-c", program, "plan", "scene.toml"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1
    message = " ".join(done.stderr.split())
    assert re.search(rf"pint is installed but .*\({reason}\).*: pip install --force-reinstall pint$", message)
    assert "this is a bug" not in message


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'pandas'", name="pandas"), "pandas .*not installed.*install .*with"),
        (ModuleNotFoundError("No module named 'dateutil'", name="dateutil"), "pandas .*'tables'.* installed but"),
        (ImportError("x"), r"pandas .*'tables'.* installed but .*\(x\)"),
    ],
)
def test_what_is_absent_is_installed_and_what_is_broken_anew(error: ImportError, words: str) -> None:
    assert re.match(words, how_to_mend("pandas", "tables", error))
