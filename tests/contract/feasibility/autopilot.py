"""The simulated autopilot's own judgement of a compiled mission, in process: it shares no code with Waydrop's rules."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.vehicle.state import FirmwareVersion, VehicleProfile, VehicleType
from app.simulator.airframe import AIRFRAMES
from app.simulator.firmware import PX4_MAIN, FirmwareProfile
from app.simulator.geo import LocalFrame
from app.simulator.mission.feasibility import FeasibilityInput, problems
from app.simulator.mission.geofence import Geofence, fence_refusal
from app.simulator.mission.item import Item, refusal
from app.simulator.params import Params, Value
from app.simulator.state import Home
from app.simulator.wire import MissionAck
from tests.support.plan_pieces import HOME

AIRFRAME_OF = {
    VehicleType.MULTICOPTER: "quad",
    VehicleType.FIXED_WING: "plane",
    VehicleType.VTOL: "vtol",
    VehicleType.ROVER: "rover",
    VehicleType.AIRSHIP: "airship",
}


def facts_of(
    vehicle_type: VehicleType, params: Mapping[str, Value], profile: FirmwareProfile = PX4_MAIN
) -> VehicleProfile:
    """What Waydrop reads of such a vehicle: everything, as a vehicle that answers every request."""
    values = _params(vehicle_type, params, profile)
    major, minor, patch = (profile.flight_sw_version >> shift & 0xFF for shift in (24, 16, 8))
    return VehicleProfile(
        vehicle_type=vehicle_type,
        firmware=FirmwareVersion(major, minor, patch),
        home=HOME,
        parameters={name: values[name] for name in values},
    )


def refusals(
    mission: Mission,
    vehicle_type: VehicleType,
    params: Mapping[str, Value],
    profile: FirmwareProfile = PX4_MAIN,
    *,
    landed: bool = True,
) -> list[str]:
    """Why the autopilot would refuse the upload, or never start what it took. Empty: it flies."""
    airframe = AIRFRAMES[AIRFRAME_OF[vehicle_type]]
    values = _params(vehicle_type, params, profile)
    frame = LocalFrame(HOME.latitude_deg, HOME.longitude_deg, HOME.altitude_m)
    fence = tuple(map(_received, mission.fence))
    found = [f"fence item {seq}" for seq, item in enumerate(fence) if fence_refusal(item) is not MissionAck.ACCEPTED]
    for kind, items in ((MissionType.MISSION, mission.items), (MissionType.FENCE, mission.fence)):
        for item in items:
            answer = refusal(_received(item), int(kind), profile, airframe)
            if answer is not MissionAck.ACCEPTED:
                found.append(f"{kind.name} item {item.seq} (command {item.command}): {answer.name}")
    judged = FeasibilityInput(
        items=tuple(map(_received, mission.items)),
        airframe=airframe,
        params=values,
        frame=frame,
        home=Home(0.0, 0.0, 0.0),
        fence=Geofence(fence, frame, needs_all=profile.needs_all_inclusions),
        landed=landed,
        profile=profile,
    )
    return found + [f"{problem.event} {problem.arguments}" for problem in problems(judged)]


def _params(vehicle_type: VehicleType, params: Mapping[str, Value], profile: FirmwareProfile) -> Params:
    """As the simulated fleet puts them together; no vehicle has a parameter that its firmware has not."""
    return Params(AIRFRAMES[AIRFRAME_OF[vehicle_type]].params, profile.params, params, absent=profile.absent)


def _received(item: MissionItem) -> Item:
    """As it arrives: floats in single precision."""
    floats = (item.param1, item.param2, item.param3, item.param4, item.z)
    param1, param2, param3, param4, z = struct.unpack("<5f", struct.pack("<5f", *floats))
    return Item(
        command=int(item.command),
        frame=int(item.frame),
        autocontinue=int(item.autocontinue),
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        x=item.x,
        y=item.y,
        z=z,
    )
