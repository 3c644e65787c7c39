"""All of the article's case once more, its tables into docs/paper.md, its pictures into docs/images.

    python examples/paper FOLDER

All but the maps of `regimes.py`, which are kept as files. Tables stand between comments of the page.
"""

import shutil
import sys
from pathlib import Path

import discretised
import figures
import pressure
import stiffness_sweep
import time_steps
import undamped

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "docs"))
from markers import between  # noqa: E402

TABLES = ("table1", "undamped", "time_steps", "pressure")

folder, page = Path(sys.argv[1]), ROOT / "docs" / "paper.md"
folder.mkdir(parents=True, exist_ok=True)
for script in (figures, discretised, undamped, time_steps, pressure, stiffness_sweep):
    script.main(folder)
text = page.read_text(encoding="utf-8")
for name in TABLES:
    text = between(text, name, (folder / f"paper_{name}.md").read_text(encoding="utf-8").rstrip("\n"))
page.write_text(text, encoding="utf-8")
for picture in folder.glob("paper_*.png"):
    shutil.copyfile(picture, ROOT / "docs" / "images" / picture.name)
