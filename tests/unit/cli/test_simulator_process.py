"""The simulated vehicles run in a process of their own that outlives whoever started it, and is found again."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.cli.simulator_process import (
    FLEET,
    LOCAL_PORT_OFFSET,
    LOCK_NAME,
    SimulatedFleet,
    SimulatorError,
    SimulatorProcess,
)
from tests.support.simulated import free_udp_ports

STARTER = """
import sys, time
from pathlib import Path
from app.cli.simulator_process import SimulatorProcess
simulator = SimulatorProcess(Path(sys.argv[1]))
simulator.start(sys.argv[2:])
simulator.wait_ready(4, within_s=30)
sys.stdout.write("started\\n")
sys.stdout.flush()
time.sleep(600)
"""


@pytest.fixture(scope="module")
def arguments() -> tuple[str, ...]:
    """The simulator's command line, with ports that no other test uses."""
    port = free_udp_ports(LOCAL_PORT_OFFSET + len(FLEET))
    return SimulatedFleet(port=port, shared_port=False, speed=1.0, seed=0).arguments()


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[SimulatorProcess]:
    process = SimulatorProcess(tmp_path)
    yield process
    process.stop()


def test_it_starts_once_is_found_and_ends(
    simulator: SimulatorProcess, arguments: tuple[str, ...], tmp_path: Path
) -> None:
    assert simulator.find() is None
    running = simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)
    assert SimulatorProcess(tmp_path).find() == running
    with pytest.raises(SimulatorError, match="already running"):
        SimulatorProcess(tmp_path).start(arguments)
    began = time.monotonic()
    assert simulator.stop()
    assert time.monotonic() - began < 15
    assert simulator.find() is None
    assert not simulator.stop()


def test_its_control_socket_is_found_by_whoever_finds_it(
    simulator: SimulatorProcess, arguments: tuple[str, ...], tmp_path: Path
) -> None:
    simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)
    address = SimulatorProcess(tmp_path).control()
    assert address is not None
    host, _, port = address.partition(":")
    with socket.create_connection((host, int(port)), timeout=5) as control, control.makefile("rb") as answers:
        control.sendall(b'{"query": "state"}\n')
        assert len(json.loads(answers.readline())["vehicles"]) == len(FLEET)


def test_one_without_a_control_socket_has_none(simulator: SimulatorProcess) -> None:
    simulator.start(["--fleet", "quad", "--port", str(free_udp_ports(1)), "--local-port", "0"])
    simulator.wait_ready(1, within_s=30)
    assert simulator.control() is None


def test_it_outlives_a_kill_of_its_starter_and_another_can_end_it(
    simulator: SimulatorProcess, arguments: tuple[str, ...], tmp_path: Path
) -> None:
    starter = subprocess.Popen(
        [sys.executable, "-c", STARTER, str(tmp_path), *arguments], stdout=subprocess.PIPE, text=True
    )
    assert starter.stdout is not None
    with starter.stdout:
        assert starter.stdout.readline() == "started\n"
        starter.send_signal(signal.SIGKILL)
        starter.wait(timeout=10)
    running = simulator.find()
    assert running is not None
    os.kill(running.pid, 0)
    assert simulator.stop()
    assert simulator.find() is None


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / LOCK_NAME).mkdir(parents=True)
    simulator = SimulatorProcess(tmp_path)
    for use in (simulator.find, lambda: simulator.start(())):
        with pytest.raises(SimulatorError, match="cannot write"):
            use()


def test_one_that_cannot_start_is_told_with_its_last_words(simulator: SimulatorProcess) -> None:
    simulator.start(["--fleet", "submarine"])
    with pytest.raises(SimulatorError, match="submarine"):
        simulator.wait_ready(1, within_s=30)


def test_a_folder_named_app_where_the_command_is_typed_is_not_run(
    simulator: SimulatorProcess, arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__init__.py").write_text("raise SystemExit('somebody else's')")
    monkeypatch.chdir(tmp_path)
    simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)


def test_a_taken_port_is_named_with_the_way_to_use_others(simulator: SimulatorProcess) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        simulator.start(["--fleet", "quad", "--port", str(free_udp_ports(1)), "--local-port", str(port)])
        with pytest.raises(SimulatorError, match=f"UDP 127.0.0.1:{port}: Address already in use") as refused:
            simulator.wait_ready(1, within_s=30)
    assert "WAYDROP_CONNECTIONS" in refused.value.hint


def test_a_dead_one_leaves_no_trace_that_misleads(simulator: SimulatorProcess, arguments: tuple[str, ...]) -> None:
    running = simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)
    os.kill(running.pid, signal.SIGKILL)
    deadline = time.monotonic() + 5
    while simulator.find() is not None and time.monotonic() < deadline:
        time.sleep(0.01)
    assert simulator.find() is None
    simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)


def test_our_own_is_ended_too_when_somebody_removed_its_folder(
    simulator: SimulatorProcess, arguments: tuple[str, ...], tmp_path: Path
) -> None:
    running = simulator.start(arguments)
    simulator.wait_ready(len(FLEET), within_s=30)
    shutil.rmtree(tmp_path)
    simulator.stop()
    with pytest.raises(ProcessLookupError):
        os.kill(running.pid, 0)
