"""Who may import whom. Broken rules are named by file and line."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "impact").rglob("*.py"), *(ROOT / "seatfem").rglob("*.py")])

MESHING = ("seatfem/structures/shapes/", "seatfem/structures/mesh/_gmsh_")
PICTURES = ("pyvista", "vtk", "matplotlib", "PIL")
LEAVES = ("seatfem.machine.doctor", "seatfem.verify")
"""What a verb alone imports, and what may import everything below the faces."""
NOT_FOR_IMPACT = ("gmsh", "skfem", "meshio", "pyvista", "pydantic", "pint", "seatfem", "tests")


@cache
def imports(path: Path, *, module_level: bool = False) -> tuple[tuple[int, str], ...]:
    """Return line and full name of each import in a file; `module_level` keeps those that run when it is imported."""
    return tuple((line, name) for line, name, outside in _imports(path) if outside or not module_level)


@cache
def _imports(path: Path) -> tuple[tuple[int, str, bool], ...]:
    """Return line, full name, and whether it runs when the file is imported."""
    tree, entries = ast.parse(path.read_text(encoding="utf-8"), filename=str(path)), []
    for node, outside in statements(tree, True):
        if isinstance(node, ast.Import):
            entries += [(node.lineno, name.name, outside) for name in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute here"
            entries += [(node.lineno, f"{node.module}.{name.name}", outside) for name in node.names]
    return (*entries, *_chains(tree))


def _chains(tree: ast.Module) -> Iterator[tuple[int, str, bool]]:
    """Yield modules that are loaded when asked for as attributes of their rooms, like `reduction.krylov`."""
    rooms = {_module(path) for path in FILES if path.name == "__init__.py"}
    known = {room: room for room in rooms if "." not in room}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names = {name.asname or name.name: f"{node.module}.{name.name}" for name in node.names}
            known |= {name: room for name, room in names.items() if room in rooms}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            root, _, rest = ast.unparse(node).partition(".")
            if known.get(root) and f"{known[root]}.{rest}".rpartition(".")[0] in rooms:
                yield node.lineno, f"{known[root]}.{rest}", False


def statements(node: ast.AST, outside: bool) -> Iterator[tuple[ast.AST, bool]]:
    """Yield all below a node, and if it is outside functions and not for types; no expression has an import."""
    for block in ("body", "handlers", "cases", "orelse", "finalbody"):
        for child in getattr(node, block, ()):
            for_types_only = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test)
            runs = outside and not for_types_only and not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
            yield child, runs
            yield from statements(child, runs)


def offenders(package: str, allowed: tuple[str, ...], files: list[Path], *, module_level: bool = False) -> list[str]:
    """Return places outside `allowed` (path beginnings) that import the package."""
    return [
        f"{name}:{line} imports {imported}"
        for path in files
        if not (name := path.relative_to(ROOT).as_posix()).startswith(allowed)
        for line, imported in imports(path, module_level=module_level)
        if imported.partition(".")[0] == package
    ]


@pytest.mark.slow(but="impact-")
@pytest.mark.parametrize(
    ("folder", "package", "allowed"),
    [
        *(("impact", package, ()) for package in NOT_FOR_IMPACT),
        ("seatfem", "gmsh", MESHING),
        ("seatfem", "tests", ()),
    ],
)
def test_what_a_package_may_not_import(folder: str, package: str, allowed: tuple[str, ...]) -> None:
    """Nothing of seatfem is for `impact`, tests for nobody, and gmsh for what has a process of its own."""
    files = [path for path in FILES if path.is_relative_to(ROOT / folder)]
    assert offenders(package, allowed, files) == []
    assert not allowed or offenders(package, (), files), "the rule guards nothing"


@pytest.mark.slow
@pytest.mark.parametrize("package", PICTURES)
def test_picture_libraries_are_optional(package: str) -> None:
    """Drawing functions import them when they are called: everything else runs without them."""
    assert offenders(package, (), FILES, module_level=True) == []


def test_no_import_cycle() -> None:
    modules = {_module(path): path for path in FILES}
    edges = {
        module: {
            loaded
            for _, name in imports(path, module_level=True)
            for loaded in _run_by(_longest(name, modules), module, modules)
        }
        for module, path in modules.items()
    }
    assert cycle(edges) == ""


@pytest.mark.parametrize("package", ["impact", "seatfem", "seatfem.study"])
def test_no_room_imports_from_one_that_imports_from_it(package: str) -> None:
    """Rooms import one another in no circle, even in functions or for types; `LEAVES` are no rooms."""
    edges: dict[str, set[str]] = {}
    for path in FILES:
        module = _module(path)
        if module.startswith(f"{package}.") and module not in LEAVES:
            room = edges.setdefault(module.removeprefix(f"{package}.").partition(".")[0], set())
            inside = (name.removeprefix(f"{package}.") for _, name in imports(path) if name.startswith(f"{package}."))
            room |= {name.partition(".")[0] for name in inside}
    rooms = {room: {each for each in neighbours if each in edges} - {room} for room, neighbours in edges.items()}
    assert len(rooms) > 5
    assert cycle(rooms) == ""


def cycle(edges: dict[str, set[str]]) -> str:
    """Return the first cycle, with its beginning at both ends."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        return " -> ".join(reversed(error.args[1]))
    return ""


def test_a_cycle_through_a_package_is_seen() -> None:
    """a.one imports b.two, whose package imports b.three, which imports a.one."""
    names = ("a", "a.one", "b", "b.two", "b.three")
    modules = dict.fromkeys(names, Path())
    wanted = {"a": set(), "a.one": {"b.two"}, "b": {"b.three"}, "b.two": set(), "b.three": {"a.one"}}
    edges = {name: {f for t in targets for f in _run_by(t, name, modules)} for name, targets in wanted.items()}
    assert {*cycle(edges).split(" -> ")} == {"a.one", "b", "b.three"}
    assert cycle(edges | {"b.three": set()}) == ""


def _module(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def _run_by(target: str, module: str, modules: dict[str, Path]) -> Iterator[str]:
    """Yield what importing ``target`` runs: it, and each ``__init__`` around it that had not begun before."""
    for name in modules if target else ():
        if name != module and (target == name or (target.startswith(f"{name}.") and not module.startswith(f"{name}."))):
            yield name


def _longest(name: str, modules: dict[str, Path]) -> str:
    """Return the module of ours that an imported name stands in; "" for foreign ones."""
    parts = name.split(".")
    beginnings = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
    return next((beginning for beginning in beginnings if beginning in modules), "")


@pytest.mark.slow
def test_impact_runs_where_nothing_of_seatfem_is_installed() -> None:
    blocked = (*NOT_FOR_IMPACT, *PICTURES, "cyclopts", "rich", "pymetis", "pypardiso")
    code = f"""
import sys
class Block:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {blocked!r}:
            raise ImportError(f"{{name}} is blocked")
sys.meta_path.insert(0, Block())
try:
    import gmsh
except ImportError:
    pass
else:
    raise SystemExit("the block does not work")
from impact import *
assert solve
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
