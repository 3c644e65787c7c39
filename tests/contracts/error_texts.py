"""What the packages say when they refuse: every text of an error, followed to where its words come from.

A text may be put together: from variables, constants, branches and functions of the packages, and from what callers hand
to a function that makes errors. It has a remedy when it has one whichever way it came about. Nothing is run.
"""

from __future__ import annotations

import ast
import builtins
import gc
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

DEEPEST = 6
"""Steps from an error to the words of its text."""
PLAIN = ("ValueError", "RuntimeError", "OSError", "FileNotFoundError", "ImportError", "MemoryError", "TimeoutError")
"""Errors of Python that tell a user something; others (NotImplementedError, TypeError, ...) are for who programs."""
MADE_OF_OTHERS = ("SceneError",)
VALUE = "{}"
VERBS = (
    "accept add allow apply ask average begin call change check choose cite close compare compute condense construct convert "
    "copy correct cut define delete draw drive drop end enlarge exchange explode export fill fit free give heal improve "
    "install integrate join keep lead leave let list load lower make march measure mend merge move name open pip place prepare "
    "press put raise read reduce refine release remove rename report resample restore run save scale see select set shift shorten "
    "sort spell split stack start state straighten strike subtract take try unpack update use vary wait watch write"
).split()
REMEDY = re.compile(
    rf"(?:^|[;:,.(?] |\b(?:or|and|first|please|then) )(?:{'|'.join(VERBS)}|hold (?:it|the)|mesh (?:finer|it|the)|number their)\b"
    r"|\bmust\b|\bneeds?\b|\bneeded\b|\brequired\b|\bexpected\b"  # what is wanted
    r"|\bat (?:least|most)\b|\boutside\b|\bbetween \S+ and\b|\brange: |[<>]=? ?[\d{]|\.\."  # a range that is allowed
    r"|\b(?:not|none|no) one of\b|\bnone of\b|\bdid you mean\b|\bdecks know\b|\bknown(?::| are| here| places)"  # a list
    r"|\bthere are: |\b(?:file|mesh|model|result|function|plate|reed|solid) has:? \{",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Scope:
    """Where an expression stands: its file, the functions around it (the innermost last) and the class."""

    path: Path
    functions: tuple[ast.FunctionDef, ...] = ()
    owner: ast.ClassDef | None = None


@dataclass(frozen=True)
class Made:
    """An error that is made somewhere."""

    kind: str
    call: ast.Call
    scope: Scope


@dataclass
class Code:
    """Both packages, parsed: who makes and calls what."""

    files: list[Path]
    functions: dict[str, list[tuple[ast.FunctionDef, Scope]]] = field(default_factory=lambda: defaultdict(list))
    calls: dict[str, list[tuple[ast.Call, Scope]]] = field(default_factory=lambda: defaultdict(list))
    values: dict[str, list[tuple[ast.expr, Scope]]] = field(default_factory=lambda: defaultdict(list))
    classes: dict[str, ast.ClassDef] = field(default_factory=dict)

    def __post_init__(self) -> None:
        gc.disable()  # trees without rings: collecting takes four times as long as parsing
        try:
            for path in self.files:
                self._read(ast.parse(path.read_text(encoding="utf-8")), Scope(path))
        finally:
            gc.enable()

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
        """All errors with a text of their own; private ones do not leave their file, whose other errors tell them on."""
        kinds = {n for n in self.errors if not n.startswith("_")} - set(MADE_OF_OTHERS)
        for kind in sorted(kinds | {*PLAIN, "Problem"}):
            for call, scope in self.calls[kind]:
                if call.args or call.keywords:
                    yield Made(kind, call, scope)

    def text(self, made: Made) -> ast.expr:
        """The words, without key, line and file."""
        return self._message(made.kind, made.call)

    def _message(self, kind: str, call: ast.Call) -> ast.expr:
        names = ["message"]
        owner = self.classes.get(kind)
        if owner is not None:
            for node in owner.body:
                if isinstance(node, ast.FunctionDef) and node.name == "__init__":
                    names = [a.arg for a in node.args.args[1:]]
            if kind == "Problem":
                names = [name_of(n.target) for n in owner.body if isinstance(n, ast.AnnAssign)]
        given = dict(zip(names, call.args)) | {k.arg: k.value for k in call.keywords}
        return given.get("message", call.args[0] if call.args else call.keywords[0].value)

    def has_remedy(self, text: ast.expr, scope: Scope, deep: int = 0) -> bool:
        if deep > DEEPEST:
            return False
        if REMEDY.search(literal(text)):
            return True

        def also(part: ast.expr) -> bool:
            return self.has_remedy(part, scope, deep + 1)

        match text:
            case ast.JoinedStr():
                return any(also(part.value) for part in text.values if isinstance(part, ast.FormattedValue))
            case ast.BinOp():
                return also(text.left) or also(text.right)
            case ast.IfExp():
                return also(text.body) and also(text.orelse)
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
            case ast.Name():
                return self._name(text.id, scope, deep)
            case ast.Attribute():
                found = [(e, s) for e, s in self.values.get(text.attr, ())] + self._answers(text.attr, scope)
                return bool(found) and all(self.has_remedy(e, s, deep + 1) for e, s in found)
            case ast.Call():
                return self._call(text, scope, deep)
        return False

    def _call(self, call: ast.Call, scope: Scope, deep: int) -> bool:
        name = name_of(call.func)
        if isinstance(call.func, ast.Attribute) and name in ("join", "replace", "format", "strip", "removeprefix", "partition"):
            parts = [call.func.value] if name != "join" else [call.func.value, *call.args]
            return any(self.has_remedy(part, scope, deep + 1) for part in parts)
        if name in ("str", "next", "tuple", "list") and call.args:
            return self.has_remedy(call.args[0], scope, deep + 1)
        found = self._answers(name, scope)
        if found and all(self.has_remedy(e, s, deep + 1) for e, s in found):
            return True
        return any(self.has_remedy(each, scope, deep + 1) for each in call.args) if found else False

    def _answers(self, name: str, scope: Scope) -> list[tuple[ast.expr, Scope]]:
        """What the functions of this name return: those of the same file, or else all."""
        every = self.functions.get(name, [])
        near = [each for each in every if each[1].path == scope.path] or every
        return [
            (node.value, Scope(around.path, (*around.functions, function), around.owner))
            for function, around in near
            for node in ast.walk(function)
            if isinstance(node, ast.Return | ast.Yield) and node.value is not None
            and not (isinstance(node.value, ast.Constant) and node.value.value in (None, ""))
        ]

    def _name(self, name: str, scope: Scope, deep: int) -> bool:
        for depth in range(len(scope.functions), 0, -1):
            function, inside = scope.functions[depth - 1], Scope(scope.path, scope.functions[:depth], scope.owner)
            ways = list(self._bindings(name, function, inside))
            if ways:
                return all(way(deep + 1) for way in ways)
        every = self.values.get(name, [])
        near = [each for each in every if each[1].path == scope.path] or every
        return bool(near) and all(self.has_remedy(e, s, deep + 1) for e, s in near)

    def _bindings(self, name: str, function: ast.FunctionDef, scope: Scope) -> Iterator[Callable[[int], bool]]:
        """For each way in which a name gets its value in a function: whether a remedy is in it."""
        given = [a.arg for a in (*function.args.posonlyargs, *function.args.args)]
        only = [a.arg for a in function.args.kwonlyargs]
        if name in given + only:
            yield lambda deep: self._handed(name, function, scope, deep)
        for node in ast.walk(function):
            if isinstance(node, ast.ExceptHandler) and node.name == name:
                kinds = node.type.elts if isinstance(node.type, ast.Tuple) else [node.type]
                told = all(kind is not None and name_of(kind) in self.errors for kind in kinds)
                yield lambda deep, told=told: told
            pairs: list[tuple[ast.expr, ast.expr]] = []
            if isinstance(node, ast.Assign):
                pairs = [(target, node.value) for target in node.targets]
            elif isinstance(node, ast.AnnAssign | ast.NamedExpr) and node.value is not None:
                pairs = [(node.target, node.value)]
            elif isinstance(node, ast.For | ast.comprehension):
                pairs = [(node.target, each) for each in elements(node.iter)]
            for target, value in pairs:
                part = part_of(target, value, name)
                if part is not None and not (isinstance(part, ast.Constant) and part.value in ("", None)):
                    yield lambda deep, part=part: self.has_remedy(part, scope, deep)

    def _handed(self, name: str, function: ast.FunctionDef, scope: Scope, deep: int) -> bool:
        """Whether every caller in the packages hands over a remedy."""
        made = function.name == "__init__" and scope.owner is not None
        every = self.calls.get(scope.owner.name if made else function.name, [])
        near = every
        if function.name.startswith("_") or len(self.functions[function.name]) > 1:
            near = [each for each in every if each[1].path == scope.path]
        found = []
        for call, around in near:
            arguments = [a.arg for a in (*function.args.posonlyargs, *function.args.args)]
            if arguments and arguments[0] in ("self", "cls"):
                arguments = arguments[1:]
            given = dict(zip(arguments, call.args)) | {k.arg: k.value for k in call.keywords}
            if name in given:
                found.append((given[name], around))
        return bool(found) and all(self.has_remedy(e, s, deep + 1) for e, s in found)


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


def elements(of: ast.expr) -> list[ast.expr]:
    """What a loop runs over, where it is written out; itself where it is not."""
    if isinstance(of, ast.Tuple | ast.List):
        return of.elts
    if isinstance(of, ast.Call) and name_of(of.func) == "items" and isinstance(of.func, ast.Attribute):
        if isinstance(of.func.value, ast.Dict):
            pairs = zip(of.func.value.keys, of.func.value.values)
            return [ast.Tuple([key, value]) for key, value in pairs if key is not None]
    return [of]


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
