"""Who may touch what is inside an object: its own class, and no test."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterable, Iterator

from tests.architecture.sources import Source

STATEFUL = ("services", "domain", "vehicles", "storage", "webhooks")
"""Where objects live as long as a vehicle, a run or a link. A parser fills in drafts, and a widget its parts."""
OUR_OWN = {"self", "cls"}
ENUM_VALUE = "_value_"
"""How an enumeration with parameters gives its members their value."""
FOREIGN_LIBRARIES = {
    "app/storage/verify.py": {"row_factory", "text_factory"},  # how sqlite3 is told its row type
}


def foreign_writes(sources: Iterable[Source]) -> list[str]:
    """Attributes that are written from outside. A record that one module has for itself may be filled in there."""
    return [
        f"{source.at(target)}: {ast.unparse(target)} belongs to another object; call a method of it"
        for source in sources
        if source.layer in STATEFUL
        for target in _written(source)
        if not (isinstance(target.value, ast.Name) and target.value.id in OUR_OWN)
        and target.attr not in _declared(source) | {ENUM_VALUE}
        and target.attr not in FOREIGN_LIBRARIES.get(source.path, ())
    ]


def private_uses(sources: Iterable[Source], own: frozenset[str]) -> list[str]:
    """Private attributes of `own` (all those of app/) that a test reaches into, those of its own classes aside."""
    return [
        f"{source.at(node)}: {ast.unparse(node)} is private; test what others can see of it"
        for source in sources
        for node in source.nodes
        if isinstance(node, ast.Attribute)
        and is_private(node.attr)
        and node.attr in own
        and not (isinstance(node.value, ast.Name) and node.value.id in OUR_OWN)
        and node.attr not in _declared(source)
    ]


def private_names(sources: Iterable[Source]) -> frozenset[str]:
    """All private attributes and methods of the classes of these files."""
    return frozenset(name for source in sources for name in _declared(source) if is_private(name))


def is_private(name: str) -> bool:
    """`_x`, and not `__x__`."""
    return name.startswith("_") and not name.endswith("__")


@functools.cache
def _declared(source: Source) -> frozenset[str]:
    """The attributes and methods of the classes of one file."""
    names = {
        target.attr for target in _written(source) if isinstance(target.value, ast.Name) and target.value.id in OUR_OWN
    }
    for node in source.nodes:
        if not isinstance(node, ast.ClassDef):
            continue
        for statement in node.body:
            if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
                names.add(statement.target.id)
            elif isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
                names.add(statement.name)
            elif isinstance(statement, ast.Assign):
                names.update(target.id for target in statement.targets if isinstance(target, ast.Name))
                names.update(_slots(statement))
    return frozenset(names)


def _slots(statement: ast.Assign) -> Iterator[str]:
    if any(isinstance(target, ast.Name) and target.id == "__slots__" for target in statement.targets):
        yield from (node.value for node in ast.walk(statement.value) if isinstance(node, ast.Constant))


def _written(source: Source) -> Iterator[ast.Attribute]:
    for node in source.nodes:
        match node:
            case ast.Assign():
                targets = node.targets
            case ast.AugAssign() | ast.AnnAssign():
                targets = [node.target]
            case ast.Delete():
                targets = node.targets
            case ast.For() | ast.AsyncFor():
                targets = [node.target]
            case ast.With() | ast.AsyncWith():
                targets = [item.optional_vars for item in node.items if item.optional_vars is not None]
            case _:
                continue
        for target in targets:
            yield from (part for part in _parts(target) if isinstance(part, ast.Attribute))


def _parts(target: ast.expr) -> Iterator[ast.expr]:
    if isinstance(target, ast.Tuple | ast.List):
        for element in target.elts:
            yield from _parts(element)
    elif isinstance(target, ast.Starred):
        yield from _parts(target.value)
    else:
        yield target
