"""`make run-cluster`: NATS, PostgreSQL, two gateways with two simulated vehicles each, and two API nodes.

Ctrl-C ends everything, and nothing is kept.
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

from rich.console import Console

from tools.cluster_servers import NatsServer, PostgresServer, free_port, open_folder

GATEWAYS: Final = {"north": (8081, 14540), "south": (8082, 14550)}
"""HTTP port, and the first UDP port of its vehicles."""
API_PORTS: Final = (8080, 8090)
READY_S: Final = 120.0
STOP_S: Final = 30.0


def main() -> None:
    """Run until Ctrl-C."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    console = Console(stderr=True)
    try:
        with ExitStack() as stack:
            _start(stack)
            console.print("\n[bold green]The cluster is up:[/]")
            for port in API_PORTS:
                console.print(f"  API node      http://127.0.0.1:{port}")
            for site, (port, _) in GATEWAYS.items():
                console.print(f"  gateway {site} http://127.0.0.1:{port}  {site}-v1, {site}-v2")
            console.print("Try next, in another terminal:")
            console.print("  .venv/bin/waydrop fly plans/clinic-run.json --vehicle north-v1")
            console.print("Ctrl-C ends all of it; nothing is kept.\n")
            signal.pause()
    except KeyboardInterrupt:
        console.print("the cluster has ended")


def _start(stack: ExitStack) -> None:
    folder = open_folder()
    stack.callback(shutil.rmtree, folder, ignore_errors=True)
    postgres = PostgresServer(folder / "postgres", free_port())
    nats = NatsServer(folder / "nats", free_port())
    for server in (postgres, nats):
        stack.callback(server.stop)
        server.start()
    shared = {"WAYDROP_NATS_SERVERS": nats.url, "WAYDROP_CLUSTER_KEY": secrets.token_hex(32)}
    urls = []
    for site, (port, udp) in GATEWAYS.items():
        simulator = ["app.simulator", "--fleet", "quad,quad", "--port", str(udp), "--local-port", "0"]
        stack.enter_context(_process(folder / f"{site}-vehicles", simulator, {}))
        connection = f"udpin://127.0.0.1:{udp}..{udp + 1}"
        own = {"WAYDROP_SITE": site, "WAYDROP_CONNECTIONS": connection, "WAYDROP_GATEWAY_URL": _url(port)}
        stack.enter_context(_process(folder / site, ["app", "gateway", "--port", str(port)], shared | own))
        urls.append(_url(port))
    own = {"WAYDROP_POSTGRES_URL": postgres.url, "WAYDROP_SECRET_KEY_FILE": str(folder / "secret.key")}
    for number, port in enumerate(API_PORTS, 1):
        node = ["app", "api", "--port", str(port)]
        stack.enter_context(_process(folder / f"api-{number}", node, shared | own))
        urls.append(_url(port))
    for url in urls:
        _wait_ready(url)


@contextmanager
def _process(folder: Path, module: list[str], environment: dict[str, str]) -> Iterator[None]:
    folder.mkdir(mode=0o700)
    given = {**os.environ, "WAYDROP_DATA_DIR": str(folder / "data"), **environment}
    # a session of its own: Ctrl-C reaches this process alone, which ends the others in order
    process = subprocess.Popen([sys.executable, "-m", *module], env=given, start_new_session=True)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()


def _wait_ready(url: str) -> None:
    deadline_s = time.monotonic() + READY_S
    while True:
        try:
            with urllib.request.urlopen(f"{url}/readyz", timeout=READY_S):
                return
        except (urllib.error.URLError, ConnectionError):
            if time.monotonic() > deadline_s:
                raise
            time.sleep(0.2)


def _url(port: int) -> str:
    return f"http://127.0.0.1:{port}"


if __name__ == "__main__":
    main()
