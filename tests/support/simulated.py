"""Simulated vehicles in a process of their own, on ports that nobody else uses, with their faults at hand."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

from tests.support.paths import ROOT
from tests.support.signed_links import signing

READY_S = 30.0
ANSWER_S = 5.0


def free_udp_ports(count: int) -> int:
    """The first of `count` UDP ports in a row that nobody is bound to."""
    for first in range(20_000 + (os.getpid() * 37) % 9_000, 60_000, count):
        with ExitStack() as stack:
            try:
                for port in range(first, first + count):
                    probe = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                    probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return first
    raise AssertionError("no free UDP ports")


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
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.control_port = int(probe.getsockname()[1])
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
