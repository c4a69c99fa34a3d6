"""Which part of app/ may import which, and who alone may import what from outside."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

from tests.architecture.sources import Source

ALLOWED: dict[str, frozenset[str]] = {
    "domain": frozenset(),
    "interchange": frozenset({"domain"}),
    "services": frozenset({"domain"}),
    "vehicles": frozenset({"domain"}),
    "storage": frozenset({"domain"}),
    "webhooks": frozenset({"domain"}),
    "api": frozenset({"services", "interchange", "domain"}),
    "simulator": frozenset(),
    "cli": frozenset({"services", "interchange", "domain", "config", "logs", "application"}),
    "config": frozenset({"domain"}),
    "logs": frozenset({"config"}),
    "file_limit": frozenset({"config"}),
    "application": frozenset({"domain", "services", "vehicles", "storage", "webhooks", "api", "config", "file_limit"}),
    "__main__": frozenset({"cli"}),
}
"""A layer may always import itself. `__init__` files right in app/ import nothing."""

EXCLUSIVE: dict[str, frozenset[str]] = {
    "mavsdk": frozenset({"vehicles"}),
    "pymavlink": frozenset({"simulator"}),
    "sqlalchemy": frozenset({"storage"}),
    "alembic": frozenset({"storage"}),
    "aiosqlite": frozenset({"storage"}),
    "sqlite3": frozenset({"storage"}),
    "aiohttp": frozenset({"api", "cli", "webhooks"}),
    "typer": frozenset({"cli"}),
    "rich": frozenset({"cli"}),
    "pydantic_settings": frozenset({"config"}),
}

PURE = frozenset({"domain", "interchange"})
PURE_MUST_NOT = frozenset(
    {"asyncio", "concurrent", "http", "logging", "multiprocessing", "os", "pathlib", "selectors", "shutil", "signal"}
    | {"socket", "sqlite3", "ssl", "structlog", "subprocess", "tempfile", "threading", "time", "urllib"}
)
"""Pure means: the same input, the same answer. I/O, clocks and tasks are given to it, never taken."""


def imported(source: Source) -> Iterator[tuple[ast.stmt, str]]:
    """Every module that a file imports, anywhere in it, with the statement. Relative ones are made absolute."""
    for node in source.nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                keep = source.module.split(".")
                drop = node.level - 1 if source.path.endswith("__init__.py") else node.level
                base = ".".join([*keep[: len(keep) - drop], *([base] if base else [])])
            yield node, base
            for alias in node.names:
                yield node, f"{base}.{alias.name}"


def layer_of(module: str) -> str:
    """`domain` for `app.domain.plan`; empty for what is not ours."""
    parts = module.split(".")
    return parts[1] if parts[0] == "app" and len(parts) > 1 else ""


def wrong_directions(sources: Iterable[Source]) -> list[str]:
    """Imports of ours against the direction."""
    found = []
    for source in sources:
        layer = source.layer
        allowed = ALLOWED.get(layer, frozenset()) | {layer}
        for node, module in imported(source):
            target = layer_of(module)
            if target in ALLOWED and target not in allowed:
                may = ", ".join(sorted(allowed - {layer})) or "nothing of ours"
                found.append(f"{source.at(node)}: {layer or 'app'} imports app.{target}; it may import {may}")
    return sorted(set(found))


def unknown_layers(sources: Iterable[Source]) -> list[str]:
    """Files of app/ in no layer that the design names."""
    return [
        f"{source.path}:1: app/{source.layer} is no part of the design: put it where it fits"
        for source in sources
        if source.layer and source.layer not in ALLOWED
    ]


def shared_exclusives(sources: Iterable[Source]) -> list[str]:
    """Imports of a library outside the one layer that may know it."""
    found = []
    for source in sources:
        for node, module in imported(source):
            owners = EXCLUSIVE.get(module.split(".")[0])
            if owners is not None and source.layer not in owners:
                found.append(
                    f"{source.at(node)}: {module.split('.')[0]} belongs to {' and '.join(sorted(owners))} alone"
                )
    return sorted(set(found))


def servers_outside_api(sources: Iterable[Source]) -> list[str]:
    """Uses of aiohttp's server outside api/: the cli and webhooks/ are clients only."""
    found = []
    for source in sources:
        if source.layer == "api":
            continue
        for node, module in imported(source):
            if module == "aiohttp.web" or module.startswith("aiohttp.web."):
                found.append(f"{source.at(node)}: aiohttp.web belongs to api alone")
        for node in source.nodes:
            if isinstance(node, ast.Attribute) and ast.unparse(node) == "aiohttp.web":
                found.append(f"{source.at(node)}: aiohttp.web belongs to api alone")
    return sorted(set(found))


def words_inside(sources: Iterable[Source]) -> list[str]:
    """Reasons turned into sentences anywhere but where people read them: inside, their codes are compared."""
    edges = {"api", "cli"}
    told_in_errors = {"app.domain.reasons", "app.domain.drop.consent", "app.services.offboard.control"}
    return [
        f"{source.at(node)}: in_words is for what people read; compare the code"
        for source in sources
        if source.layer not in edges and source.module not in told_in_errors
        for node in source.nodes
        if isinstance(node, ast.ImportFrom) and node.module == "app.domain.reasons"
        if any(name.name == "in_words" for name in node.names)
    ]


def impure_parts(sources: Iterable[Source]) -> list[str]:
    """Imports of I/O, clocks and tasks in the pure parts."""
    return sorted(
        {
            f"{source.at(node)}: {source.layer} is pure; it must not import {module.split('.')[0]}"
            for source in sources
            if source.layer in PURE
            for node, module in imported(source)
            if module.split(".")[0] in PURE_MUST_NOT
        }
    )
