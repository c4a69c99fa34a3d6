"""The rows of `make bench`, by name. Each is measured in a process that imports its module alone."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Final

from bench.row import Row

MODULES: Final[Mapping[str, str]] = {
    "plan": "plan",
    "fanout-1": "fanout",
    "fanout-10": "fanout",
    "fanout-100": "fanout",
    "journal-1": "journal",
    "journal-16": "journal",
    "journal-256": "journal",
    "setpoints": "setpoints",
    "setpoints-busy": "setpoints",
    "upload-10": "upload",
    "upload-100": "upload",
    "upload-500": "upload",
    "upload-loss": "upload",
    "telemetry": "guard",
    "guard": "guard",
    "help": "start",
    "health": "start",
    "start": "start",
    "memory": "memory",
    "memory-socket": "memory",
    "memory-vehicle": "memory",
    "vehicles-known": "vehicles",
    "vehicles-cpu": "vehicles",
}
"""In the order of the table."""

CHEAPEST: Final = ("plan", "fanout-1", "help")
"""Measured against the commit before, in CI."""


def row_of(name: str) -> Row:
    """Imports its module. Raises KeyError."""
    rows: tuple[Row, ...] = import_module(f"bench.rows.{MODULES[name]}").ROWS
    return next(row for row in rows if row.name == name)
