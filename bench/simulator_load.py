"""What a core has to do for 100 simulated vehicles, against a floor: a bare loop that sends as many datagrams.

Usage: python -m bench.simulator_load [--vehicles 100] [--rates low] [--speed 1] [--seconds 20] [--quick]

The simulator is the process that `waydrop sim` starts, bound to one core, which others may use as well: the load of the
machine is printed. Every vehicle gets a mission over MAVLink and flies it while it is measured. The floor is a process
on the same core that sends as many datagrams a second, of the size that the vehicles' had on average, to the same
socket, waking up as often; the reference loop is plain Python on the same core. CPU is user and system time as the
kernel counts it; messages are those that arrived here; vehicle time is what the vehicles say it is.

Exit status (bench/simulator_assessment.py): 0 the promise is kept, 1 it is broken, 2 others had the core. `--quick`
takes a quarter of the vehicles for a few seconds and judges by the reference loop, which holds on slow and busy
machines too.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

from bench.simulator_assessment import Measured, quick_verdict, verdict
from bench.simulator_pilot import Pilot

TYPES = ("quad", "quad", "plane", "vtol", "rover")
READY_S = 60.0
QUICK_VEHICLES, QUICK_S = 25, 4.0
LOCAL = "127.0.0.1"
FLOOR = """
import socket, sys, time
port, rate, size, seconds = int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
out, data = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), bytes(size)
begin, sent = time.monotonic(), 0
while (now := time.monotonic() - begin) < seconds:
    while sent < now * rate:
        out.sendto(data, ("127.0.0.1", port))
        sent += 1
    time.sleep(0.02)
"""


@dataclass(frozen=True, slots=True)
class Load:
    """What was measured. `cpu` is a share of one core."""

    cpu: float
    datagrams_per_s: float
    bytes_each: int


@dataclass(frozen=True, slots=True)
class Pace:
    """How far vehicle time had come at a time of the wall, and what was given up till then."""

    wall_s: float
    vehicle_s: float
    lost_s: float
    latest_s: float


def cpu_s(pid: int) -> float:
    """User and system time of a process so far."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def on_one_core(pid: int) -> None:
    """Bind a process to the last core."""
    os.sched_setaffinity(pid, {max(os.sched_getaffinity(0))})


@contextlib.contextmanager
def simulator(vehicles: int, rates: str, speed: float, port: int) -> Iterator[tuple[int, int]]:
    """Process and control port of a running fleet that sends to `port`."""
    fleet = ",".join(TYPES[number % len(TYPES)] for number in range(vehicles))
    command = [sys.executable, "-m", "app.simulator", "--fleet", fleet, "--rates", rates, "--speed", f"{speed:g}"]
    command += ["--port", str(port), "--shared-port", "--local-port", "0", "--control-port", "0"]
    command += ["--params", "MIS_TKO_LAND_REQ=0,COM_DISARM_PRFLT=0.0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        on_one_core(process.pid)
        if process.stdout is None:
            raise RuntimeError("the simulator has no output")
        ready, control = 0, 0
        while ready < vehicles:
            line = process.stdout.readline()
            if not line:
                raise RuntimeError("the simulator ended")
            ready += line.startswith("ready:")
            control = int(line.rpartition(":")[2]) if line.startswith("control:") else control
        yield process.pid, control
    finally:
        process.terminate()
        process.wait(10)
        if process.stdout is not None:
            process.stdout.close()


def read_pace(control: int) -> Pace:
    """What the simulator says of its own time."""
    with socket.create_connection((LOCAL, control), 10.0) as connection:
        connection.sendall(b'{"query": "state"}\n')
        with connection.makefile("rb") as lines:
            state = json.loads(lines.readline())
    return Pace(time.monotonic(), state["vehicles"][0]["time_s"], state["speed"]["lost_s"], state["speed"]["latest_s"])


def floor(port: int, pilot: Pilot, like: Load, seconds: float) -> Load:
    """The bare loop, measured the same way."""
    arguments = (str(port), f"{like.datagrams_per_s:.3f}", str(like.bytes_each), str(seconds + 1.0))
    process = subprocess.Popen([sys.executable, "-c", FLOOR, *arguments])
    try:
        on_one_core(process.pid)
        pilot.listen(0.5)
        return load_of(process.pid, pilot, seconds)
    finally:
        process.wait(seconds + 30.0)


def load_of(pid: int, pilot: Pilot, seconds: float) -> Load:
    """CPU of a process and what arrives here."""
    before, begin = cpu_s(pid), time.monotonic()
    heard = pilot.listen(seconds)
    took_s = time.monotonic() - begin
    return Load((cpu_s(pid) - before) / took_s, heard.datagrams / took_s, round(heard.bytes / max(heard.datagrams, 1)))


def reference_s() -> float:
    """CPU seconds of one unit of the reference loop, on the same core."""
    process = subprocess.Popen([sys.executable, "-m", "bench.reference_loop"], stdout=subprocess.PIPE, text=True)
    on_one_core(process.pid)
    said, _ = process.communicate(timeout=60.0)
    return float(said)


def measure(vehicles: int, rates: str, speed: float, seconds: float) -> Measured:
    """One fleet, then the floor and the reference; prints what was found."""
    with Pilot(vehicles) as pilot:
        with simulator(vehicles, rates, speed, pilot.port) as (pid, control):
            flying = pilot.send_off(READY_S)
            pilot.listen(min(5.0, 0.4 * seconds) / speed)  # most are in the air
            before = read_pace(control)
            load = load_of(pid, pilot, seconds)
            counts = sorted(pilot.heard_per_vehicle.values())
            after = read_pace(control)
        bare = floor(pilot.port, pilot, load, 0.4 * seconds)
    passed_s = after.vehicle_s - before.vehicle_s
    achieved = passed_s / (after.wall_s - before.wall_s)
    found = Measured(
        factor=achieved / speed,
        cpu_of_core=load.cpu / achieved * speed,
        messages_per_s=sum(counts) / len(counts) / passed_s,
        fewest_per_s=counts[0] / passed_s,
        references=load.cpu / achieved / vehicles / reference_s(),
    )
    lines = {
        "vehicles": f"{vehicles}, {flying} of them on a mission; load average {os.getloadavg()[0]:.1f}",
        "speed": f"{achieved:.2f}x of {speed:g}x, {after.lost_s - before.lost_s:.2f} s given up in {seconds:g} s",
        "latest step": f"{after.latest_s * 1000:.0f} ms late, in the last 5 s",
        "messages per vehicle": f"{counts[0] / passed_s:.1f} to {counts[-1] / passed_s:.1f} in a second of its time, "
        f"{load.datagrams_per_s / vehicles:.1f} /s here",
        "CPU": f"{load.cpu:.1%} of one core, so {found.cpu_of_core:.1%} for the wanted speed",
        "a vehicle's second": f"{found.references:.2f} of the reference loop",
        "floor, bare sending": f"{bare.cpu:.1%} for {bare.datagrams_per_s:.0f} datagrams/s of {bare.bytes_each} bytes",
        "ratio": f"{load.cpu / bare.cpu:.1f}" if bare.cpu else "the floor is too low to be measured",
    }
    sys.stdout.writelines(f"{name:<22}{value}\n" for name, value in lines.items())
    return found


def main() -> int:
    """Measure, print and judge; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicles", type=int, default=100)
    parser.add_argument("--rates", default="low")
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    vehicles, seconds = arguments.vehicles, arguments.seconds
    if arguments.quick:
        vehicles, seconds = QUICK_VEHICLES, QUICK_S
    found = measure(vehicles, arguments.rates, arguments.speed, seconds)
    status, reason = quick_verdict(found) if arguments.quick else verdict(found)
    sys.stdout.write(f"{reason}\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
