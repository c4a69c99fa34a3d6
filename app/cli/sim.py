"""`waydrop sim`: the simulated vehicles alone, in this terminal, or their comparison with recordings of a real PX4."""

from __future__ import annotations

import os
import sys

import typer

from app.cli.simulator_process import INSTALLED

COMPARE = "compare"


def sim(context: typer.Context) -> None:
    """Simulated vehicles that speak MAVLink over UDP. All options go to it: `waydrop sim --help`.

    `waydrop sim compare FOLDER` measures how faithful they are to recordings of a real PX4.
    """
    module, arguments = "app.simulator", context.args
    if arguments[:1] == [COMPARE]:
        module, arguments = f"{module}.{COMPARE}", arguments[1:]
    os.execv(sys.executable, [sys.executable, *INSTALLED, module, *arguments])
