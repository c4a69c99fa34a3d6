"""`waydrop up`, which `make run` calls: what it prints works, a crash leaves the vehicles flying, Ctrl-C stops all."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.request import urlopen

import pytest

from app.cli.simulator_process import FLEET, LOCAL_PORT_OFFSET, SimulatorProcess
from tests.support.paths import ROOT
from tests.support.patience import Patience
from tests.support.service_process import free_tcp_port
from tests.support.simulated import free_udp_ports

WAYDROP = Path(sys.executable).with_name("waydrop")
START_S = 180.0
COMMAND_S = 300.0
CLEAN_END_S = 30.0
"""They end a hang: 3 s for an end are promised on a machine that is not overloaded."""
ANSWER_S = 30.0
STANDSTILLS = ("the event loop stalled", '"refusal": "late"')
"""On a busy machine each loop stands still at times, says so, and rejects what waited for too long meanwhile."""


class Up:
    """One `waydrop up` in a terminal of its own."""

    def __init__(self, data_dir: Path, port: int, vehicles: str, *options: str, **more: str) -> None:
        self.port = port
        self._out = data_dir / "up.out"
        settings = {"PORT": str(port), "DATA_DIR": str(data_dir), "CONNECTIONS": vehicles, "LOG_LEVEL": "warning"}
        own = {f"WAYDROP_{name}": value for name, value in settings.items()}
        environment = {**os.environ, "COLUMNS": "200", **own, **more}
        with self._out.open("wb") as out:
            self.process = subprocess.Popen(
                [WAYDROP, "up", *options], cwd=ROOT, env=environment, stdout=out, stderr=out, start_new_session=True
            )

    def said(self) -> str:
        return self._out.read_text(errors="replace")

    def until_ready(self) -> list[str]:
        """Wait until it says that it is up; the commands that it offers."""
        patience = Patience(START_S)
        while "Ctrl-C stops" not in self.said():
            assert self.process.poll() is None, self.said()
            assert not patience.is_over(), self.said()
            time.sleep(0.05)
        return [line.strip() for line in self.said().splitlines() if line.startswith("  ")]

    def warnings(self) -> list[str]:
        """What a user should not see, but for standstills of the machine."""
        lines = [line for line in self.said().splitlines() if not any(words in line for words in STANDSTILLS)]
        return [line for line in lines if "warning" in line or "mavsdk" in line]

    def ctrl_c(self) -> int:
        """What a terminal sends: SIGINT to the whole group. The exit status; TimeoutExpired if it does not end."""
        os.killpg(self.process.pid, signal.SIGINT)
        return self.process.wait(CLEAN_END_S)

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(CLEAN_END_S)


@pytest.fixture
def data_dir(tmp_path: Path) -> Iterator[Path]:
    yield tmp_path
    SimulatorProcess(tmp_path).stop()


@pytest.fixture
def vehicles() -> str:
    """The connections of four vehicles, on ports that no other test's vehicles have, nor send from."""
    first = free_udp_ports(LOCAL_PORT_OFFSET + len(FLEET))
    return f"udpin://127.0.0.1:{first}..{first + len(FLEET) - 1}"


def test_it_says_what_it_started_and_three_commands_that_work(data_dir: Path, vehicles: str) -> None:
    up = Up(data_dir, free_tcp_port(), vehicles, "--speed", "4")
    try:
        commands = up.until_ready()
        assert "two multicopters, one fixed wing, one VTOL" in up.said()
        assert [shlex.split(command)[1] for command in commands] == ["validate", "vehicles", "fly"]
        for command in commands:
            done = subprocess.run(
                shlex.split(command), cwd=ROOT, capture_output=True, text=True, timeout=COMMAND_S, check=False
            )
            assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}\n{up.said()}"
        assert "released" in done.stdout
        run = re.search(r"run-[0-9a-f]{12}", done.stdout)
        assert run is not None
        sheet = data_dir / "report.html"
        report = [*shlex.split(commands[1])[:1], "runs", "report", run[0], "--server", f"http://127.0.0.1:{up.port}"]
        subprocess.run([*report, "--output", str(sheet)], cwd=ROOT, timeout=COMMAND_S, check=True)
        assert '<p class="outcome">released</p>' in sheet.read_text(encoding="utf-8")
        assert up.ctrl_c() == 0, up.said()
    finally:
        up.kill()
    assert SimulatorProcess(data_dir).find() is None


@pytest.mark.parametrize("writable", [True, False])
def test_a_new_user_sees_no_warning(data_dir: Path, vehicles: str, tmp_path: Path, *, writable: bool) -> None:
    home = tmp_path / "home"
    home.mkdir() if writable else home.write_text("no folder can be made here")
    up = Up(data_dir, free_tcp_port(), vehicles, HOME=str(home))
    try:
        up.until_ready()
        patience = Patience(START_S)
        while len(_connected(up.port)) < len(FLEET):
            assert not patience.is_over(), up.said()
            time.sleep(0.1)
        assert up.warnings() == []
    finally:
        up.ctrl_c()
        up.kill()


def _connected(port: int) -> list[str]:
    with urlopen(f"http://127.0.0.1:{port}/api/v1/vehicles", timeout=ANSWER_S) as answer:
        return [vehicle["id"] for vehicle in json.load(answer)["vehicles"] if vehicle["state"]["connected"]]


def assert_refused_on_the_same_journal(data_dir: Path, vehicles: str) -> None:
    """A further `waydrop up` says why it does not start, and leaves the one that runs its vehicles."""
    settings = {"PORT": str(free_tcp_port()), "DATA_DIR": str(data_dir), "CONNECTIONS": vehicles}
    refused = subprocess.run(
        [WAYDROP, "up"],
        cwd=ROOT,
        env={**os.environ, **{f"WAYDROP_{name}": value for name, value in settings.items()}},
        capture_output=True,
        text=True,
        timeout=START_S,
        check=False,
    )
    assert refused.returncode == 1
    assert "another Waydrop uses this journal" in refused.stderr
    assert SimulatorProcess(data_dir).find() is not None


def test_a_kill_leaves_the_vehicles_the_next_up_takes_them_over_and_one_on_the_same_journal_is_refused(
    data_dir: Path, vehicles: str
) -> None:
    port = free_tcp_port()
    first = Up(data_dir, port, vehicles)
    second = None
    try:
        first.until_ready()
        first.kill()
        left = SimulatorProcess(data_dir).find()
        assert left is not None
        second = Up(data_dir, port, vehicles)
        second.until_ready()
        assert f"simulated vehicles are already running (process {left.pid})" in second.said()
        assert SimulatorProcess(data_dir).find() == left
        with urlopen(f"http://127.0.0.1:{port}/api/v1/simulator", timeout=ANSWER_S) as answer:
            assert [vehicle["type"] for vehicle in json.load(answer)["vehicles"]] == ["quad", "quad", "plane", "vtol"]
        assert_refused_on_the_same_journal(data_dir, vehicles)
        assert second.process.poll() is None
        assert second.ctrl_c() == 0, second.said()
    finally:
        for up in filter(None, (first, second)):
            up.kill()
    assert SimulatorProcess(data_dir).find() is None
