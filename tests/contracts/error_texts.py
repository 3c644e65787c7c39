"""What the packages say when they refuse: every text of an error, followed to where its words come from.

A text may be put together: of variables, constants, branches and functions of the packages, and of what callers hand to
a function that makes errors. It has a remedy when it has one whichever way it came about. Nothing is run.
"""

from __future__ import annotations

import ast
import builtins
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from tests.contracts.expressions import arguments, given, literal, name_of, nothing, words

PLAIN = ("ValueError", "RuntimeError", "FileNotFoundError", "ImportError", "MemoryError")
"""Errors of Python that tell a user something; others (TypeError, NotImplementedError, OSError) are for who calls."""
DEEPEST = 12
"""Steps from an error to where its words stand."""
PLACES = {"KeyProblem": 1, "Problem": 3}
"""Where the words stand among the arguments of an error that has its key before them."""
MADE_OF_OTHERS = ("SceneError",)
"""Errors whose texts are those of the problems in them."""
PASSED_ON = (
    "join", "replace", "format", "strip", "removeprefix", "partition", "get", "values", "items", "fromkeys",
    "str", "next", "tuple", "list", "sorted", "map",
)  # fmt: skip
"""Functions of Python whose result has the words that they are given."""


@dataclass(frozen=True)
class Scope:
    """Where an expression stands: its file, the functions around it (the innermost last) and the class."""

    path: Path
    functions: tuple[ast.FunctionDef, ...] = ()
    owner: ast.ClassDef | None = None

    @property
    def names(self) -> set[str]:
        """Of the arguments of the functions and the fields of the class."""
        fields = self.owner.body if self.owner else ()
        return {name for function in self.functions for name in arguments(function)} | {
            name_of(node.target) for node in fields if isinstance(node, ast.AnnAssign)
        }


@dataclass(frozen=True)
class Made:
    """An error that is made somewhere: its words, without key, line and file."""

    kind: str
    text: ast.expr
    scope: Scope


@dataclass
class Code:
    """Both packages, parsed: who makes and calls what."""

    files: Sequence[Path]
    remedy: re.Pattern[str]
    functions: dict[str, list[tuple[ast.FunctionDef, Scope]]] = field(default_factory=lambda: defaultdict(list))
    calls: dict[str, list[tuple[ast.Call, Scope]]] = field(default_factory=lambda: defaultdict(list))
    values: dict[str, list[tuple[ast.expr, Scope]]] = field(default_factory=lambda: defaultdict(list))
    classes: dict[str, ast.ClassDef] = field(default_factory=dict)
    findings: list[Made] = field(default_factory=list)

    def __post_init__(self) -> None:
        for path in self.files:
            self._read(ast.parse(path.read_text(encoding="utf-8")), Scope(path))

    def _read(self, tree: ast.AST, scope: Scope) -> None:
        for node in ast.iter_child_nodes(tree):
            inside = scope
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name].append((node, scope))
                inside = Scope(scope.path, (*scope.functions, node), scope.owner)
            elif isinstance(node, ast.ClassDef):
                self.classes[node.name] = node
                inside = Scope(scope.path, (), node)
            elif isinstance(node, ast.Call):
                self.calls[name_of(node.func)].append((node, scope))
            elif isinstance(node, ast.Yield) and isinstance(node.value, ast.Tuple) and yields_findings(scope):
                self.findings.append(Made("Finding", node.value.elts[-1], scope))
            elif isinstance(node, ast.Assign | ast.AnnAssign) and not scope.functions and node.value is not None:
                for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                    self.values[name_of(target)].append((node.value, scope))
            self._read(node, inside)

    @cached_property
    def errors(self) -> set[str]:
        """Names of the packages' own classes of errors."""
        found = {name for name in dir(builtins) if name.endswith(("Error", "Exception"))}
        own: set[str] = set()
        while True:
            more = {n for n, c in self.classes.items() if any(name_of(b) in found | own for b in c.bases)} - own
            if not more:
                return own
            own |= more

    def made(self) -> Iterator[Made]:
        """All errors with a text of their own, but private ones: they do not leave their file, which tells them on."""
        yield from self.findings
        kinds = {n for n in self.errors if not n.startswith("_")} - set(MADE_OF_OTHERS)
        for kind in sorted(kinds | {*PLAIN, "Problem"}):
            at = PLACES.get(kind, 0)
            yield from (Made(kind, call.args[at], scope) for call, scope in self.calls[kind] if len(call.args) > at)

    def has_remedy(self, text: ast.expr, scope: Scope, within: frozenset[int] = frozenset()) -> bool:
        """Whichever way it comes about; ``within``: what is being asked already, for words are made of themselves."""
        if self.remedy.search(literal(text)):
            return True
        if len(within) > DEEPEST or id(text) in within:
            return False
        within |= {id(text)}

        def also(part: ast.expr) -> bool:
            return self.has_remedy(part, scope, within)

        match text:
            case ast.JoinedStr():
                return any(
                    also(part.value) for part in text.values if isinstance(part, ast.FormattedValue) and words(part)
                )
            case ast.BinOp():
                return also(text.left) or also(text.right)
            case ast.IfExp():
                return all(also(part) for part in (text.body, text.orelse) if not nothing(part))
            case ast.BoolOp():
                return all(map(also, text.values))
            case ast.Tuple() | ast.List():
                return any(map(also, text.elts))
            case ast.Dict():
                return all(map(also, text.values))
            case ast.Subscript() | ast.Starred() | ast.NamedExpr():
                return also(text.value)
            case ast.GeneratorExp() | ast.ListComp():
                return also(text.elt)
            case ast.DictComp():
                return also(text.value)
            case ast.Name():
                return self._name(text, scope, within)
            case ast.Attribute():
                if text.attr == "message":  # of another error, which is asked itself
                    return True
                return self._all([*self.values.get(text.attr, ()), *self._answers(text.attr, scope)], within)
            case ast.Call():
                return self._call(text, scope, within)
        return False

    def _call(self, call: ast.Call, scope: Scope, within: frozenset[int]) -> bool:
        name = name_of(call.func)
        if name in PASSED_ON:
            parts = [call.func.value] if isinstance(call.func, ast.Attribute) else []
            return any(self.has_remedy(part, scope, within) for part in (*parts, *call.args))
        found = self._answers(name, scope)
        return self._all(found, within) or (bool(found) and any(self.has_remedy(e, scope, within) for e in call.args))

    def _all(self, found: list[tuple[ast.expr, Scope]], within: frozenset[int]) -> bool:
        """Whether there are some and all have a remedy, but for those that are being asked already."""
        return bool(found) and all(id(text) in within or self.has_remedy(text, scope, within) for text, scope in found)

    def _answers(self, name: str, scope: Scope) -> list[tuple[ast.expr, Scope]]:
        """What the functions of this name return: those of the same file, or else all."""
        found = [
            (node.value, Scope(around.path, (*around.functions, function), around.owner))
            for function, around in self.functions.get(name, [])
            for node in ast.walk(function)
            if isinstance(node, ast.Return | ast.Yield) and node.value is not None and not nothing(node.value)
        ]
        return [each for each in found if each[1].path == scope.path] or found

    def _name(self, name: ast.Name, scope: Scope, within: frozenset[int]) -> bool:
        for depth in range(len(scope.functions), 0, -1):
            inside = Scope(scope.path, scope.functions[:depth], scope.owner)
            if ways := list(self._bindings(name, inside)):
                return all(way(within) for way in ways)
        every = self.values.get(name.id, [])
        near = [each for each in every if each[1].path == scope.path] or every
        return name.id.isupper() and self._all(near, within)

    def _bindings(self, name: ast.Name, scope: Scope) -> Iterator[Callable[[frozenset[int]], bool]]:
        """For each way in which a name gets its value in a function: whether a remedy is in it."""
        function = scope.functions[-1]
        if name.id in arguments(function):
            yield lambda within: self._handed(name.id, scope, within)
        for node in ast.walk(function):
            for handler in node.handlers if isinstance(node, ast.Try) else ():
                if handler.name == name.id and handler.lineno <= name.lineno <= (handler.end_lineno or 0):
                    yield lambda within, tried=node, handler=handler: self._told(tried, handler)
            for value in given(node, name.id):
                yield lambda within, value=value: id(value) in within or self.has_remedy(value, scope, within)

    def _told(self, tried: ast.Try, handler: ast.ExceptHandler) -> bool:
        """Whether what is caught has its words from the packages, where they are asked for a remedy themselves."""
        kinds = handler.type.elts if isinstance(handler.type, ast.Tuple) else [handler.type] if handler.type else []
        names = {name_of(kind) for kind in kinds}
        ours = any(name_of(node) in self.functions for part in tried.body for node in ast.walk(part))
        return bool(names & self.errors) or ("ValueError" in names and ours)

    def _handed(self, name: str, scope: Scope, within: frozenset[int]) -> bool:
        """Whether every caller in the packages hands over a remedy."""
        function = scope.functions[-1]
        made = function.name == "__init__" and scope.owner is not None
        every = self.calls.get(scope.owner.name if made else function.name, [])
        near = every
        if function.name.startswith("_") or len(self.functions[function.name]) > 1 or len(scope.functions) > 1:
            near = [each for each in every if each[1].path == scope.path]
        found = []
        for call, around in near:
            names = [each for each in arguments(function) if each not in ("self", "cls")]
            handed = dict(zip(names, call.args, strict=False)) | {k.arg: k.value for k in call.keywords}
            if name in handed and id(handed[name]) not in within:
                found.append((handed[name], around))
        return self._all(found, within)


def yields_findings(scope: Scope) -> bool:
    """Keys and what is wrong with them, which become problems of a scene."""
    around = scope.functions[-1:]
    results = [ast.unparse(each.returns) for each in around if each.returns is not None]
    return any("Finding]" in result or result == "Contradictions" for result in results)
