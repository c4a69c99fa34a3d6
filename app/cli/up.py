"""`waydrop up` and `waydrop down`: Waydrop and four simulated vehicles in a process that outlives Waydrop."""

from __future__ import annotations

import asyncio
import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from app.cli.loading import loaded_for_good
from app.cli.serve import DataDirOption, HostOption, PortOption
from app.cli.service_client import DEFAULT_SERVER
from app.cli.simulator_process import FLEET, PERFORMANCE, SimulatedFleet, SimulatorProcess
from app.cli.terminal import err
from app.config import Settings, load_settings
from app.data_folder import PRIVATE_UMASK
from app.domain.vehicle.clock import MAX_LIVE_RATE
from app.domain.vehicle.state import VehicleType
from app.logs import configure_logs

READY_S = 30.0
SPEED_HELP = (
    f"Simulation speed as a multiple of real time. Above {MAX_LIVE_RATE:g} plans with supervised drops are refused."
)
EXAMPLE_PLAN = Path(__file__).resolve().parents[2] / "plans" / "clinic-run.json"


def up(
    host: HostOption = None,
    port: PortOption = None,
    data_dir: DataDirOption = None,
    speed: Annotated[float, typer.Option(min=1.0, max=50.0, help=SPEED_HELP)] = 1.0,
    seed: Annotated[int, typer.Option(help="Random seed of the simulated vehicles.")] = 0,
) -> None:
    """Start Waydrop with simulated vehicles. Ctrl-C stops both.

    If Waydrop dies otherwise, the vehicles fly on; the next `waydrop up` finds them again.
    """
    settings = load_settings(host=host, port=port, data_dir=data_dir)
    configure_logs(settings)
    os.umask(PRIVATE_UMASK)
    fleet = SimulatedFleet.for_connections(settings.connections, speed=speed, seed=seed)
    simulator = SimulatorProcess(settings.data_dir)
    owns_vehicles = _start_vehicles(simulator, fleet)
    declared = settings.vehicle_performance or dict.fromkeys(map(str, VehicleType), PERFORMANCE)
    settings = settings.model_copy(update={"simulator_control": simulator.control(), "vehicle_performance": declared})
    session = _Session(settings, owns_vehicles=owns_vehicles)
    try:
        asyncio.run(session.serve())
    except KeyboardInterrupt:
        pass
    finally:
        if session.owns_vehicles:
            simulator.stop()
    err().print(f"Waydrop and its simulated vehicles have stopped; the journal is in {settings.data_dir}", markup=False)


def _start_vehicles(simulator: SimulatorProcess, fleet: SimulatedFleet) -> bool:
    """Whether they were started now; otherwise they are running already."""
    running = simulator.find()
    if running is not None:
        same = running.arguments == fleet.arguments()
        other = "" if same else f", with other options ({' '.join(running.arguments)}); `waydrop down` stops them"
        err().print(f"[yellow]simulated vehicles are already running[/] (process {running.pid}){escape(other)}")
        simulator.wait_ready(len(FLEET), within_s=READY_S)  # its starter may have died before it was
        return False
    running = simulator.start(fleet.arguments())
    simulator.wait_ready(len(FLEET), within_s=READY_S)
    err().print(f"simulated vehicles: process {running.pid}, {fleet.words()}")
    return True


class _Session:
    """Vehicles that were found belong to us only once we serve: until then another Waydrop may be using them."""

    def __init__(self, settings: Settings, *, owns_vehicles: bool) -> None:
        self.owns_vehicles = owns_vehicles
        self._settings = settings

    async def serve(self) -> None:
        """Serve until a signal."""
        with loaded_for_good():
            from app.application import serve as serve_application  # here: other commands do not wait for mavsdk

        await serve_application(self._settings, on_ready=self._greet)

    def _greet(self, url: str) -> None:
        self.owns_vehicles = True
        flag = "" if url == DEFAULT_SERVER else f" --server {url}"
        program, plan = _shortest(Path(sys.argv[0])), _shortest(EXAMPLE_PLAN)
        console = err()
        console.print(f"\n[bold green]Waydrop is up:[/] {url}  (journal in {escape(str(self._settings.data_dir))})")
        console.print("Try next, in another terminal:")
        for command in (f"validate {plan}", f"vehicles{flag}", f"fly {plan} --vehicle v1{flag}"):
            console.print(f"  [bold]{escape(program)} {escape(command)}[/]")
        console.print("Ctrl-C stops Waydrop and all simulated vehicles, including those in flight.\n")


def _shortest(path: Path) -> str:
    """As one would type it here."""
    full = path.resolve() if path.exists() else path
    here = Path.cwd()
    return str(full.relative_to(here)) if full.is_relative_to(here) else str(path)


def down(data_dir: DataDirOption = None) -> None:
    """Stop simulated vehicles that `waydrop up` started and that outlived it."""
    settings = load_settings(data_dir=data_dir)
    stopped = SimulatorProcess(settings.data_dir).stop()
    err().print("simulated vehicles ended" if stopped else "no simulated vehicles are running")
