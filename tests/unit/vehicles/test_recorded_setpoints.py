"""What Waydrop sends in offboard control is what a real PX4 took in the recordings, field by field."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from app.domain.autopilot.capability import FirmwareProfile, FlightKind
from app.domain.autopilot.px4.modes import mode_numbers
from app.domain.errors import SetpointRefusedError
from app.domain.mission import MavCmd
from app.domain.offboard.control_method import FORMS
from app.domain.offboard.encode import Follower, encode
from app.domain.offboard.messages import WIRE_FORMS, Ignore, SetpointFrame
from app.domain.offboard.setpoints import Setpoint
from app.domain.vehicle.state import FlightMode
from app.services.offboard import SLOWEST_HZ, OffboardSettings
from app.vehicles.command_sender import command
from app.vehicles.encoders import CommandLong, SetpointOut
from tests.support.paths import DATA
from tests.support.setpoint_examples import setpoint_of

DATA = DATA / "offboard" / "sent.jsonl"
RECORDED: list[dict[str, Any]] = [json.loads(line) for line in DATA.read_text(encoding="utf-8").splitlines()]
SETPOINTS = [one for one in RECORDED if one["name"] != "COMMAND_LONG"]
MODES = [one for one in RECORDED if one["name"] == "COMMAND_LONG"]
KIND = {"quad": FlightKind.ROTARY, "plane": FlightKind.WING, "rover": FlightKind.ROVER}
RECORDED_HZ = {"quad": 20.0, "plane": 10.0, "rover": 20.0}
LOCAL, GLOBAL, ATTITUDE = "SET_POSITION_TARGET_LOCAL_NED", "SET_POSITION_TARGET_GLOBAL_INT", "SET_ATTITUDE_TARGET"
REFUSED_BY_PX4 = {("18_offboard_quad", LOCAL, 1, 4095), ("19_offboard_global_attitude", GLOBAL, 3, 3576)}
NOT_FOLLOWED = {
    ("20_offboard_plane", LOCAL, 1, 12288): "setpoint.type_not_decoded",
    ("20_offboard_plane", LOCAL, 1, 15864): "setpoint.type_not_decoded",
    ("20_offboard_plane", LOCAL, 1, 3576): "setpoint.not_followed",
    ("20_offboard_plane", LOCAL, 1, 3527): "setpoint.not_followed",
    ("20_offboard_plane", LOCAL, 1, 3135): "setpoint.not_followed",
    ("20_offboard_plane", GLOBAL, 6, 3576): "setpoint.not_followed",
    ("20_offboard_plane", GLOBAL, 6, 12288): "setpoint.type_not_decoded",
    ("20b_offboard_plane_path", LOCAL, 1, 3576): "setpoint.not_followed",
    ("21_offboard_rover", ATTITUDE, None, 7): "setpoint.not_followed",
}
"""PX4 took them, and then flew somewhere else (the recordings' own notes): Waydrop refuses them."""
GROUPS = {
    Ignore.POSITION: ("x", "y", "z"),
    Ignore.VELOCITY: ("vx", "vy", "vz"),
    Ignore.ACCELERATION: ("afx", "afy", "afz"),
    Ignore.YAW: ("yaw",),
    Ignore.YAW_RATE: ("yaw_rate",),
}
"""Which fields a bit of the type mask makes the vehicle pass over."""


def key(record: dict[str, Any]) -> tuple[str, str, int | None, int]:
    fields = record["f"]
    return record["trace"], record["name"], fields.get("coordinate_frame"), fields["type_mask"]


def label(record: dict[str, Any]) -> str:
    return " ".join(str(part) for part in key(record))


TAKEN = [one for one in SETPOINTS if key(one) not in REFUSED_BY_PX4 and key(one) not in NOT_FOLLOWED]


def human(record: dict[str, Any]) -> Setpoint:
    """The setpoint that a client of Waydrop would say for it."""
    f, mask = record["f"], record["f"]["type_mask"]
    if record["name"] == ATTITUDE:
        return _attitude(f)
    parts: dict[str, Any] = {}
    given = [group for group in (Ignore.POSITION, Ignore.VELOCITY, Ignore.ACCELERATION) if not mask & group]
    if mask & 0xF000:
        form = "typed_position_global" if record["name"] == GLOBAL else "typed_position_ned"
        given, parts["setpoint_type"] = [Ignore.POSITION], "loiter"
    else:
        words = {Ignore.POSITION: "position", Ignore.VELOCITY: "velocity", Ignore.ACCELERATION: "acceleration"}
        frame = "global" if record["name"] == GLOBAL else "body" if f["coordinate_frame"] == 8 else "ned"
        form = "_".join([words[group] for group in given] + [frame])
        parts |= {} if mask & Ignore.YAW else {"yaw_deg": math.degrees(f["yaw"])}
    names = ("forward_m_s", "right_m_s", "down_m_s") if form.endswith("body") else ("north_m_s", "east_m_s", "down_m_s")
    if Ignore.POSITION in given and record["name"] == GLOBAL:
        above = {5: "amsl", 6: "rel_home"}[f["coordinate_frame"]]
        parts |= {"latitude_deg": f["lat_int"] / 1e7, "longitude_deg": f["lon_int"] / 1e7}
        parts |= {"altitude_m": float(f["alt"]), "altitude_type": above}
    elif Ignore.POSITION in given:
        parts |= {"north_m": float(f["x"]), "east_m": float(f["y"]), "down_m": float(f["z"])}
    if Ignore.VELOCITY in given:
        parts |= dict(zip(names, map(float, (f["vx"], f["vy"], f["vz"])), strict=True))
    if Ignore.ACCELERATION in given:
        parts |= {"north_m_s2": float(f["afx"]), "east_m_s2": float(f["afy"]), "down_m_s2": float(f["afz"])}
    return setpoint_of({"type": form, **parts})


def _attitude(f: dict[str, Any]) -> Setpoint:
    if f["type_mask"] == 128:
        rates = {name: math.degrees(f[f"body_{name.split('_')[0]}_rate"]) for name in ("roll_deg_s", "pitch_deg_s")}
        parts = {**rates, "yaw_deg_s": math.degrees(f["body_yaw_rate"]), "thrust": f["thrust"]}
        return setpoint_of({"type": "body_rates", **parts})
    w, x, y, z = f["q"]
    angles = {
        "roll_deg": math.degrees(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))),
        "pitch_deg": math.degrees(math.asin(2 * (w * y - z * x))),
        "yaw_deg": math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))),
    }
    return setpoint_of({"type": "attitude", **angles, "thrust": f["thrust"]})


def follower(record: dict[str, Any]) -> Follower:
    return Follower(KIND[record["model"]], FirmwareProfile.FLOWN, record["home_amsl_m"])


def sent(record: dict[str, Any]) -> dict[str, Any]:
    """The fields as Waydrop hands them over for the wire."""
    fields = json.loads(SetpointOut(encode(human(record), follower(record))).fields_json(1, 1))
    return dict(fields)


@pytest.mark.parametrize("record", TAKEN, ids=label)
def test_what_waydrop_sends_is_what_px4_took(record: dict[str, Any]) -> None:
    ours, theirs = sent(record), dict(record["f"])
    if theirs.get("coordinate_frame") == SetpointFrame.GLOBAL_RELATIVE_ALT_INT:
        # the same place in the frame that was taken as well, and leaves no doubt which altitude is meant
        theirs |= {"coordinate_frame": SetpointFrame.GLOBAL_INT, "alt": theirs["alt"] + record["home_amsl_m"]}
    assert set(ours) - {"time_boot_ms"} == set(theirs)
    passed_over = {name for bit, names in GROUPS.items() if ours["type_mask"] & bit for name in names}
    if record["name"] == ATTITUDE:
        rates = {"body_roll_rate", "body_pitch_rate", "body_yaw_rate"}
        passed_over = (rates if ours["type_mask"] & 7 else set()) | ({"q"} if ours["type_mask"] & 128 else set())
    for name in set(theirs) - passed_over - {"target_system"}:
        assert ours[name] == pytest.approx(theirs[name], abs=2e-6), name


def test_a_field_that_is_passed_over_says_not_given_and_never_a_number_that_could_be_meant() -> None:
    """The recorder sent zeros there; a NaN was taken too [18: a NaN coordinate is accepted]."""
    for record in TAKEN:
        if record["name"] != ATTITUDE:
            ours = sent(record)
            over = {name for bit, names in GROUPS.items() if ours["type_mask"] & bit for name in names}
            assert {ours[name] for name in over if name in ours} <= {None}, label(record)


@pytest.mark.parametrize("record", [one for one in SETPOINTS if key(one) in NOT_FOLLOWED], ids=label)
def test_what_px4_took_and_did_not_follow_is_refused(record: dict[str, Any]) -> None:
    with pytest.raises(SetpointRefusedError) as refused:
        encode(human(record), follower(record))
    assert refused.value.refusal == NOT_FOLLOWED[key(record)]


def test_no_form_sends_what_px4_called_invalid() -> None:
    for record in (one for one in SETPOINTS if key(one) in REFUSED_BY_PX4):
        assert any("invalid" in text for text in record["said"]), label(record)
        name, frame, mask = record["name"], record["f"]["coordinate_frame"], record["f"]["type_mask"]
        forms = [one for one in WIRE_FORMS.values() if one.message == name]
        assert not [one for one in forms if (one.frame, one.type_mask) == (frame, mask)]


def test_the_recordings_have_a_verdict_each() -> None:
    assert {key(one) for one in TAKEN} | set(NOT_FOLLOWED) | REFUSED_BY_PX4 == {key(one) for one in SETPOINTS}
    assert all(not one["said"] for one in TAKEN)


def test_tasks_are_flown_with_forms_that_were_taken_and_followed() -> None:
    followed = {(KIND[one["model"]], one["f"].get("coordinate_frame"), one["f"]["type_mask"]) for one in TAKEN}
    for kind in KIND.values():
        for form in FORMS[kind]:
            assert (kind, WIRE_FORMS[form].frame, WIRE_FORMS[form].type_mask) in followed, (kind, form)


@pytest.mark.parametrize("mode", [FlightMode.OFFBOARD, FlightMode.HOLD, FlightMode.MISSION, FlightMode.LAND])
def test_modes_are_asked_for_as_they_were_granted(mode: FlightMode) -> None:
    request = command(MavCmd.DO_SET_MODE, 1, *mode_numbers(mode))
    fields = json.loads(CommandLong(request.command, request.params).fields_json(1, 1))
    granted = [one["f"] for one in MODES if one["ack"] == 0]
    same = ("command", "param1", "param2", "param3", "confirmation", "target_component")
    assert any(all(fields[name] == one[name] for name in same) for one in granted)
    assert [fields[f"param{number}"] for number in (4, 5, 6, 7)] == [None] * 4, "not given, and not used by DO_SET_MODE"


def test_the_mode_is_asked_for_after_a_stream_as_long_and_as_fast_as_one_that_was_granted() -> None:
    """Without a stream it is refused in the air: the entry streams first (see the tests of the passage)."""
    asked = [one for one in MODES if one["f"]["param2"] == 6 and one["model"] != "rover"]
    assert {one["ack"] for one in asked if one["stream_s"] == 0.0} == {1}
    shortest_s = min(one["stream_s"] for one in asked if one["ack"] == 0)
    assert OffboardSettings().stream_s >= shortest_s
    assert max(RECORDED_HZ.values()) <= SLOWEST_HZ
