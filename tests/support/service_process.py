"""The real service in a process of its own, for tests that use it as its users do: over sockets, with signals."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import aiohttp

from tests.support.paths import ROOT
from tests.support.patience import Patience
from tests.support.signed_links import service_environment
from tests.support.simulated import free_ports

START_S = 180.0
STOP_S = 30.0
"""It ends a hang: a busy machine may take ten seconds to end a process with five links."""


def free_tcp_port() -> int:
    """A TCP port that nothing listens on, and that no process of tests was given: seconds pass until it is used."""
    return free_ports(1, socket.SOCK_STREAM)


def connects(port: int) -> bool:
    """Whether something listens on a port."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


class Running(Protocol):
    """What is asked of the service's process."""

    @property
    def pid(self) -> int: ...

    @property
    def returncode(self) -> int | Any: ...

    def poll(self) -> int | None: ...

    def wait(self, timeout: float | None = None) -> int: ...


class ServiceProcess:
    """`waydrop serve` on a free port. Start it again after a kill: the journal and the port stay.

    `part` is another command, of a part of a cluster.
    """

    def __init__(
        self,
        data_dir: Path,
        connections: Sequence[str],
        *,
        part: str = "serve",
        port: int | None = None,
        **environment: str,
    ) -> None:
        self.data_dir = data_dir
        self.connections = tuple(connections)
        self.part = part
        self.port = free_tcp_port() if port is None else port
        self.log_path = data_dir / "service.log"
        self._environment = environment
        self._process: Running | None = None

    def set(self, **environment: str) -> None:
        """Set more variables, for the next start."""
        self._environment |= environment

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def pid(self) -> int:
        assert self._process is not None, "the service is not started"
        return self._process.pid

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._process is not None and self._process.poll() is None:
            self.stop()

    def start(self) -> None:
        """Start, and wait until it answers."""
        self.data_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
        environment = {
            **os.environ,
            "WAYDROP_PORT": str(self.port),
            "WAYDROP_DATA_DIR": str(self.data_dir),
            **({"WAYDROP_CONNECTIONS": ",".join(self.connections)} if self.connections else {}),
            "WAYDROP_LOG_FORMAT": "json",
            **service_environment(),
            **self._environment,
        }
        self._process = self._spawn(environment)
        self._wait_listening()

    def stop(self) -> float:
        """Ctrl-C. Returns the seconds it took; fails if it has to be killed."""
        began_s = time.monotonic()
        self._signal(signal.SIGINT)
        assert self._process is not None
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f"the service did not end within {STOP_S} s of Ctrl-C:\n{self.log()}") from None
        return time.monotonic() - began_s

    def kill(self) -> None:
        """kill -9."""
        self._signal(signal.SIGKILL)
        assert self._process is not None
        self._process.wait(STOP_S)

    def log(self) -> str:
        """What it wrote so far, the end of it."""
        return self.log_path.read_text(errors="replace")[-6000:]

    def _spawn(self, environment: Mapping[str, str]) -> Running:
        with self.log_path.open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "app", self.part], cwd=ROOT, env=environment, stdout=log, stderr=log
            )

    def _signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def _wait_listening(self) -> None:
        deadline_s = time.monotonic() + START_S
        while time.monotonic() < deadline_s:
            assert self._process is not None
            if self._process.poll() is not None:
                raise AssertionError(f"the service ended with {self._process.returncode}:\n{self.log()}")
            if connects(self.port):
                return
            time.sleep(0.05)
        self.kill()
        raise AssertionError(f"the service did not listen within {START_S} s:\n{self.log()}")


class Dispatcher:
    """A dispatch system: speaks REST to the service."""

    def __init__(self, session: aiohttp.ClientSession, url: str) -> None:
        self._session = session
        self._url = f"{url}/api/v1"

    async def get(self, path: str) -> Any:
        async with self._session.get(self._url + path) as answer:
            assert answer.status == 200, f"GET {path}: {answer.status} {await answer.text()}"
            return await answer.json()

    async def text(self, path: str) -> str:
        """What is served at a path outside the API, such as /metrics."""
        async with self._session.get(self._url.removesuffix("/api/v1") + path) as answer:
            assert answer.status == 200, f"GET {path}: {answer.status}"
            return await answer.text()

    async def post(self, path: str, body: Any = None, *, expect: int | None = None) -> Any:
        async with self._session.post(self._url + path, json={} if body is None else body) as answer:
            assert answer.status == expect if expect else answer.ok, (
                f"POST {path}: {answer.status} {await answer.text()}"
            )
            return await answer.json(content_type=None)

    async def fly(self, plan: Any, vehicle_id: str) -> str:
        """Post a plan and a run that starts; the run's id."""
        made = await self.post("/plans", plan)
        run = await self.post("/runs", {"plan": made["id"], "vehicle": vehicle_id, "start": True})
        return str(run["id"])

    async def until_run(self, run_id: str, what: Callable[[Any], bool], promise: str, within_s: float) -> Any:
        """Poll a run until `what` holds of it."""
        return await until(lambda: self.get(f"/runs/{run_id}"), what, promise, within_s)

    async def until_over(self, run_id: str, within_s: float) -> Any:
        """Poll a run until it has ended."""
        ends = ("completed", "aborted", "failed", "lost")
        return await self.until_run(run_id, lambda run: run["state"] in ends, "the run must end", within_s)

    async def until_vehicles(self, count: int, within_s: float = 30.0) -> dict[str, Any]:
        """Wait until that many vehicles are connected and known; them by id."""

        def all_known(found: Any) -> bool:
            known = [v for v in found["vehicles"] if v["state"]["connected"] and v["uid"] and v["vehicle_type"]]
            return len(known) >= count

        found = await until(lambda: self.get("/vehicles"), all_known, f"{count} vehicles must be found", within_s)
        return {vehicle["id"]: vehicle for vehicle in found["vehicles"]}


async def until(read: Callable[[], Any], what: Callable[[Any], bool], promise: str, within_s: float) -> Any:
    """Read again and again until `what` holds; AssertionError names the promise and the last value."""
    patience = Patience(within_s)
    value = await read()
    while not what(value):
        if patience.is_over():
            raise AssertionError(f"{promise} within {within_s} s; last seen: {value}")
        await asyncio.sleep(0.1)
        value = await read()
    return value
