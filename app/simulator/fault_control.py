"""Sets faults by name, and the speed. What comes in is untrusted JSON; a mistake is said, nothing crashes."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from app.simulator.channel import Sender
from app.simulator.dialect import Message, mavlink
from app.simulator.geo import LocalFrame
from app.simulator.options import MAX_LIVE_SPEED, MAX_SPEED
from app.simulator.vehicle import Vehicle
from app.simulator.wire import VEHICLE_COMPONENT, Cmd, MissionAck, MissionType, Mode

if TYPE_CHECKING:
    from app.simulator.fleet import Fleet


IDENTITY = (246, 191)
SECOND_GROUND_ACTIONS = ("upload", "clear", "open_transfer")


class SecondGroundStation:
    """Interferes with one vehicle, over a link of its own. It serves a short mission."""

    def __init__(self, system_id: int, frame: LocalFrame, receive: Callable[[Sender, Message], None]) -> None:
        self.gcs_heard_s: float | None = None
        self._system_id = system_id
        self._frame = frame
        self._receive = receive
        self._answers = False

    def interfere(self, action: str) -> None:
        """One of SECOND_GROUND_ACTIONS: replace the mission, empty it, or begin an upload and fall silent."""
        target = (self._system_id, VEHICLE_COMPONENT)
        self._answers = action == "upload"
        if action == "clear":
            self._send(mavlink.MAVLink_mission_clear_all_message(*target, MissionType.MISSION))
        else:
            self._send(mavlink.MAVLink_mission_count_message(*target, 2, MissionType.MISSION, 0))

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """The vehicle speaks to this station; only requests for items are answered."""
        mine = getattr(message, "target_system", None) == IDENTITY[0]
        if self._answers and mine and message.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            self._send(self._item(message.seq))

    def _item(self, seq: int) -> Message:
        latitude, longitude = self._frame.to_global(20.0 * seq, -20.0)
        command = Cmd.NAV_TAKEOFF if seq == 0 else Cmd.NAV_WAYPOINT
        return mavlink.MAVLink_mission_item_int_message(
            self._system_id, VEHICLE_COMPONENT, seq, 6, command, int(seq == 0), 1,
            0.0, 0.0, 0.0, math.nan, round(latitude * 1e7), round(longitude * 1e7), 25.0, MissionType.MISSION,
        )  # fmt: skip

    def _send(self, message: Message) -> None:
        packed = message.pack(mavlink.MAVLink(None, srcSystem=IDENTITY[0], srcComponent=IDENTITY[1]))
        self._receive(self, mavlink.MAVLink(None).decode(bytearray(packed)))


def lasting_faults(vehicle: Vehicle, *, has_duplicate: bool) -> dict[str, Any]:
    """Name and value of each that differs from a healthy vehicle. Not what happens once (reboot, mode)."""
    faults, link = vehicle.faults, vehicle.faults.link
    values: dict[str, Any] = {
        "loss": link.loss,
        "duplicate": link.duplicate,
        "reorder": link.reorder,
        "delay_s": link.delay_s,
        "jitter_s": link.jitter_s,
        "link_cut": link.link_cut,
        "refuse_upload": faults.refuse_upload,
        "lost_ack": faults.lost_acks,
        "stuck_gripper": faults.stuck_gripper,
        "no_gripper": faults.no_gripper,
        "slow_gripper": faults.slow_gripper_s,
        "stuck_winch": vehicle.winch is not None and vehicle.winch.stuck,
        "gps_loss": faults.gps_lost,
        "range_loss": faults.range_lost,
        "wind": [faults.wind_north_m_s, faults.wind_east_m_s],
        "duplicate_sysid": has_duplicate,
    }
    return {name: value for name, value in values.items() if value not in (False, 0, [0.0, 0.0])}


Answer = dict[str, Any]
Setter = Callable[[Vehicle, Any], Awaitable[None] | None]


class RefusedError(Exception):
    """The request cannot be carried out; the text says why."""


class FaultControl:
    """{"vehicle": system id or null for all, "fault": name, "value": ...}, {"speed": ...} or {"query": "state"}."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._setters: dict[str, Setter] = {
            "loss": _link(_share, "loss"),
            "duplicate": _link(_share, "duplicate"),
            "reorder": _link(_share, "reorder"),
            "delay_s": _link(_seconds, "delay_s"),
            "jitter_s": _link(_seconds, "jitter_s"),
            "link_cut": _link(_flag, "link_cut"),
            "reboot": lambda vehicle, value: vehicle.reboot() if _flag(value) else None,
            "refuse_upload": _of_vehicle(
                lambda value: int(_number(value, 0, MissionAck.OPERATION_CANCELLED)), "refuse_upload"
            ),
            "lost_ack": _of_vehicle(lambda value: int(_number(value, 0, 1000)), "lost_acks"),
            "stuck_gripper": _of_vehicle(_flag, "stuck_gripper"),
            "no_gripper": _of_vehicle(_flag, "no_gripper"),
            "slow_gripper": _of_vehicle(lambda value: _number(value, 0.0, 600.0), "slow_gripper_s"),
            "stuck_winch": _stuck_winch,
            "gps_loss": _of_vehicle(_flag, "gps_lost"),
            "range_loss": _of_vehicle(_flag, "range_lost"),
            "battery_percent": _battery,
            "wind": _wind,
            "mode": _mode,
            "second_gcs": _second_gcs,
            "duplicate_sysid": self._duplicate,
        }

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._setters)

    async def handle(self, request: object) -> Answer:
        """One request; {"ok": true, ...} or {"ok": false, "error": "..."}."""
        try:
            if not isinstance(request, dict):
                raise RefusedError("a request is a JSON object")
            vehicles = self._chosen(request.get("vehicle"))
            if "query" in request:
                return self._query(request["query"], vehicles)
            if "speed" in request:
                return self._change_speed(request["speed"])
            name = request.get("fault")
            if not isinstance(name, str) or name not in self._setters:
                raise RefusedError(f"unknown fault {name!r}; known: {', '.join(sorted(self._setters))}")
            for vehicle in vehicles:
                waiting = self._setters[name](vehicle, request.get("value"))
                if waiting is not None:
                    await waiting
        except RefusedError as refusal:
            return {"ok": False, "error": str(refusal)}
        return {"ok": True}

    def _chosen(self, system_id: object) -> list[Vehicle]:
        if system_id is None:
            return list(self._fleet.vehicles)
        found = [vehicle for vehicle in self._fleet.vehicles if vehicle.system_id == system_id]
        if not found:
            raise RefusedError(f"no vehicle with system id {system_id!r}")
        return found

    async def _duplicate(self, vehicle: Vehicle, value: object) -> None:
        if _flag(value):
            await self._fleet.add_duplicate(vehicle)
        else:
            self._fleet.remove_duplicates(vehicle)

    def _change_speed(self, wanted: object) -> Answer:
        speed = _number(wanted, 1.0, MAX_SPEED)
        live = [vehicle.system_id for vehicle in self._fleet.everybody() if vehicle.state.status.mode is Mode.OFFBOARD]
        if speed > MAX_LIVE_SPEED and live:
            raise RefusedError(f"vehicle {live[0]} is in OFFBOARD, which is simulated up to {MAX_LIVE_SPEED:g}x")
        self._fleet.change_speed(speed)
        return {"ok": True, "speed": asdict(self._fleet.pace.report())}

    def _query(self, what: object, vehicles: list[Vehicle]) -> Answer:
        """The truth about the vehicles, to be compared with what was measured."""
        if what != "state":
            raise RefusedError(f"unknown query {what!r}; known: state")
        speed = asdict(self._fleet.pace.report())
        return {
            "ok": True,
            "speed": speed,
            "vehicles": [{**_state(vehicle), "faults": self._faults(vehicle)} for vehicle in vehicles],
        }

    def _faults(self, vehicle: Vehicle) -> dict[str, Any]:
        return lasting_faults(vehicle, has_duplicate=bool(self._fleet.duplicates_of(vehicle.system_id)))


def _state(vehicle: Vehicle) -> Answer:
    body, status = vehicle.state.body, vehicle.state.status
    latitude, longitude = vehicle.spec.frame.to_global(body.north_m, body.east_m)
    return {
        "vehicle": vehicle.system_id,
        "type": vehicle.spec.airframe.name,
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "height_m": body.up_m,
        "ground_speed_m_s": body.ground_speed_m_s,
        "armed": status.armed,
        "mode": status.mode.name,
        "landed_state": status.landed_state.name,
        "mission_seq": vehicle.store.current_seq,
        "gripper_open": vehicle.state.gripper.is_open,
        "winch_delivered": vehicle.winch is not None and vehicle.winch.delivered,
        "time_s": vehicle.clock.now_s,
    }


# values -----------------------------------------------------------------------------------------------------


def _number(value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise RefusedError(f"{value!r} is not a number")
    if not low <= value <= high:
        raise RefusedError(f"{value!r} is not between {low} and {high}")
    return float(value)


def _flag(value: object) -> bool:
    if value is None:
        return True
    if not isinstance(value, bool):
        raise RefusedError(f"{value!r} is not true or false")
    return value


def _share(value: object) -> float:
    return _number(value, 0.0, 1.0)


def _seconds(value: object) -> float:
    return _number(value, 0.0, 60.0)


def _link(read: Callable[[object], object], name: str) -> Setter:
    """Sets a field of LinkFaults to what `read` makes of the value."""
    return lambda vehicle, value: setattr(vehicle.faults.link, name, read(value))


def _of_vehicle(read: Callable[[object], object], name: str) -> Setter:
    """The same with a field of VehicleFaults."""
    return lambda vehicle, value: setattr(vehicle.faults, name, read(value))


def _stuck_winch(vehicle: Vehicle, value: object) -> None:
    if vehicle.winch is None:
        raise RefusedError(f"vehicle {vehicle.system_id} has no winch")
    vehicle.winch.stuck = _flag(value)


def _battery(vehicle: Vehicle, value: object) -> None:
    vehicle.battery.set_fraction(_number(value, 0.0, 100.0) / 100.0)


def _wind(vehicle: Vehicle, value: object) -> None:
    if not isinstance(value, list) or len(value) != 2:
        raise RefusedError("wind is [north, east] in m/s")
    north, east = (_number(part, -30.0, 30.0) for part in value)
    vehicle.faults.wind_north_m_s, vehicle.faults.wind_east_m_s = north, east


def _mode(vehicle: Vehicle, value: object) -> None:
    """Somebody else, a pilot at the sticks, changes the mode."""
    known = [mode.name for mode in Mode if mode is not Mode.DESCEND]
    if not isinstance(value, str) or value not in known:
        raise RefusedError(f"unknown mode {value!r}; known: {', '.join(known)}")
    if Mode[value] is Mode.OFFBOARD and vehicle.clock.speed > MAX_LIVE_SPEED:
        raise RefusedError(f"OFFBOARD is not simulated above {MAX_LIVE_SPEED:g}x")
    vehicle.commander.change_mode(Mode[value])


def _second_gcs(vehicle: Vehicle, value: object) -> None:
    if not isinstance(value, str) or value not in SECOND_GROUND_ACTIONS:
        raise RefusedError(f"unknown action {value!r}; known: {', '.join(SECOND_GROUND_ACTIONS)}")
    SecondGroundStation(vehicle.system_id, vehicle.spec.frame, vehicle.receive).interfere(value)


LOOPBACK = "127.0.0.1"
MAX_LINE_BYTES = 65536


class ControlServer:
    """The control socket: a JSON object a line, over TCP. Any number of clients, one request of each at a time."""

    def __init__(self, control: FaultControl) -> None:
        self._control = control
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.StreamWriter] = set()

    async def open(self, port: int) -> int:
        """Listen; returns the port (useful with port 0). Raises OSError when it is taken."""
        self._server = await asyncio.start_server(self._serve, LOOPBACK, port, limit=MAX_LINE_BYTES)
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and drop the clients."""
        if self._server is not None:
            self._server.close()
        for writer in self._clients:
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients.add(writer)
        try:
            while line := await _read_line(reader):
                answer = await self._answer(line)
                writer.write(json.dumps(answer).encode() + b"\n")
                await writer.drain()
        except (ConnectionError, asyncio.CancelledError):
            pass  # the client left, or we do
        finally:
            self._clients.discard(writer)
            writer.close()

    async def _answer(self, line: bytes) -> Answer:
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            return {"ok": False, "error": "not a JSON object"}
        return await self._control.handle(request)


async def _read_line(reader: asyncio.StreamReader) -> bytes:
    """The next line; empty at the end, or when a line is too long to be a request."""
    try:
        return await reader.readline()
    except ValueError:
        return b""
