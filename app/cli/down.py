"""`waydrop down`: end simulated vehicles that outlived their Waydrop."""

from __future__ import annotations

from app.cli.serve import DataDirOption
from app.cli.simulator_process import SimulatorProcess
from app.cli.terminal import err
from app.config import load_settings


def down(data_dir: DataDirOption = None) -> None:
    """End the simulated vehicles that `waydrop up` started, after a Waydrop that died without Ctrl-C."""
    settings = load_settings(data_dir=data_dir)
    stopped = SimulatorProcess(settings.data_dir).stop()
    err().print("simulated vehicles ended" if stopped else "no simulated vehicles run")
