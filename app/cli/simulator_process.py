"""The simulated vehicles as a process of their own: started once, found again, ended. It outlives us."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from app.config import SettingsError
from app.data_folder import claim_data_folder
from app.domain.autopilot import autopilot
from app.domain.errors import WaydropError
from app.domain.vehicle.clock import MAX_LIVE_RATE
from app.domain.vehicle.performance import Performance

FLEET: Final = ("quad", "quad", "plane", "vtol")
LOCAL_PORT_OFFSET: Final = 40
"""As PX4 does: it sends from 14580 to 14540."""
PERFORMANCE: Final = Performance(payload_max_kg=2.0, battery_percent_per_min=4.0)
"""The declared performance of each, if nothing else is declared: full to empty in 25 minutes in any phase."""

_LOCAL = re.compile(r"^udpin://(127\.0\.0\.1|0\.0\.0\.0):(?P<port>\d+)$")


@dataclass(frozen=True, slots=True)
class SimulatedFleet:
    """The vehicles of `waydrop up`, on ports that fit the connections."""

    port: int
    shared_port: bool
    speed: float
    seed: int

    @classmethod
    def for_connections(cls, connections: Sequence[str], *, speed: float, seed: int) -> SimulatedFleet:
        """The fleet on one port for all, or on one port each.

        Raises:
            SettingsError: the connections are not UDP ports of this machine in a row.
        """
        found = [_LOCAL.match(url) for url in connections]
        ports = [int(match["port"]) for match in found if match is not None]
        rising = [*range(ports[0], ports[0] + len(FLEET))] if ports else []
        if len(ports) != len(connections) or ports not in (rising, ports[:1]):
            raise SettingsError(
                f"WAYDROP_CONNECTIONS: {len(FLEET)} simulated vehicles cannot reach {', '.join(connections)}",
                hint=f"use one udpin:// port of this machine, or {len(FLEET)} consecutive ones: "
                "udpin://127.0.0.1:14540..14543; for other vehicles use `waydrop serve`",
            )
        return cls(port=ports[0], shared_port=len(ports) == 1, speed=speed, seed=seed)

    def arguments(self) -> tuple[str, ...]:
        """The simulator's command line."""
        shared = ("--shared-port",) if self.shared_port else ()
        return (
            *("--fleet", ",".join(FLEET), "--port", str(self.port), "--local-port", str(self.port + LOCAL_PORT_OFFSET)),
            *("--speed", f"{self.speed:g}", "--seed", str(self.seed)),
            # nobody holds sticks here: a lost offboard stream leads to Hold, and a critical battery to a return
            *("--params", ",".join(f"{name}={value}" for name, value in autopilot().unattended.items())),
            *("--control-port", "0"),  # any free one: the simulator prints it, see SimulatorProcess.control
            *shared,
        )

    def words(self) -> str:
        ports = f"port {self.port}" if self.shared_port else f"ports {self.port} to {self.port + len(FLEET) - 1}"
        live = f" (above {MAX_LIVE_RATE:g} times, supervised drops and OFFBOARD are refused)"
        pace = f"{self.speed:g} times real time{live if self.speed > MAX_LIVE_RATE else ''}"
        return f"two multicopters, one fixed wing, one VTOL on UDP {ports}, {pace}"


# The simulated vehicles as a process of their own: started once, found again, ended. It outlives us.
#
# The process holds an flock(2) on a file in the data folder: the kernel drops it when the process dies, however it
# dies, so "is it running" never rests on a stale number.


LOCK_NAME: Final = "simulator.lock"
LOG_NAME: Final = "simulator.log"
READY: Final = b"ready: "
"""The simulator writes a line with it for each vehicle."""
INSTALLED: Final = ("-P", "-m")
"""A module of this installation: never one of a folder named app where the command was typed."""
PORT_TAKEN: Final = 1
"""The exit status of a simulator that could not bind a port."""
ELSEWHERE: Final = (
    "another Waydrop or PX4 uses these ports: stop it, or use others, "
    "such as WAYDROP_CONNECTIONS=udpin://127.0.0.1:14640..14643"
)
CONTROL: Final = re.compile(r"^control: (127\.0\.0\.1:\d+)$", re.MULTILINE)
"""It writes this line before, if it was started with a control port."""
POLL_S: Final = 0.02
REAP_S: Final = 1.0


class SimulatorError(WaydropError, code="simulator.failed"):
    """The simulated vehicles could not be started."""


@dataclass(frozen=True, slots=True)
class RunningSimulator:
    """A simulator process and its options."""

    pid: int
    arguments: tuple[str, ...]


class SimulatorProcess:
    """The simulator of one data folder."""

    def __init__(self, data_dir: Path) -> None:
        self._lock = data_dir / LOCK_NAME
        self.log = data_dir / LOG_NAME
        self._child: subprocess.Popen[bytes] | None = None

    def find(self) -> RunningSimulator | None:
        """The running process, started by anybody. Raises SimulatorError."""
        try:
            handle = os.open(self._lock, os.O_RDWR | os.O_CLOEXEC)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._not_usable(error) from error
        with _closing(handle):
            if _try_lock(handle):
                return None
            return _read(handle)

    def start(self, arguments: Sequence[str]) -> RunningSimulator:
        """Start it in a session of its own: neither our Ctrl-C nor our death reaches it.

        Raises:
            SimulatorError: one runs already, or the folder cannot be written.
        """
        claim_data_folder(self._lock.parent)
        try:
            handle = os.open(self._lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise self._not_usable(error) from error
        with _closing(handle), self.log.open("wb") as log:
            if not _try_lock(handle):
                raise SimulatorError("the simulated vehicles are already running", hint="stop them with `waydrop down`")
            self._reap()
            self._child = subprocess.Popen(
                [sys.executable, *INSTALLED, "app.simulator", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=(handle,),  # the child inherits the lock and keeps it when we close ours
            )
            running = RunningSimulator(self._child.pid, tuple(arguments))
            _write(handle, running)
        return running

    def _not_usable(self, error: OSError) -> SimulatorError:
        return SimulatorError(
            f"cannot write {self._lock}: {error.strerror or error}",
            hint="give your user write access, or use another data folder",
        )

    def wait_ready(self, vehicles: int, *, within_s: float) -> None:
        """Wait until each vehicle has said that it is ready. Raises SimulatorError with the end of the log if not."""
        deadline = time.monotonic() + within_s
        while self.log.read_bytes().count(READY) < vehicles:
            ended = self.find() is None
            if ended or time.monotonic() >= deadline:
                what = "ended at once" if ended else f"are not ready after {within_s:.0f} s"
                taken = self._exit_status() == PORT_TAKEN
                hint = ELSEWHERE if taken else f"see {self.log}"
                raise SimulatorError(f"the simulated vehicles {what}\n{self._last_lines()}", hint=hint)
            time.sleep(POLL_S)

    def control(self) -> str | None:
        """The address of its control socket, once it is ready; None if it has none."""
        said = CONTROL.search(self.log.read_text(errors="replace"))
        return None if said is None else said[1]

    def stop(self, *, within_s: float = 1.0) -> bool:
        """End it; False if none runs. One that does not end in time is killed: it has nothing to save."""
        stopped = self._stop(within_s)
        self._reap()
        return stopped

    def _stop(self, within_s: float) -> bool:
        for signal_number in (signal.SIGTERM, signal.SIGKILL):
            running = self.find()
            if running is None:
                return signal_number is signal.SIGKILL
            with contextlib.suppress(ProcessLookupError):
                os.kill(running.pid, signal_number)
            if self._gone(within_s):
                return True
        return True

    def _gone(self, within_s: float) -> bool:
        deadline = time.monotonic() + within_s
        while self.find() is not None:
            if time.monotonic() >= deadline:
                return False
            time.sleep(POLL_S)
        return True

    def _exit_status(self) -> int | None:
        """Of our own child, which has ended or ends now: its lock is dropped a moment before it can be waited for."""
        if self._child is None:
            return None
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._child.wait(REAP_S)
        return None

    def _reap(self) -> None:
        """End our own child, so that no zombie stays. It is found here too when somebody has removed the lock file."""
        child, self._child = self._child, None
        if child is None:
            return
        for end in (child.terminate, child.kill):
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(REAP_S)
                return
            end()
        child.wait()

    def _last_lines(self) -> str:
        with contextlib.suppress(OSError):
            return "\n".join(self.log.read_text(errors="replace").splitlines()[-8:])
        return ""


@contextlib.contextmanager
def _closing(handle: int) -> Iterator[None]:
    try:
        yield
    finally:
        os.close(handle)


def _try_lock(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _read(handle: int) -> RunningSimulator:
    document = json.loads(os.pread(handle, 65536, 0))
    return RunningSimulator(int(document["pid"]), tuple(document["arguments"]))


def _write(handle: int, running: RunningSimulator) -> None:
    os.ftruncate(handle, 0)
    os.pwrite(handle, json.dumps(asdict(running)).encode(), 0)
