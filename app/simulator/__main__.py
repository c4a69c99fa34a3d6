"""`python -m app.simulator`: starts simulated vehicles and runs them until SIGINT or SIGTERM."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import signal
import sys
from collections.abc import Coroutine, Sequence
from typing import TextIO

from app.simulator.fault_control import ControlServer, FaultControl
from app.simulator.fleet import Fleet
from app.simulator.options import MAX_LIVE_SPEED, Options, parse
from app.simulator.pace import PaceWatch


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 after a signal, 1 when a port is taken, 2 for a wrong command line."""
    options = parse(sys.argv[1:] if arguments is None else arguments)
    try:
        asyncio.run(serve(options, sys.stdout))
    except (OSError, ValueError) as error:  # ValueError: a key file that is none
        _write_line(sys.stderr, f"the simulator cannot start: {getattr(error, 'strerror', None) or error}")
        return 1
    return 0


async def serve(options: Options, out: TextIO) -> None:
    """Run the fleet; one line on `out` for each vehicle when all are ready. Raises OSError if a port is taken."""
    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stopped.set)
    fleet = Fleet(options)
    control = ControlServer(FaultControl(fleet))
    try:
        await fleet.open()
        if options.control_port is not None:
            port = await control.open(options.control_port)
            _write_line(out, f"control: 127.0.0.1:{port}")
        if options.speed > MAX_LIVE_SPEED:
            _write_line(out, _embedded_only(options.speed))
        for vehicle, (local, remote) in zip(fleet.vehicles, fleet.addresses(), strict=True):
            _write_line(out, f"ready: {vehicle.spec.airframe.name} system {vehicle.system_id} {local} -> {remote}")
        gc.freeze()  # the vehicles live as long as the process: the collector need not look at them again and again
        watch = PaceWatch(fleet.pace, lambda line: _write_line(sys.stderr, line))
        await _run_until(stopped, fleet.run(), watch.run())
    finally:
        await control.close()
        fleet.close()


async def _run_until(stopped: asyncio.Event, *works: Coroutine[None, None, None]) -> None:
    """Works run until they are cancelled: one that ends by itself is a fault to be seen."""
    running = [asyncio.create_task(work) for work in works]
    waiting = asyncio.create_task(stopped.wait())
    done, _ = await asyncio.wait((*running, waiting), return_when=asyncio.FIRST_COMPLETED)
    for task in {*running, waiting} - done:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
    for task in done:
        task.result()


def _embedded_only(speed: float) -> str:
    return (
        f"note: {speed:g}x is for embedded missions only. Supervised drops and OFFBOARD work up to "
        f"{MAX_LIVE_SPEED:g}x, as their timers on the ground are wall clock: the vehicles refuse OFFBOARD, "
        "and Waydrop refuses to start a supervised drop"
    )


def _write_line(out: TextIO, line: str) -> None:
    out.write(line + "\n")
    out.flush()


if __name__ == "__main__":
    sys.exit(main())
