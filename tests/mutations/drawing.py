"""Draw small errors of the product from a seed: a number 3 % off, another operator, a message without its key."""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
SEED: Final = 44
CONTEXT: Final = 60  # bytes before and behind, by which a mutation is known again
EACH: Final = 50  # mutations of each group
GROUPS: Final[Mapping[str, Sequence[str]]] = {
    "kernels": ("impact/march/*.py", "impact/march/loop/*.py", "impact/greens/*.py"),
    "laws": ("impact/march/laws.py", "impact/exact/*.py", "impact/beams/*.py", "impact/gas/*.py", "impact/life/*.py"),
    "elements": ("seatfem/structures/elements/*.py", "seatfem/structures/reduction/*.py"),
    "bars": ("seatfem/study/error_budget.py", "seatfem/study/safety.py", "seatfem/study/runs/*.py", "impact/runs/*.py"),
    "units": (
        "seatfem/units.py",
        "seatfem/fields.py",
        "impact/quantities.py",
        "seatfem/readings.py",
        "impact/after/*.py",
    ),
    "messages": ("impact/**/*.py", "seatfem/**/*.py"),
}
"""Names of the groups and where in the product they lie."""
OPERATORS: Final[Mapping[type[ast.AST], str]] = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Lt: ">=", ast.Gt: "<=", ast.LtE: ">", ast.GtE: "<",
    ast.Eq: "!=", ast.NotEq: "==", ast.And: "or", ast.Or: "and",
}  # fmt: skip
"""What stands in place of each operator."""
NUMBER: Final = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")


@dataclass(frozen=True, order=True)
class Mutation:
    """An error of the product: ``old`` at a place of a file becomes ``new``.

    Attributes:
        group: name of its group.
        file: path from the root of the checkout.
        line: number of its line, from 1.
        offset: place in the file [bytes].
        old: source text that is replaced.
        new: source text in its place.
    """

    group: str
    file: str
    line: int
    offset: int
    old: str
    new: str

    def apply(self, root: Path) -> bytes:
        """Write the error into the checkout at ``root``; return what the file held before."""
        path = root / self.file
        before = path.read_bytes()
        end = self.offset + len(self.old.encode())
        assert before[self.offset : end] == self.old.encode(), f"{self}: the source has changed"
        path.write_bytes(before[: self.offset] + self.new.encode() + before[end:])
        return before


def draw_mutations() -> list[Mutation]:
    """Return the mutations of the committed seed, as many of each group."""
    drawn = []
    for group, patterns in GROUPS.items():
        files = sorted({path for pattern in patterns for path in ROOT.glob(pattern)})
        every = sorted({each for path in files for each in _mutations(group, path)})
        drawn += sorted(sorted(every, key=draw_lot)[:EACH])
    return drawn


def draw_lot(mutation: Mutation) -> bytes:
    """Return the lot by which a mutation is drawn: its own, so that it stays drawn when code elsewhere changes."""
    with (ROOT / mutation.file).open("rb") as file:
        file.seek(max(0, mutation.offset - CONTEXT))
        around = file.read(2 * CONTEXT)
    return sha256(f"{SEED} {mutation.group} {mutation.file} {mutation.new} ".encode() + around).digest()


def _mutations(group: str, path: Path) -> Iterator[Mutation]:
    """Yield all that may be drawn of one file."""
    source = path.read_bytes()
    starts = [0, *(match.end() for match in re.finditer(rb"\n", source))]

    def begin_of(node: ast.AST) -> int:
        return starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]

    def end_of(node: ast.AST) -> int:
        return starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    for node in _expressions(ast.parse(source), group == "messages"):
        begin, end = begin_of(node), end_of(node)
        changes = _changes(group, node, source[begin:end].decode())
        if isinstance(node, ast.BinOp | ast.Compare | ast.BoolOp):
            first, second, operator = _operands(node)
            begin, end = end_of(first), begin_of(second)
            changes = _operator_changes(operator, source[begin:end].decode())
        for column, old, new in changes:
            offset = begin + len(source[begin:end].decode()[:column].encode())
            file = path.relative_to(ROOT).as_posix()
            yield Mutation(group, file, source.count(b"\n", 0, offset) + 1, offset, old, new)


def _expressions(node: ast.AST, only_errors: bool) -> Iterator[ast.AST]:
    """Yield the expressions that run, without annotations, decorators and docstrings; or those in errors alone."""
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            is_text = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            if not isinstance(child, ast.AST) or is_text or name in ("annotation", "returns", "decorator_list"):
                continue
            if isinstance(child, ast.Call) and ast.unparse(child.func).endswith(("Error", "Problem")) and only_errors:
                yield from (each for each in ast.walk(child) if isinstance(each, ast.JoinedStr))
                continue
            if isinstance(child, ast.expr) and not only_errors:
                yield child
            if not isinstance(child, ast.JoinedStr):
                yield from _expressions(child, only_errors)


def _changes(group: str, node: ast.AST, text: str) -> Iterator[tuple[int, str, str]]:
    """Yield place in the text, old and new of what may change in an expression that is a literal."""
    if group == "messages":
        yield from ((match.start(), match[0], "") for match in re.finditer(r"(?<!\{)\{[^{}]+\}", text))
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value:
        yield 0, text, repr(node.value + 1 if isinstance(node.value, int) else 1.03 * node.value)
    elif group == "units" and isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield from ((match.start(), match[0], f"{1.03 * float(match[0]):.4g}") for match in NUMBER.finditer(text))


def _operands(node: ast.BinOp | ast.Compare | ast.BoolOp) -> tuple[ast.expr, ast.expr, ast.AST]:
    """Return what stands before and after the first operator, and that."""
    match node:
        case ast.BinOp():
            return node.left, node.right, node.op
        case ast.Compare():
            return node.left, node.comparators[0], node.ops[0]
    return node.values[0], node.values[1], node.op


def _operator_changes(operator: ast.AST, between: str) -> Iterator[tuple[int, str, str]]:
    """Yield place, old and new of the operator in the text between its operands."""
    if type(operator) in OPERATORS and (match := re.search(r"[-+*/<>=!]+|\band\b|\bor\b", between)):
        yield match.start(), match[0], OPERATORS[type(operator)]
