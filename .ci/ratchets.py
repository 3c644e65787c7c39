"""Count lines, files and hidden arrows; exit with 1 where one is more than 2 % and what was allowed since above its
value at the last release.

    python .ci/ratchets.py [--write]

`ratchets.json` beside this file holds the values of the last release; `--write` replaces them, which a release does.
"""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
FILE: Final = Path(__file__).with_name("ratchets.json")
SLACK: Final = 0.02  # of each limit: a line may be added without asking
ALLOWED: Final = {"lines of product": 4200, "files of product": 30, "hidden arrows": 6, "lines of tests": 1600}
"""What contact faces, retainers, several lands, decisions, limits of studies, doubts about scenes and the live page
were allowed since the last release; the next one takes it out."""
PACKAGES: Final = ("impact", "seatfem")


def count_figures() -> dict[str, int]:
    """Return the figures of this checkout by name."""
    product = {path: path.read_text("utf-8") for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    modules = {_module_name(path) for path in product}
    return {
        "lines of product": sum(text.count("\n") for text in product.values()),
        "files of product": len(product),
        "hidden arrows": sum(len(hidden_arrows(ast.parse(text), modules)) for text in product.values()),
        "lines of tests": sum(path.read_text("utf-8").count("\n") for path in (ROOT / "tests").rglob("*.py")),
    }


def hidden_arrows(tree: ast.Module, modules: set[str]) -> set[tuple[str, object]]:
    """Return the ways by which a file reaches others past the imports at its top.

    These are imports in functions, imports for type checkers alone, modules reached as attributes of their packages,
    and modules named by strings.
    """
    arrows: set[tuple[str, object]] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or _is_for_type_checkers(node):
            imports = (each for each in ast.walk(node) if isinstance(each, ast.Import | ast.ImportFrom))
            arrows |= {("import", each.lineno) for each in imports}
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            arrows.add(("import", node.lineno))
        elif isinstance(node, ast.Constant) and node.value in modules and "." in node.value:
            arrows.add(("string", node.value))
    return arrows | {("attribute", name) for name in _modules_by_attribute(tree, modules)}


def _is_for_type_checkers(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def _modules_by_attribute(tree: ast.Module, modules: set[str]) -> Iterator[str]:
    """Yield each module that is named as an attribute of a package which the file imports."""
    packages = {module.rpartition(".")[0] for module in modules}
    names: dict[str, str] = {}
    for node in tree.body:
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0]: alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            first, _, others = ast.unparse(node).partition(".")
            if names.get(first) in packages and (module := f"{names[first]}.{others}") in modules - packages:
                yield module


def _module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def judge(figures: Mapping[str, int], released: Mapping[str, int]) -> Iterator[str]:
    """Yield a line for each figure above its limit."""
    for name, value in figures.items():
        if value > (limit := int(released[name] * (1 + SLACK)) + ALLOWED[name]):
            parts = f"{released[name]} at the last release + {SLACK:.0%} + {ALLOWED[name]}"
            yield f"{name}: {value}, at most {limit} ({parts})"


def main(arguments: list[str]) -> int:
    """Print the figures, and return 1 where one is above its limit."""
    figures = count_figures()
    if arguments == ["--write"]:
        FILE.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    above = list(judge(figures, json.loads(FILE.read_text(encoding="utf-8"))))
    sys.stdout.write(", ".join(f"{value} {name}" for name, value in figures.items()) + "\n")
    sys.stdout.write("".join(f"{line}; remove what is no longer used\n" for line in above))
    return int(bool(above))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
