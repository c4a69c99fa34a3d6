"""`make run-cluster`: NATS, PostgreSQL, two gateways with two simulated vehicles each, and two API nodes.

Ctrl-C or a closed terminal ends everything, and nothing is kept. WAYDROP_PORT is the port of the first API node; the
others follow it.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NoReturn

from rich.console import Console

from tools.cluster_servers import NatsServer, PostgresServer, free_port, open_folder

PORT: Final = int(os.environ.get("WAYDROP_PORT", "8080"))
API_PORTS: Final = (PORT, PORT + 10)
GATEWAYS: Final = {"north": PORT + 1, "south": PORT + 2}
HOMES: Final = {"north": "47.397742,8.545594,488", "south": "47.397382,8.545594,488"}
"""Of the first vehicle of each site, 40 m from each other: both can fly the example plans."""
READY_S: Final = 120.0
STOP_S: Final = 30.0
LOOK_S: Final = 1.0


def main() -> None:
    """Run until Ctrl-C."""
    for ending in (signal.SIGTERM, signal.SIGHUP):  # SIGHUP: the terminal was closed
        signal.signal(ending, signal.default_int_handler)
    console = Console(stderr=True)
    for port in (*API_PORTS, *GATEWAYS.values()):
        if _is_used(port):
            raise SystemExit(f"port {port} is in use: end what listens there, or choose another WAYDROP_PORT")
    try:
        with ExitStack() as stack:
            cluster = _start(stack)
            console.print("\n[bold green]The cluster is up:[/]")
            for port in API_PORTS:
                console.print(f"  API node      http://127.0.0.1:{port}")
            for site, port in GATEWAYS.items():
                console.print(f"  gateway {site} http://127.0.0.1:{port}  {site}-v1, {site}-v2")
            console.print(f"  NATS          {cluster.nats_url}")
            console.print(f"  PostgreSQL    {cluster.postgres_url}")
            console.print(f"  logs          {cluster.folder}/*/log")
            console.print("Try next, in another terminal:")
            if API_PORTS[0] != 8080:
                console.print(f"  export WAYDROP_SERVER={_url(API_PORTS[0])}")
            console.print("  .venv/bin/waydrop fly plans/clinic-run.json --vehicle north-v1")
            console.print("Ctrl-C ends all of it; nothing is kept.\n")
            _watch(cluster, console)
    except KeyboardInterrupt:
        console.print("the cluster has ended")


def _is_used(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@dataclass(frozen=True)
class _Cluster:
    """What was started. `parts` are Waydrop's own, by their URL, with their folders."""

    folder: Path
    nats_url: str
    postgres_url: str
    parts: Mapping[str, tuple[subprocess.Popen[bytes], Path]]


def _watch(cluster: _Cluster, console: Console) -> NoReturn:
    """Say which parts end, until Ctrl-C."""
    ended: set[str] = set()
    while True:
        for url, (process, part) in cluster.parts.items():
            if url not in ended and process.poll() is not None:
                ended.add(url)
                console.print(f"{part.name} at {url} has ended ({process.returncode}); its log: {part}/log")
        time.sleep(LOOK_S)


def _start(stack: ExitStack) -> _Cluster:
    """Start all."""
    folder = open_folder()
    stack.callback(shutil.rmtree, folder, ignore_errors=True)
    postgres = PostgresServer(folder / "postgres", free_port())
    nats = NatsServer(folder / "nats", free_port())
    for server in (postgres, nats):
        stack.callback(server.stop)
        server.start()
    shared = {"WAYDROP_NATS_SERVERS": nats.url, "WAYDROP_CLUSTER_KEY": secrets.token_hex(32)}
    processes = {}
    for site, port in GATEWAYS.items():
        udp = free_port(socket.SOCK_DGRAM)
        simulator = ["app.simulator", "--fleet", "quad,quad", "--port", str(udp), "--shared-port", "--local-port", "0"]
        simulator += ["--home", HOMES[site]]
        stack.enter_context(_process(folder / f"{site}-vehicles", simulator, {}))
        connection = f"udpin://127.0.0.1:{udp}"
        own = {"WAYDROP_SITE": site, "WAYDROP_CONNECTIONS": connection, "WAYDROP_GATEWAY_URL": _url(port)}
        gateway = ["app", "gateway", "--port", str(port)]
        part = folder / site
        processes[_url(port)] = stack.enter_context(_process(part, gateway, shared | own)), part
    own = {"WAYDROP_POSTGRES_URL": postgres.url, "WAYDROP_SECRET_KEY_FILE": str(folder / "secret.key")}
    for number, port in enumerate(API_PORTS, 1):
        node = ["app", "api", "--port", str(port)]
        part = folder / f"api-{number}"
        processes[_url(port)] = stack.enter_context(_process(part, node, shared | own)), part
    for url, (process, part) in processes.items():
        _wait_ready(url, process, part / "log")
    return _Cluster(folder, nats.url, postgres.url, processes)


@contextmanager
def _process(folder: Path, module: list[str], environment: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    folder.mkdir(mode=0o700)
    given = {**os.environ, "WAYDROP_DATA_DIR": str(folder / "data"), **environment}
    # a session of its own: Ctrl-C reaches this process alone, which ends the others in order
    with (folder / "log").open("wb") as log:
        command = [sys.executable, "-m", *module]
        process = subprocess.Popen(command, env=given, stdout=log, stderr=log, start_new_session=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()


def _wait_ready(url: str, process: subprocess.Popen[bytes], log: Path) -> None:
    deadline_s = time.monotonic() + READY_S
    while True:
        if process.poll() is not None:
            raise SystemExit(f"the part at {url} has ended:\n{log.read_text(errors='replace')[-3000:]}")
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=READY_S):
                return
        except (urllib.error.URLError, ConnectionError) as error:
            if time.monotonic() > deadline_s:
                raise SystemExit(f"the part at {url} is not ready: {error}") from error
            time.sleep(0.2)


def _url(port: int) -> str:
    return f"http://127.0.0.1:{port}"


if __name__ == "__main__":
    main()
