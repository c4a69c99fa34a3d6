"""Who handles events handles each kind, by name: mypy's exhaustive-match then fails for a kind that is forgotten."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

from app.domain.events import PAYLOADS
from tests.architecture.sources import Source

NAMES = frozenset(payload.__name__ for payload in PAYLOADS.values())


def wildcards(sources: Iterable[Source]) -> list[str]:
    """A match on payloads with `case _`: it would swallow a kind that is new."""
    return [
        f"{source.at(case.pattern)}: `case _` swallows kinds of events; name those that are left out"
        for source in sources
        if source.path.startswith("app/")
        for node in source.nodes
        if isinstance(node, ast.Match) and NAMES.intersection(_classes(node))
        for case in node.cases
        if isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None
    ]


def _classes(match: ast.Match) -> Iterator[str]:
    for part in ast.walk(match):
        if isinstance(part, ast.MatchClass):
            yield ast.unparse(part.cls).rsplit(".", maxsplit=1)[-1]
