"""The command line: which vehicles, where, how fast, on which ports."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

from app.simulator.airframe import AIRFRAMES
from app.simulator.external.others import OTHERS
from app.simulator.firmware import PROFILES
from app.simulator.params import Value
from app.simulator.streams import RATES

DEFAULT_HOME = (47.397742, 8.545594, 488.0)
MAX_SPEED = 50.0
MAX_LIVE_SPEED = 4.0
"""Above it OFFBOARD is refused: who sends setpoints, or waits for a release, has timers in wall time."""
GRIPPERS = ("onboard", "external")
KEYS = ("sysid", "winch", "gripper", "key", *OTHERS)
"""Of one vehicle of --fleet."""


@dataclass(frozen=True, slots=True)
class VehicleOptions:
    """One entry of --fleet."""

    airframe: str
    system_id: int
    winch: bool = False
    """A winch on the payload port."""
    external_gripper: bool = False
    """The gripper is a component on the payload port; the autopilot has no payload deliverer."""
    others: tuple[str, ...] = ()
    """Further components on it, by their key."""
    key_file: str = ""
    """Its MAVLink signing key; "": none."""


@dataclass(frozen=True, slots=True)
class Options:
    """Everything the fleet needs to start."""

    fleet: tuple[VehicleOptions, ...]
    port: int = 14540
    local_port: int = 14580
    shared_port: bool = False
    gcs_port: int | None = None
    speed: float = 1.0
    rates: str = "onboard"
    seed: int = 0
    home: tuple[float, float, float] = DEFAULT_HOME
    control_port: int | None = None
    firmware: str = "px4-main"
    params: tuple[tuple[str, Value], ...] = ()


def parse(arguments: Sequence[str]) -> Options:
    """Read the command line; a mistake ends the process with a sentence and status 2, as argparse does."""
    parser = argparse.ArgumentParser(
        prog="python -m app.simulator",
        description="Vehicles made of software that speak MAVLink 2 over UDP, as PX4 does.",
    )
    parser.add_argument(
        "--fleet", type=_fleet, default=_fleet("quad"), metavar="TYPE[:KEY=VALUE...],...",
        help=f"types: {', '.join(AIRFRAMES)}; keys: {', '.join(KEYS)}",
    )  # fmt: skip
    parser.add_argument("--port", type=_port, default=14540, help="vehicle i sends to 127.0.0.1:PORT+i")
    parser.add_argument("--local-port", type=_port, default=14580, help="vehicle i sends from LOCAL_PORT+i; 0: any")
    parser.add_argument("--shared-port", action="store_true", help="all vehicles send to PORT")
    parser.add_argument("--gcs-port", type=_port, default=None, help="a second link of every vehicle, to this port")
    parser.add_argument(
        "--speed", type=_speed, default=1.0, metavar="N",
        help=f"vehicle time over wall time, 1 to {MAX_SPEED:.0f}; above {MAX_LIVE_SPEED:.0f} embedded missions only: "
        "OFFBOARD and supervised drops are refused",
    )  # fmt: skip
    parser.add_argument(
        "--rates", choices=sorted(RATES), default="onboard",
        help="messages before a ground station sets intervals: onboard as PX4's link, about 51 a second; low: 10",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, help="of every random choice")
    parser.add_argument("--home", type=_home, default=DEFAULT_HOME, metavar="LAT,LON,ALT", help="of the first vehicle")
    parser.add_argument("--control-port", type=_port, default=None, help="TCP, JSON lines, loopback: faults")
    parser.add_argument("--firmware", choices=sorted(PROFILES), default="px4-main")
    parser.add_argument("--params", type=_params, default=(), metavar="NAME=VALUE,...", help="for all vehicles")
    found = parser.parse_args(arguments)
    return Options(**vars(found))


def _fleet(text: str) -> tuple[VehicleOptions, ...]:
    vehicles: list[VehicleOptions] = []
    for index, entry in enumerate(part for part in text.split(",") if part.strip()):
        name, *pairs = entry.strip().split(":")
        if name not in AIRFRAMES:
            raise argparse.ArgumentTypeError(f"unknown vehicle type {name!r}; known: {', '.join(AIRFRAMES)}")
        settings = dict(pair.partition("=")[::2] for pair in pairs)
        unknown = settings.keys() - set(KEYS)
        if unknown:
            raise argparse.ArgumentTypeError(f"unknown key {sorted(unknown)[0]!r} in {entry!r}")
        gripper = settings.get("gripper", "onboard")
        if gripper not in GRIPPERS:
            raise argparse.ArgumentTypeError(f"unknown gripper {gripper!r}; known: {', '.join(GRIPPERS)}")
        system_id = _integer(settings.get("sysid", str(index + 1)), 1, 255)
        others = tuple(key for key in OTHERS if settings.get(key, "0") == "1")
        winch = settings.get("winch", "0") == "1"
        external = gripper == "external"
        vehicles.append(VehicleOptions(name, system_id, winch, external, others, settings.get("key", "")))
    if not vehicles:
        raise argparse.ArgumentTypeError("the fleet is empty")
    return tuple(vehicles)


def _integer(text: str, low: int, high: int) -> int:
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"{value} is not between {low} and {high}")
    return value


def _port(text: str) -> int:
    return _integer(text, 0, 65535)


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 1.0 <= speed <= MAX_SPEED:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and {MAX_SPEED:.0f}")
    return speed


def _home(text: str) -> tuple[float, float, float]:
    try:
        latitude, longitude, altitude = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not LAT,LON,ALT") from None
    if not (-90.0 <= latitude <= 90.0 and -180.0 <= longitude <= 180.0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a place on earth")
    return latitude, longitude, altitude


def _params(text: str) -> tuple[tuple[str, Value], ...]:
    pairs: list[tuple[str, Value]] = []
    for entry in text.split(","):
        name, _, value = entry.partition("=")
        try:
            pairs.append((name.strip(), float(value) if "." in value or "e" in value else int(value)))
        except ValueError:
            raise argparse.ArgumentTypeError(f"{entry!r} is not NAME=VALUE") from None
    return tuple(pairs)
