"""Expressions of Python as they are written: their names, their own words, what goes to a name."""

from __future__ import annotations

import ast
from collections.abc import Iterator

VALUE = "{}"
"""Where a text has something else than its own words."""


def arguments(function: ast.FunctionDef) -> list[str]:
    of = function.args
    return [each.arg for each in (*of.posonlyargs, *of.args, *of.kwonlyargs)]


def name_of(node: ast.AST) -> str:
    match node:
        case ast.Name():
            return node.id
        case ast.Attribute():
            return node.attr
    return ""


def literal(text: ast.expr) -> str:
    """Its own words, with `VALUE` where something else stands."""
    match text:
        case ast.Constant():
            return str(text.value)
        case ast.JoinedStr():
            return "".join(map(literal, text.values))
        case ast.BinOp():
            return literal(text.left) + literal(text.right)
    return VALUE


def nothing(text: ast.expr) -> bool:
    """Whether it says nothing: an empty text, or several, or none."""
    if isinstance(text, ast.Tuple | ast.List):
        return all(map(nothing, text.elts))
    return isinstance(text, ast.Constant) and text.value in ("", None)


def given(node: ast.AST, name: str) -> Iterator[ast.expr]:
    """What a statement gives a name to mean."""
    pairs: list[tuple[ast.expr, ast.expr]] = []
    match node:
        case ast.Assign():
            pairs = [(target, node.value) for target in node.targets]
        case ast.AnnAssign() | ast.NamedExpr() | ast.AugAssign() if node.value is not None:
            pairs = [(node.target, node.value)]
        case ast.For() | ast.comprehension():
            pairs = [(node.target, each) for each in elements(node.iter)]
        case ast.Call(func=ast.Attribute(value=ast.Name() as collected, attr="append"), args=[value]):
            pairs = [(collected, value)]
    for target, value in pairs:
        part = part_of(target, value, name)
        if part is not None and not nothing(part):
            yield part


def words(part: ast.FormattedValue) -> bool:
    """Whether it may be text: numbers have a format, and what a user wrote is quoted."""
    return part.format_spec is None and part.conversion < 0


def elements(of: ast.expr) -> list[ast.expr]:
    """What a loop runs over, where it is written out; itself where it is not."""
    return of.elts if isinstance(of, ast.Tuple | ast.List) else [of]


def part_of(target: ast.expr, value: ast.expr, name: str) -> ast.expr | None:
    """What of a value goes to the name; None where nothing does."""
    if isinstance(target, ast.Name):
        return value if target.id == name else None
    if isinstance(target, ast.Tuple):
        known = value.elts if isinstance(value, ast.Tuple | ast.List) and len(value.elts) == len(target.elts) else None
        for place, each in enumerate(target.elts):
            found = part_of(each, known[place] if known else value, name)
            if found is not None:
                return found
    return None
