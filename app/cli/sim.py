"""`waydrop sim`: the simulated vehicles alone, in this terminal."""

from __future__ import annotations

import os
import sys

import typer

from app.cli.simulator_process import INSTALLED


def sim(context: typer.Context) -> None:
    """Start simulated vehicles that speak MAVLink over UDP. For its options: `waydrop sim --help`."""
    os.execv(sys.executable, [sys.executable, *INSTALLED, "app.simulator", *context.args])
