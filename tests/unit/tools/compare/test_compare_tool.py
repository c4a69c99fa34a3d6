"""The comparison reads every well-formed recording, flies it in its wind, and says what is missing where it is."""

from __future__ import annotations

import gzip
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.simulator.geo import LocalFrame
from app.simulator.wire import Cmd
from tools.compare.alignment import Verdict
from tools.compare.course import judge_home, judge_track
from tools.compare.judge import compare
from tools.compare.messages import judge_own_commands, judge_replies
from tools.compare.release import judge_releases, pair_releases, releases
from tools.compare.replay import Replay
from tools.compare.trace import Dialogue, ReceivedMessage, Sent, Trace, TraceError, read_trace

HOME = (47.397743, 8.545594, 489.0)
FRAME = LocalFrame(*HOME)
SERVO = "servo5_raw"
GROUND = (245, 190)
HEADER: dict[str, Any] = {
    "scenario": "x", "model": "quad", "speed_factor": 1, "params": {}, "home": list(HOME),
    "gripper_servo": SERVO, "vehicle_sysid": 1,
}  # fmt: skip


def recording(folder: Path, *lines: dict[str, Any], **header: object) -> Path:
    path = folder / "x.jsonl"
    path.write_text("\n".join(json.dumps(line) for line in ({**HEADER, **header}, *lines)))
    return path


def line(t_s: float, direction: str, name: str, **fields: object) -> dict[str, Any]:
    system, component = GROUND if direction == "tx" else (1, 1)
    return {
        "t": t_s, "vt_ms": 1000.0 * t_s, "dir": direction, "sys": system, "comp": component, "name": name, "f": fields,
    }  # fmt: skip


def clock_until(t_s: float) -> list[dict[str, Any]]:
    return [line(float(second), "rx", "SYSTEM_TIME") for second in range(int(t_s) + 1)]


def position(t_s: float, north_m: float, east_m: float = 0.0) -> ReceivedMessage:
    latitude, longitude = FRAME.to_global(north_m, east_m)
    fields = {"lat": round(latitude * 1e7), "lon": round(longitude * 1e7), "relative_alt": 0, "vx": 0, "vy": 0}
    return ReceivedMessage(t_s, "GLOBAL_POSITION_INT", fields)


def item(command: int, north_m: float, name: str = "MISSION_ITEM_INT") -> Sent:
    latitude, longitude = FRAME.to_global(north_m, 0.0)
    scale = 1e7 if name.endswith("INT") else 1.0
    fields = {"command": command, "x": latitude * scale, "y": longitude * scale}
    return Sent(
        0.0, name, fields if scale == 1.0 else {**fields, "x": round(fields["x"]), "y": round(fields["y"])}, GROUND
    )


def openings(places_m: Sequence[tuple[float, float]], *sent: Sent) -> Dialogue:
    """The gripper opens at each time and place."""
    received: list[ReceivedMessage] = []
    for t_s, north_m in places_m:
        received += [position(t_s - 0.1, north_m)]
        received += [
            ReceivedMessage(t_s - 0.1, "SERVO_OUTPUT_RAW", {SERVO: 2000}),
            ReceivedMessage(t_s, "SERVO_OUTPUT_RAW", {SERVO: 1000}),
        ]
    return Dialogue(sent, tuple(received))


def said(verdicts: Sequence[Verdict]) -> list[str]:
    return [what for verdict in verdicts for what in verdict.differences]


# wind ---------------------------------------------------------------------------------------------------------


def test_a_recording_is_flown_in_its_wind(tmp_path: Path) -> None:
    path = recording(tmp_path, *clock_until(1.0), params={"SIH_WIND_N": 3.0, "SIH_WIND_E": -4.0})
    replay = Replay(read_trace(path))
    replay.run()
    assert replay.wind_m_s == (3.0, -4.0)


# drop points --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command", [Cmd.NAV_WAYPOINT, Cmd.NAV_LOITER_TIME, Cmd.NAV_LOITER_TO_ALT, Cmd.NAV_LOITER_UNLIM, Cmd.NAV_LAND]
)
@pytest.mark.parametrize("name", ["MISSION_ITEM_INT", "MISSION_ITEM"])
def test_the_drop_point_is_the_last_place_before_the_gripper_item(command: int, name: str) -> None:
    gripper = Sent(0.0, name, {"command": Cmd.DO_GRIPPER, "x": 0, "y": 0}, GROUND)
    sent = (item(Cmd.NAV_TAKEOFF, 5.0, name), item(Cmd.NAV_WAYPOINT, 10.0, name), item(command, 100.0, name), gripper)
    (release,) = releases(openings([(10.0, 130.0)], *sent), FRAME, SERVO)
    assert release.distance_m == pytest.approx(30.0, abs=0.5)


def test_a_takeoff_is_no_drop_point() -> None:
    gripper = Sent(0.0, "MISSION_ITEM_INT", {"command": Cmd.DO_GRIPPER, "x": 0, "y": 0}, GROUND)
    sent = (item(Cmd.NAV_WAYPOINT, 100.0), item(Cmd.NAV_TAKEOFF, 0.0), gripper)
    (release,) = releases(openings([(10.0, 130.0)], *sent), FRAME, SERVO)
    assert release.distance_m == pytest.approx(30.0, abs=0.5)


# something missing --------------------------------------------------------------------------------------------


def test_a_missing_release_leaves_the_later_ones_with_their_own() -> None:
    recorded, simulated = (
        openings([(10.0, 0.0), (40.0, 200.0), (70.0, 400.0)]),
        openings([(40.0, 200.0), (70.0, 400.0)]),
    )
    assert said(list(judge_releases(recorded, simulated, FRAME, SERVO))) == ["missing: release at 10.0 s"]
    pairs = pair_releases(list(releases(recorded, FRAME, SERVO)), list(releases(simulated, FRAME, SERVO)))
    assert [(a.t_s, b.t_s) for a, b in pairs] == [(40.0, 40.0), (70.0, 70.0)]


def test_an_extra_release_is_named() -> None:
    recorded, simulated = openings([(40.0, 200.0)]), openings([(10.0, 0.0), (40.0, 200.0)])
    assert said(list(judge_releases(recorded, simulated, FRAME, SERVO))) == ["extra: release at 10.0 s"]


def test_as_many_releases_elsewhere_are_apart_and_not_missing() -> None:
    recorded, simulated = openings([(10.0, 0.0), (40.0, 200.0)]), openings([(10.0, 30.0), (40.0, 200.0)])
    (what,) = said(list(judge_releases(recorded, simulated, FRAME, SERVO)))
    assert what.startswith("30.0 m apart")


def homes(*places_m: tuple[float, float]) -> Dialogue:
    received = []
    for t_s, north_m in places_m:
        latitude, longitude = FRAME.to_global(north_m, 0.0)
        fields = {"latitude": round(latitude * 1e7), "longitude": round(longitude * 1e7), "altitude": 489000}
        received.append(ReceivedMessage(t_s, "HOME_POSITION", fields))
    return Dialogue((), tuple(received))


def test_a_missing_home_leaves_the_later_ones_with_their_own() -> None:
    recorded, simulated = homes((0.0, 0.0), (50.0, 100.0), (90.0, 300.0)), homes((0.0, 0.0), (90.0, 300.0))
    assert said(list(judge_home(recorded, simulated, FRAME))) == ["missing: home at 50.0 s"]


def along(reached: Sequence[tuple[float, int]], aside_m: float = 0.0) -> Dialogue:
    received = [ReceivedMessage(t_s, "MISSION_ITEM_REACHED", {"seq": seq}) for t_s, seq in reached for _ in range(3)]
    return Dialogue((), (*received, *(position(0.25 * n, 2.0 * n, aside_m) for n in range(200))))


def test_a_leg_is_compared_though_one_side_reports_no_arrival_in_it() -> None:
    recorded = along([(5.0, 0), (20.0, 1), (40.0, 2)])
    (verdict,) = judge_track(recorded, along([(5.0, 0), (40.0, 2)], aside_m=40.0), FRAME)
    assert any("40.0 m apart" in what for what in verdict.differences)


def own(t_s: float, confirmation: int) -> ReceivedMessage:
    numbers = {f"param{n}": 0.0 for n in range(1, 8)}
    target = {"target_system": 1, "target_component": 0}
    return ReceivedMessage(t_s, "COMMAND_LONG", {"command": 211, "confirmation": confirmation, **target, **numbers})


def test_a_missing_repeat_does_not_make_the_later_ones_late() -> None:
    recorded = Dialogue((), tuple(own(t, c) for t, c in [(10.0, 0), (12.0, 3), (50.0, 0), (52.0, 3)]))
    simulated = Dialogue((), tuple(own(t, c) for t, c in [(10.0, 0), (50.0, 0), (52.0, 3)]))
    differences = said(list(judge_own_commands(recorded, simulated)))
    assert len(differences) == 1
    assert "confirmation 3: 2 times, simulated 1" in differences[0]


# parameters ---------------------------------------------------------------------------------------------------

CHANNELS = {f"chan{n}_raw": 0 for n in range(1, 9)}
LIST = Sent(1.0, "PARAM_REQUEST_LIST", {"target_system": 1, "target_component": 1}, GROUND)


def told(**values: float) -> Dialogue:
    received = [
        ReceivedMessage(1.1, "PARAM_VALUE", {"param_id": name, "param_type": 9, "param_value": value})
        for name, value in values.items()
    ]
    return Dialogue((LIST,), tuple(received))


def test_of_a_parameter_list_what_both_have_is_compared() -> None:
    assert said(list(judge_replies(told(A=1.0, B=2.0, C=3.0), told(B=2.0, A=1.0)))) == []
    assert said(list(judge_replies(told(A=1.0, B=2.0), told(A=1.0, B=5.0)))) == [
        "B: 2 of type 9, simulated 5 of type 9"
    ]


def test_a_parameter_list_that_is_not_answered_is_missing() -> None:
    assert said(list(judge_replies(told(A=1.0), told()))) == ["PARAM_REQUEST_LIST is not answered"]
    assert said(list(judge_replies(told(A=1.0), told(Z=1.0)))) == ["extra: Z"]


def test_a_recording_with_a_parameter_list_is_replayed(tmp_path: Path) -> None:
    asked = line(2.0, "tx", "PARAM_REQUEST_LIST", target_system=1, target_component=1)
    answer = line(2.1, "rx", "PARAM_VALUE", param_id="NAV_ACC_RAD", param_type=9, param_value=99.0)
    judgement = compare(
        read_trace(recording(tmp_path, *clock_until(1.0), asked, answer, line(9.0, "rx", "SYSTEM_TIME")))
    )
    assert "NAV_ACC_RAD: 99 of type 9, simulated 10 of type 9" in [one.what for one in judgement.differences]


# well-formed recordings ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("NO_SUCH_MESSAGE", {"a": 1}),
        ("PARAM_REQUEST_READ", {"target_system": 1, "target_component": 1, "param_id": "", "param_index": 3}),
        ("COMMAND_ACK", {"command": 400, "result": 0, "a_field_of_tomorrow": 7}),
        ("MANUAL_CONTROL", {"target": 1, "x": 0, "y": 0, "z": 0, "r": 0, "buttons": 0}),
        ("RC_CHANNELS_OVERRIDE", {"target_system": 1, "target_component": 1, **CHANNELS}),
        ("TIMESYNC", {"tc1": 0, "ts1": 1}),
        ("LOG_REQUEST_LIST", {"target_system": 1, "target_component": 1, "start": 0, "end": 9}),
        ("PING", {"time_usec": 1, "seq": 0, "target_system": 0, "target_component": 0}),
        ("FILE_TRANSFER_PROTOCOL", {
            "target_network": 0, "target_system": 1, "target_component": 1, "payload": [0] * 251,
        }),
    ],
)  # fmt: skip
def test_whatever_was_sent_is_replayed(name: str, fields: dict[str, object], tmp_path: Path) -> None:
    trace = read_trace(recording(tmp_path, *clock_until(3.0), line(4.0, "tx", name, **fields)))
    compare(trace)


def test_a_message_that_cannot_be_sent_is_told(tmp_path: Path) -> None:
    lines = [*clock_until(3.0), line(4.0, "tx", "NO_SUCH_MESSAGE", a=1), line(5.0, "tx", "COMMAND_LONG", command=400)]
    differences = [one.what for one in compare(read_trace(recording(tmp_path, *lines))).differences]
    assert "not sent: NO_SUCH_MESSAGE" in differences
    assert "not sent: COMMAND_LONG" in differences


def test_a_release_without_a_position_is_no_crash() -> None:
    received = (
        ReceivedMessage(1.0, "SERVO_OUTPUT_RAW", {SERVO: 2000}),
        ReceivedMessage(2.0, "SERVO_OUTPUT_RAW", {SERVO: 1000}),
    )
    (release,) = releases(Dialogue((), received), FRAME, SERVO)
    assert math.isnan(release.north_m)
    again = replace(release, t_s=2.5)
    assert pair_releases([release], [again]) == [(release, again)]


def test_a_vehicle_without_a_gripper_releases_nothing() -> None:
    received = (ReceivedMessage(1.0, "SERVO_OUTPUT_RAW", {SERVO: 2000}),)
    assert list(releases(Dialogue((), received), FRAME, None)) == []


@pytest.mark.parametrize("text", ['{"t":1}\n"x"', '{"t":1}\n[]', '{"t":1}\n7'])
def test_a_line_that_is_no_object_is_refused_by_name(text: str, tmp_path: Path) -> None:
    path = recording(tmp_path)
    path.write_text(path.read_text() + "\n" + text.split("\n")[1])
    with pytest.raises(TraceError, match=r"x\.jsonl is no recording"):
        read_trace(path)


def test_a_cut_off_file_is_refused_by_name(tmp_path: Path) -> None:
    whole = gzip.compress(recording(tmp_path, *clock_until(60.0)).read_bytes())
    broken = (whole[: len(whole) // 2], whole[:20] + b"\xff" * 40 + whole[60:])
    for data in broken:
        path = tmp_path / "y.jsonl.gz"
        path.write_bytes(data)
        with pytest.raises(TraceError, match=r"y\.jsonl\.gz is no recording"):
            read_trace(path)


def test_an_unknown_vehicle_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="no simulated vehicle is a submarine"):
        read_trace(recording(tmp_path, model="submarine"))


def test_a_trace_keeps_no_gripper(tmp_path: Path) -> None:
    trace: Trace = read_trace(recording(tmp_path, gripper_servo=None))
    assert trace.gripper_servo is None
