"""Packages of others that fail while they are imported are named, with their extra and the command that mends them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from impact.names import how_to_mend

ROOT = Path(__file__).parents[2]
RUN = "import sys; from seatfem.faces.cli import run_command; sys.exit(run_command(sys.argv[1:]))"


def answer(folder: Path, module: str, code: str, *arguments: str) -> str:
    """Return what the program says if such a module lies before the installed one."""
    (folder / module).mkdir()
    (folder / module / "__init__.py").write_text(code, encoding="utf-8")
    program = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; {RUN}"
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 1
    return " ".join(done.stderr.split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "code", "whose", "reason"),
    [
        ("pint", 'raise ImportError("libpint.so: cannot open")', "pint", "libpint.so: cannot open"),
        ("pint", 'raise AttributeError("module numpy has no float_")', "pint", "module numpy has no float_"),
        ("pint", "import no_such_dependency", "pint", "No module named 'no_such_dependency'"),
    ],
)
def test_a_broken_package_is_named(module: str, code: str, whose: str, reason: str, tmp_path: Path) -> None:
    """It is no bug of this program, whatever its import raises."""
    (tmp_path / "scene.toml").write_text('[reed]\nkind = "ball"\ndiameter = "1 furlong"\n', encoding="utf-8")
    message = answer(tmp_path, module, code, "plan", "scene.toml")
    assert re.search(rf"{whose} is installed but .*\({reason}\).*: pip install --force-reinstall {whose}$", message)
    assert "this is a bug" not in message


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ModuleNotFoundError("No module named 'pandas'", name="pandas"), "pandas .*not installed.*install .*with"),
        (ModuleNotFoundError("No module named 'dateutil'", name="dateutil"),
         "pandas .*'tables'.* installed but"),
        (ImportError("x"), r"pandas .*'tables'.* installed but .*\(x\)"),
    ],
)  # fmt: skip
def test_what_is_absent_is_installed_and_what_is_broken_anew(error: ImportError, words: str) -> None:
    assert re.match(words, how_to_mend("pandas", "tables", error))
