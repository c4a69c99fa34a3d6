"""Simulated vehicles in a process of their own, on ports that nobody else uses, with their faults at hand."""

from __future__ import annotations

import fcntl
import functools
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Final, Self

from tests.support.paths import ROOT
from tests.support.signed_links import signing

READY_S = 120.0
ANSWER_S = 30.0
"""They end a hang: a busy machine may take a minute to start seven vehicles."""


_PORTS: Final = range(20_000, 32_768)
"""The kernel gives those beyond to whoever binds to port 0."""


def free_udp_ports(count: int) -> int:
    """The first of `count` UDP ports in a row that nobody is bound to, and that no process of tests was given.

    A vehicle sends to a port on which nobody listens yet, or any more: who else listens there would hear it.
    """
    return free_ports(count, socket.SOCK_DGRAM)


def free_ports(count: int, kind: socket.SocketKind) -> int:
    """The same of UDP or of TCP."""
    ports = _given_ports()
    for _ in range(len(_PORTS)):
        first = ports.next_row(count)
        if ports.are_ours(first, count) and _are_free(first, count, kind):
            return first
    raise AssertionError("no free ports")


class _GivenPorts:
    """Each port is given once, until all were. Locks on a file tell other processes, and end with this one."""

    def __init__(self) -> None:
        self._next = _PORTS.start + (os.getpid() * 37) % 9_000
        path = os.path.join(tempfile.gettempdir(), f"waydrop-tests-ports-{os.getuid()}")
        self._locks = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)

    def next_row(self, count: int) -> int:
        """The ports after the last ones that were looked at."""
        if self._next + count > _PORTS.stop:
            self._next = _PORTS.start
        first, self._next = self._next, self._next + count
        return first

    def are_ours(self, first: int, count: int) -> bool:
        """Whether no other process was given one of them; from now on none is."""
        try:
            fcntl.lockf(self._locks, fcntl.LOCK_EX | fcntl.LOCK_NB, count, first)
        except OSError:
            return False
        return True


@functools.cache
def _given_ports() -> _GivenPorts:
    return _GivenPorts()


def _are_free(first: int, count: int, kind: socket.SocketKind) -> bool:
    with ExitStack() as stack:
        try:
            for port in range(first, first + count):
                probe = stack.enter_context(socket.socket(socket.AF_INET, kind))
                probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


class SimulatedFleet:
    """`python -m app.simulator` with a fleet such as "quad,plane:sysid=7". It survives the service, as real ones do.

    `rates` are the vehicles' own, "low" or "onboard": what Waydrop reads it asks for, and the rest only costs time.
    """

    def __init__(
        self,
        fleet: str,
        *,
        speed: float = 1.0,
        seed: int = 1,
        shared_port: bool = False,
        port: int | None = None,
        rates: str = "low",
        **more: str,
    ) -> None:
        self._count = len(fleet.split(","))
        self.port = free_udp_ports(self._count) if port is None else port
        self._shared = shared_port
        self.control_port = free_ports(1, socket.SOCK_STREAM)
        options = {
            "fleet": signing(fleet),
            "port": str(self.port),
            "local-port": "0",
            "speed": str(speed),
            "seed": str(seed),
            "rates": rates,
            "control-port": str(self.control_port),
            **{name.replace("_", "-"): value for name, value in more.items()},
        }
        self._arguments = [part for name, value in options.items() for part in (f"--{name}", value)]
        if shared_port:
            self._arguments.append("--shared-port")
        self._process: subprocess.Popen[str] | None = None
        self._said: list[str] = []
        self._reader: threading.Thread | None = None

    @property
    def connections(self) -> Sequence[str]:
        """The connection URLs that find these vehicles."""
        count = 1 if self._shared else self._count
        return [f"udpin://127.0.0.1:{self.port + index}" for index in range(count)]

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "app.simulator", *self._arguments],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, name="simulator output")
        self._reader.start()
        deadline_s = time.monotonic() + READY_S
        while sum(line.startswith("ready:") for line in self._said) < self._count:
            if self._process.poll() is not None or time.monotonic() > deadline_s:
                self.close()
                raise AssertionError("the simulator did not become ready:\n" + self.output())
            time.sleep(0.02)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the vehicles."""
        if self._process is not None:
            self._process.send_signal(signal.SIGTERM)
            try:
                self._process.wait(5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._reader is not None:
            self._reader.join()
        if self._process is not None and self._process.stdout is not None:
            self._process.stdout.close()

    def output(self) -> str:
        """What the simulator wrote."""
        return "".join(self._said)[-4000:]

    def control(self, fault: str, value: Any, *, system_id: int | None = None) -> Any:
        """Set a fault of one vehicle, or of all; AssertionError if the simulator refuses it."""
        return self._ask({"vehicle": system_id, "fault": fault, "value": value})

    def truth(self, system_id: int) -> Any:
        """What is true of a vehicle, whatever anybody measured."""
        return self._ask({"vehicle": system_id, "query": "state"})["vehicles"][0]

    def _ask(self, request: dict[str, Any]) -> Any:
        with socket.create_connection(("127.0.0.1", self.control_port), ANSWER_S) as connection:
            connection.sendall(json.dumps(request).encode() + b"\n")
            with connection.makefile("rb") as lines:
                answer = json.loads(lines.readline())
        assert answer.get("ok"), f"the simulator refused {request}: {answer}"
        return answer

    def _read(self) -> None:
        assert self._process is not None
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._said.append(line)
