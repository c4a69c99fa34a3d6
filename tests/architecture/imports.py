"""Which part of app/ may import which, and who alone may import what from outside."""

from __future__ import annotations

import ast
import graphlib
from collections.abc import Iterable, Iterator
from pathlib import PurePath

from tests.architecture.sources import Source
from tools import architecture

ALLOWED: dict[str, frozenset[str]] = {
    "domain": frozenset(),
    "interchange": frozenset({"domain"}),
    "services": frozenset({"domain"}),
    "vehicles": frozenset({"domain"}),
    "storage": frozenset({"domain"}),
    "webhooks": frozenset({"domain"}),
    "cluster": frozenset({"domain"}),
    "api": frozenset({"services", "interchange", "domain"}),
    "simulator": frozenset(),
    "cli": frozenset(
        {
            "services",
            "interchange",
            "domain",
            "config",
            "logs",
            "application",
            "cluster_application",
            "data_folder",
        }
    ),
    "config": frozenset({"domain"}),
    "logs": frozenset({"config", "domain"}),
    "file_limit": frozenset({"config"}),
    "data_folder": frozenset({"config"}),
    "application": frozenset(
        {"domain", "services", "vehicles", "storage", "webhooks", "api", "config", "file_limit", "data_folder"}
    ),
    "cluster_application": frozenset(
        {"domain", "services", "storage", "cluster", "api", "application", "config", "file_limit", "data_folder"}
    ),
    "__main__": frozenset({"cli"}),
}
"""A layer may always import itself. `__init__` files right in app/ import nothing."""

EXCLUSIVE: dict[str, frozenset[str]] = {
    "mavsdk": frozenset({"vehicles"}),
    "pymavlink": frozenset({"simulator"}),
    "sqlalchemy": frozenset({"storage"}),
    "alembic": frozenset({"storage"}),
    "sqlite3": frozenset({"storage"}),
    "asyncpg": frozenset({"storage"}),
    "nats": frozenset({"cluster"}),
    "cryptography": frozenset({"storage", "cluster"}),
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
        f"{source.at(node)}: describe is for what people read; compare the code"
        for source in sources
        if source.layer not in edges and source.module not in told_in_errors
        for node in source.nodes
        if isinstance(node, ast.ImportFrom) and node.module == "app.domain.reasons"
        if any(name.name == "describe" for name in node.names)
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


def import_cycles(sources: Iterable[Source]) -> list[str]:
    """Modules that import each other at import time, packages on the way included. The first cycle that is found."""
    by_module = {source.module: source for source in sources}
    graph = {module: set(_imported_first(source, by_module)) - {module} for module, source in by_module.items()}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return [f"{by_module[error.args[1][0]].path}:1: modules import each other: {' <- '.join(error.args[1])}"]
    return []


def _imported_first(source: Source, by_module: dict[str, Source]) -> Iterator[str]:
    for node in _at_import_time(source.tree.body):
        for module in _modules_of(node, by_module):
            parts = module.split(".")
            packages = (".".join(parts[:length]) for length in range(2, len(parts)))
            yield module
            yield from (name for name in packages if name in by_module and not source.module.startswith(f"{name}."))


def _modules_of(node: ast.stmt, by_module: dict[str, Source]) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in by_module)
    elif isinstance(node, ast.ImportFrom) and node.module:
        names = {f"{node.module}.{alias.name}" for alias in node.names}
        yield from names & by_module.keys()
        if names - by_module.keys() and node.module in by_module:
            yield node.module


def _at_import_time(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If) and ast.unparse(node.test) != "TYPE_CHECKING":
            yield from _at_import_time(node.body)


def tests_imported(sources: Iterable[Source]) -> list[str]:
    """Imports of a test module: what two tests share lives in tests/support."""
    return sorted(
        {
            f"{source.at(node)}: imports {module}; move what is shared to tests/support"
            for source in sources
            for node, module in imported(source)
            if module.startswith("tests.") and any(part.startswith("test_") for part in module.split(".")[:-1])
        }
    )


def tests_outside_packages(sources: Iterable[Source], packages: Iterable[Source]) -> list[str]:
    """Unit tests in a folder that mirrors no folder of app/ or tools/: a test is found by the path of what it tests."""
    folders = {str(PurePath(package.path).parent) for package in packages}
    return [
        f"{source.path}:1: no {mirrored}/ in the code; move the test to the folder of what it tests"
        for source in sources
        if source.path.startswith("tests/unit/") and PurePath(source.path).name.startswith("test_")
        if (mirrored := _mirrored(source.path)) not in folders
    ]


def _mirrored(path: str) -> str:
    inside = PurePath(path).parent.relative_to("tests/unit")
    return str(inside) if inside.parts[:1] == ("tools",) else str("app" / inside)


def package_cycles(graph: architecture.ImportGraph) -> list[str]:
    """Folders of domain/ that can reach each other by imports."""
    within = {
        package: frozenset(to for to in targets if to.startswith("domain."))
        for package, targets in graph.items()
        if package.startswith("domain.")
    }
    return [
        f"{' and '.join(group)} import each other; move what both need into one of them"
        for group in architecture.import_cycles(within)
    ]
