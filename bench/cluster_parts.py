"""The parts of the cluster that `python -m bench.cluster` measures, each in processes of its own."""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import shutil
import sys
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tests.support.paths import ROOT
from tests.support.service_process import ServiceProcess
from tools.cluster_servers import NatsServer, PostgresServer, free_port, open_folder

LINE_BYTES: Final = 1 << 24
TICK_S: Final = 1.0 / os.sysconf("SC_CLK_TCK")


class ChildProcess:
    """A process of this bench, which answers lines with lines."""

    def __init__(self, process: asyncio.subprocess.Process, log: Path) -> None:
        self._process = process
        self._log = log

    @property
    def pid(self) -> int:
        """For its CPU time."""
        return self._process.pid

    async def line(self) -> str:
        """The next one. Raises RuntimeError: it has ended."""
        assert self._process.stdout is not None
        line = await self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"a part has ended:\n{self._log.read_text(errors='replace')[-3000:]}")
        return line.decode().strip()

    async def ask(self, command: str) -> dict[str, Any]:
        """The answer to a command."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{command}\n".encode())
        answer: dict[str, Any] = json.loads(await self.line())
        return answer

    async def kill(self) -> None:
        """kill -9."""
        with suppress(ProcessLookupError):
            self._process.kill()
        await self._process.wait()


@asynccontextmanager
async def child(log: Path, *module: str) -> AsyncIterator[ChildProcess]:
    """`python -m MODULE` until the block ends. It logs that NATS is away, at length."""
    pipe = asyncio.subprocess.PIPE
    with log.open("ab") as errors:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", *module, cwd=ROOT, stdin=pipe, stdout=pipe, stderr=errors, limit=LINE_BYTES
        )
    found = ChildProcess(process, log)
    try:
        yield found
    finally:
        await found.kill()


@dataclass(frozen=True)
class Parts:
    """All of them. `environment` is what Waydrop's own have in common."""

    nats: NatsServer
    postgres: PostgresServer
    node: ServiceProcess
    floor: ChildProcess
    floor_url: str
    gateways: Sequence[ChildProcess]
    environment: dict[str, str]

    async def ask_all(self, command: str) -> list[dict[str, Any]]:
        """The answers of all gateways."""
        return await asyncio.gather(*(one.ask(command) for one in self.gateways))

    def cpu_s(self) -> dict[str, float]:
        """The CPU time that each kind of part has used until now."""
        return {
            "gateways": sum(cpu_s(one.pid) for one in self.gateways),
            "NATS": cpu_s(self.nats.pid),
            "PostgreSQL": cpu_s(self.postgres.pid),
            "API node": cpu_s(self.node.pid),
            "bare node": cpu_s(self.floor.pid),
            "client": time.process_time(),
        }


def cpu_s(pid: int) -> float:
    """Of a process and its children, also of those that have ended."""
    ticks = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            fields = path.read_text().rpartition(")")[2].split()
            if path.parent.name == str(pid):
                ticks += sum(int(text) for text in fields[11:15])
            elif fields[1] == str(pid):
                ticks += sum(int(text) for text in fields[11:13])
    return ticks * TICK_S


@asynccontextmanager
async def running(gateways: int, vehicles: int, events_s: float) -> AsyncIterator[Parts]:
    """The cluster: so many gateways, each with its share of the vehicles and events."""
    async with AsyncExitStack() as stack:
        folder = open_folder()
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        postgres, nats = PostgresServer(folder / "postgres", free_port()), NatsServer(folder / "nats", free_port())
        for server in (postgres, nats):
            stack.callback(server.stop)
            await asyncio.to_thread(server.start)
        shared = {"WAYDROP_NATS_SERVERS": nats.url, "WAYDROP_CLUSTER_KEY": secrets.token_hex(32)}
        own = {"WAYDROP_POSTGRES_URL": postgres.url, "WAYDROP_SECRET_KEY_FILE": str(folder / "secret.key")}
        node = ServiceProcess(folder / "node", (), part="api")
        node.set(**own, **shared)
        stack.enter_context(node)
        log = folder / "bench.log"
        floor = await stack.enter_async_context(
            child(folder / "floor.log", "bench.cluster_floor", nats.url, postgres.url)
        )
        floor_url = f"http://127.0.0.1:{await floor.line()}/stream"
        share = str(vehicles // gateways), str(events_s / gateways)
        children = [
            await stack.enter_async_context(
                child(log, "bench.cluster_gateway", f"s{number}", str(folder), nats.url, *share)
            )
            for number in range(1, gateways + 1)
        ]
        for one in children:
            await one.line()  # it is ready
        yield Parts(nats, postgres, node, floor, floor_url, children, shared)


async def takeover_s(url: str, within_s: float) -> float:
    """How long after kill -9 of its holder a second gateway has a site, which may take it at once.

    Raises RuntimeError, which names what the gateways said: it did not get it in time.
    """
    keeper = (Path(os.devnull), "tests.support.lease_keeper", url, "takeover")
    said: list[str] = []
    loop = asyncio.get_running_loop()
    async with AsyncExitStack() as stack:
        try:
            async with asyncio.timeout(within_s):
                first = await stack.enter_async_context(child(*keeper, "first"))
                await _until(first, "held", said)
                second = await stack.enter_async_context(child(*keeper, "second"))
                await _until(second, "taken", said)
                await first.kill()
                killed_s = loop.time()
                await _until(second, "held", said)
        except TimeoutError:
            raise RuntimeError(f"no takeover within {within_s:g} s: {said}") from None
        return loop.time() - killed_s


async def _until(keeper: ChildProcess, state: str, said: list[str]) -> None:
    while (line := await keeper.line()) != state:
        said.append(line)
