"""Reads a recording: JSON lines, the first a header, maybe gzipped."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.simulator.airframe import AIRFRAMES

# What both sides of a comparison consist of: messages of a vehicle, with the time on one axis.


Fields = dict[str, Any]
Address = tuple[int, int]


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """A message from the vehicle. `t_s` is vehicle time since the first power-up, running on over restarts."""

    t_s: float
    name: str
    fields: Fields
    link: str | None = None


@dataclass(frozen=True, slots=True)
class Sent:
    """A message of a ground station; None in a field is a NaN."""

    t_s: float
    name: str
    fields: Fields
    source: Address
    link: str | None = None


@dataclass(frozen=True, slots=True)
class Dialogue:
    """One side of a comparison: what was sent to a vehicle, and what was heard from it."""

    sent: tuple[Sent, ...]
    received: tuple[ReceivedMessage, ...]

    def named(self, *names: str) -> list[ReceivedMessage]:
        """The heard messages with these names, in order."""
        return [one for one in self.received if one.name in names]

    def broadcast(self, name: str) -> list[ReceivedMessage]:
        """One link's copy of a message that is sent on every link."""
        return [one for one in self.received if one.name == name and one.link is None]

    def acts_s(self) -> list[float]:
        """When the ground did something; heartbeats do not count."""
        return [one.t_s for one in self.sent if one.name != "HEARTBEAT"]


# Both sides' shared view of a flight: values that change, with the time of each change.


@dataclass(frozen=True, slots=True)
class Stand:
    """A value that a message showed from `t_s` on, `count` times in a row."""

    t_s: float
    value: str
    count: int


def stands(messages: Iterable[ReceivedMessage], value: Callable[[ReceivedMessage], str | None]) -> list[Stand]:
    """The values in order, repetitions counted; None from `value` leaves a message out."""
    return list(_stands(messages, value))


def _stands(messages: Iterable[ReceivedMessage], value: Callable[[ReceivedMessage], str | None]) -> Iterator[Stand]:
    current: Stand | None = None
    for message in messages:
        shown = value(message)
        if shown is None:
            continue
        if current is not None and current.value == shown:
            current = Stand(current.t_s, shown, current.count + 1)
            continue
        if current is not None:
            yield current
        current = Stand(message.t_s, shown, 1)
    if current is not None:
        yield current


POWER_OFF = "autopilot process is stopped"
RESTART_DROP_MS = 500
"""The vehicle's clock goes back by more than this only when it starts again."""


class TraceError(Exception):
    """A file that is no recording; the message says why."""


@dataclass(frozen=True, slots=True)
class Trace:
    """One recording. `off_s` and `on_s` are the times when the vehicle's power went off and on again in it."""

    scenario: str
    model: str
    speed: float
    system_id: int
    home: tuple[float, float, float]
    """Latitude and longitude in degrees, altitude AMSL in metres."""
    params: dict[str, int | float]
    gripper_servo: str | None
    """The field of SERVO_OUTPUT_RAW that moves the gripper; None without one."""
    dialogue: Dialogue
    off_s: tuple[float, ...]
    on_s: tuple[float, ...]
    end_s: float

    @property
    def wind_m_s(self) -> tuple[float, float]:
        """North and east: where the air of PX4's SIH moves to."""
        return float(self.params.get("SIH_WIND_N", 0.0)), float(self.params.get("SIH_WIND_E", 0.0))


def trace_files(folder: Path) -> list[Path]:
    """The recordings of a folder, in the order of their names."""
    return sorted(path for path in folder.iterdir() if path.name.endswith((".jsonl", ".jsonl.gz")))


def read_trace(path: Path) -> Trace:
    """Raises TraceError for a file that is no recording, OSError for one that cannot be read."""
    try:
        lines = [json.loads(line) for line in _lines(path)]
        header = lines[0]
        trace = _trace(header, _Axis(float(header["speed_factor"])), lines[1:])
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, EOFError, OSError, zlib.error) as error:
        if isinstance(error, OSError) and not isinstance(error, gzip.BadGzipFile):
            raise
        raise TraceError(f"{path.name} is no recording: {error!r}") from error
    if trace.model not in AIRFRAMES:
        raise TraceError(f"{path.name}: no simulated vehicle is a {trace.model}; known: {', '.join(AIRFRAMES)}")
    return trace


def _lines(path: Path) -> Iterator[str]:
    data = path.read_bytes()
    yield from (gzip.decompress(data) if path.suffix == ".gz" else data).decode().splitlines()


def _trace(header: dict[str, Any], axis: _Axis, lines: list[dict[str, Any]]) -> Trace:
    sent: list[Sent] = []
    received: list[ReceivedMessage] = []
    off: list[float] = []
    for line in lines:
        t_s = axis.place(line)
        if line["dir"] == "note":
            if line["text"] == POWER_OFF:
                off.append(t_s)
        elif line["dir"] == "tx":
            sent.append(Sent(t_s, line["name"], line["f"], (line["sys"], line["comp"]), line.get("link")))
        else:
            received.append(ReceivedMessage(t_s, line["name"], line["f"], line.get("link")))
    latitude, longitude, altitude = header["home"]
    return Trace(
        scenario=header["scenario"],
        model=header["model"],
        speed=float(header["speed_factor"]),
        system_id=header["vehicle_sysid"],
        home=(latitude, longitude, altitude),
        params=header["params"],
        gripper_servo=header.get("gripper_servo"),
        dialogue=Dialogue(tuple(sent), tuple(received)),
        off_s=tuple(off),
        on_s=tuple(axis.restarts_s),
        end_s=axis.now_s,
    )


class _Axis:
    """Puts lines on the axis of vehicle time; over a restart, and before the first clock, wall time helps out."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._base_s = 0.0
        self._clock_ms: float | None = None
        self._wall_s = 0.0
        self.now_s = 0.0
        self.restarts_s: list[float] = []

    def place(self, line: dict[str, Any]) -> float:
        """The time of a line, in seconds; lines come in order."""
        clock_ms = line.get("vt_ms")
        elapsed_s = max(0.0, line["t"] - self._wall_s) * self._speed
        self._wall_s = line["t"]
        if clock_ms is None:
            return self.now_s
        if self._clock_ms is not None and clock_ms < self._clock_ms - RESTART_DROP_MS:
            self._base_s = self.now_s + elapsed_s - clock_ms / 1000.0
            self.restarts_s.append(self._base_s)
        elif self._clock_ms == clock_ms and elapsed_s > 0.5:
            self.now_s += elapsed_s  # the vehicle is off: only the wall clock goes on
            return self.now_s
        self._clock_ms = clock_ms
        self.now_s = max(self.now_s, self._base_s + clock_ms / 1000.0)
        return self.now_s
