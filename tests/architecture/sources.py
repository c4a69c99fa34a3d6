"""The repository's files as the laws see them: parsed once, with their module names."""

from __future__ import annotations

import ast
import functools
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NOT_OURS = {"__pycache__", "node_modules", "generated", "dist"}


@dataclass(frozen=True)
class Source:
    """One Python file. `path` is relative to the repository, `module` its dotted name."""

    path: str
    module: str
    text: str

    @functools.cached_property
    def tree(self) -> ast.Module:
        """The syntax tree."""
        return ast.parse(self.text, filename=self.path)

    @functools.cached_property
    def nodes(self) -> tuple[ast.AST, ...]:
        """All of the tree: each law looks at every node."""
        return tuple(ast.walk(self.tree))

    @property
    def layer(self) -> str:
        """The folder below app/ (or the file's own name right in app/); empty outside app/."""
        parts = self.module.split(".")
        return parts[1] if parts[0] == "app" and len(parts) > 1 else ""

    def at(self, node: ast.AST) -> str:
        """`file:line` of a node."""
        return f"{self.path}:{getattr(node, 'lineno', 1)}"


def source(path: str, text: str) -> Source:
    """A source by its path; the self-tests of the laws make theirs so."""
    parts = list(Path(path).with_suffix("").parts)
    if parts[-1] == "__init__":
        parts.pop()
    return Source(path=path, module=".".join(parts), text=text)


def python_sources(*folders: str) -> tuple[Source, ...]:
    """All Python files under the folders that somebody wrote by hand."""
    return tuple(map(_of_file, files(".py", *folders)))


@functools.cache
def _of_file(path: str) -> Source:
    return source(path, (ROOT / path).read_text(encoding="utf-8"))


def files(suffix: str, *folders: str) -> tuple[str, ...]:
    """Paths of all hand-written files with this suffix under the folders, sorted."""
    found = (path.relative_to(ROOT) for folder in folders for path in (ROOT / folder).rglob(f"*{suffix}"))
    return tuple(sorted(str(path) for path in found if not NOT_OURS.intersection(path.parts)))
