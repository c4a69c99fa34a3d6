"""The simulated vehicles agree with recordings of a real PX4, and the comparison would notice if they did not."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from app.simulator.commander import Commander
from app.simulator.wire import Result
from tests.support.paths import DATA, ROOT
from tools.compare.__main__ import main
from tools.compare.judge import Judgement, compare, judge
from tools.compare.known import KNOWN
from tools.compare.replay import Replay
from tools.compare.report import lines
from tools.compare.trace import Dialogue, ReceivedMessage, Trace, read_trace, trace_files

TRACES = DATA / "traces"
PAGE = ROOT / "docs" / "reference" / "simulator.md"
PLANE, QUAD = "10_plane_delivery", "06_quad_delivery_default"
INFEASIBLE, UPLOAD, ROVER = "14b_infeasible_more", "02_upload_ok", "25_land_detector_rover"
PARAMETER = "17_gripper_commands"
SCENARIOS = [path.name.removesuffix(".jsonl.gz") for path in trace_files(TRACES)]


@cache
def trace(scenario: str) -> Trace:
    return read_trace(TRACES / f"{scenario}.jsonl.gz")


@cache
def flown(scenario: str) -> Dialogue:
    return Replay(trace(scenario)).run()


@cache
def judged(
    scenario: str, change: Callable[[ReceivedMessage], ReceivedMessage | None] = lambda received: received
) -> Judgement:
    """The recording against a simulated vehicle that speaks as `change` says; None: it keeps silent."""
    changed = (change(received) for received in flown(scenario).received)
    simulated = replace(flown(scenario), received=tuple(received for received in changed if received is not None))
    return judge(trace(scenario), simulated, [])


def other(received: ReceivedMessage, **fields: object) -> ReceivedMessage:
    return replace(received, fields={**received.fields, **fields})


def test_there_are_recordings() -> None:
    assert len(SCENARIOS) >= 20


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_page_tells_of_a_scenario_what_the_command_prints(scenario: str) -> None:
    told = PAGE.read_text(encoding="utf-8").splitlines()
    printed = [line for line in lines([judged(scenario)]) if line.startswith(f"{scenario} ")]
    assert printed
    assert [line for line in printed if line not in told] == [], "write what `python -m tools.compare` prints"


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_simulated_vehicle_answers_and_flies_as_the_recorded_one_did(scenario: str) -> None:
    assert [difference.what for difference in judged(scenario).differences if difference.reason is None] == []


@pytest.mark.parametrize(
    ("scenario", "aspects"),
    [
        (UPLOAD, {"mission protocol", "command acks", "mission_state"}),
        (INFEASIBLE, {"mission protocol", "command acks", "events", "status texts", "mission_state"}),
        (QUAD, {"vehicle's own commands", "vehicle's own commands: repeats"}),
        (QUAD, {"release", "mission items reached", "current mission item", "landed_state", "mode and arming"}),
        (PLANE, {"release", "mission items reached", "current mission item", "landed_state", "mode and arming"}),
        (ROVER, {"landed_state", "mode and arming"}),
    ],
)
def test_agreement_is_not_the_silence_of_a_judge(scenario: str, aspects: set[str]) -> None:
    assert aspects <= judged(scenario).aspects.keys()


def slower(received: ReceivedMessage) -> ReceivedMessage:
    return replace(received, t_s=received.t_s + 0.5) if received.name == "COMMAND_ACK" else received


def refusing(received: ReceivedMessage) -> ReceivedMessage:
    return (
        other(received, result=2) if received.name == "COMMAND_ACK" and received.fields["command"] == 300 else received
    )


def to_somebody_else(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, target_component=1) if received.name == "MISSION_ACK" else received


def without_item_2(received: ReceivedMessage) -> ReceivedMessage | None:
    return None if received.name == "MISSION_ITEM_REACHED" and received.fields["seq"] == 2 else received


def never_landing(received: ReceivedMessage) -> ReceivedMessage:
    lands = received.name == "EXTENDED_SYS_STATE" and received.fields["landed_state"] == 4
    return other(received, landed_state=2) if lands else received


def never_active(received: ReceivedMessage) -> ReceivedMessage:
    active = received.name == "MISSION_CURRENT" and received.fields["mission_state"] == 3
    return other(received, mission_state=2) if active else received


def without_gripper_command(received: ReceivedMessage) -> ReceivedMessage | None:
    gripper = received.name == "COMMAND_LONG" and received.fields["command"] == 211 and received.fields["target_system"]
    return None if gripper else received


def grabbing(received: ReceivedMessage) -> ReceivedMessage:
    return (
        other(received, param2=1.0)
        if received.name == "COMMAND_LONG" and received.fields["target_system"]
        else received
    )


def saying_it_once(received: ReceivedMessage) -> ReceivedMessage | None:
    return None if received.name == "COMMAND_LONG" and received.fields["confirmation"] else received


def late_command(received: ReceivedMessage) -> ReceivedMessage:
    first = received.name == "COMMAND_LONG" and not received.fields["confirmation"] and received.fields["command"] == 20
    return replace(received, t_s=received.t_s + 3.0) if first else received


def from_elsewhere(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, param7=received.fields["param7"] + 5.0) if received.name == "COMMAND_LONG" else received


def with_other_items(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, z=received.fields["z"] + 1.0) if received.name == "MISSION_ITEM_INT" else received


def without_holds(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, param1=7.0) if received.name == "MISSION_ITEM_INT" else received


def always_in_mission(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, mission_mode=1) if received.name == "MISSION_CURRENT" else received


def homeless(received: ReceivedMessage) -> ReceivedMessage | None:
    return None if received.name == "HOME_POSITION" else received


def at_home_elsewhere(received: ReceivedMessage) -> ReceivedMessage:
    return (
        other(received, longitude=received.fields["longitude"] + 400) if received.name == "HOME_POSITION" else received
    )


def at_home_higher(received: ReceivedMessage) -> ReceivedMessage:
    return other(received, altitude=received.fields["altitude"] + 700) if received.name == "HOME_POSITION" else received


def with_home_at_the_start(received: ReceivedMessage) -> ReceivedMessage | None:
    late = received.name == "HOME_POSITION" and received.t_s > 20.0
    return None if late else received


def speechless(received: ReceivedMessage) -> ReceivedMessage | None:
    return None if received.name in ("STATUSTEXT", "EVENT") else received


def elsewhere(received: ReceivedMessage) -> ReceivedMessage:
    """10 m further north."""
    return other(received, lat=received.fields["lat"] + 900) if received.name == "GLOBAL_POSITION_INT" else received


def higher(received: ReceivedMessage) -> ReceivedMessage:
    """By 3 m."""
    return (
        other(received, relative_alt=received.fields["relative_alt"] + 3000)
        if "relative_alt" in received.fields
        else received
    )


def late_release(received: ReceivedMessage) -> ReceivedMessage:
    return replace(received, t_s=received.t_s + 2.0) if received.name == "SERVO_OUTPUT_RAW" else received


def later_landing(received: ReceivedMessage) -> ReceivedMessage:
    return replace(received, t_s=received.t_s * 1.4) if received.name == "EXTENDED_SYS_STATE" else received


@pytest.mark.parametrize(
    ("change", "aspect"),
    [
        (slower, "command acks: times"),
        (refusing, "command acks"),
        (to_somebody_else, "mission protocol"),
        (without_item_2, "mission items reached"),
        (never_landing, "landed_state"),
        (never_active, "mission_state"),
        (without_gripper_command, "vehicle's own commands"),
        (grabbing, "vehicle's own commands"),
        (from_elsewhere, "vehicle's own commands"),
        (late_command, "vehicle's own commands: times"),
        (saying_it_once, "vehicle's own commands: repeats"),
        (elsewhere, "track"),
        (higher, "track"),
        (always_in_mission, "mission_mode"),
        (homeless, "home position"),
        (at_home_elsewhere, "home position"),
        (at_home_higher, "home position"),
        (speechless, "status texts"),
        (speechless, "events"),
        (elsewhere, "release"),
        (late_release, "release"),
        (later_landing, "landed_state: times"),
    ],
)
def test_a_vehicle_that_behaves_otherwise_is_caught(
    change: Callable[[ReceivedMessage], ReceivedMessage | None], aspect: str
) -> None:
    judgement = judged(QUAD, change)
    assert aspect in {difference.aspect for difference in judgement.differences}
    assert not judgement.agrees


@pytest.mark.parametrize("change", [with_other_items, without_holds])
def test_another_mission_than_the_one_sent_is_caught_on_its_download(
    change: Callable[[ReceivedMessage], ReceivedMessage | None],
) -> None:
    assert "mission protocol" in {difference.aspect for difference in judged(UPLOAD, change).differences}


def test_another_value_of_a_parameter_is_caught() -> None:
    def deaf(received: ReceivedMessage) -> ReceivedMessage:
        return other(received, param_value=0.0) if received.name == "PARAM_VALUE" else received

    assert "parameters" in {difference.aspect for difference in judged(PARAMETER, deaf).differences}


def test_a_home_that_stays_behind_is_caught() -> None:
    differences = judged(ROVER, with_home_at_the_start).differences
    assert {difference.aspect for difference in differences} == {"home position"}


def test_an_infeasible_mission_that_is_accepted_is_caught() -> None:
    def lenient(received: ReceivedMessage) -> ReceivedMessage:
        return other(received, mission_state=2) if received.name == "MISSION_CURRENT" else received

    assert "mission_state" in {difference.aspect for difference in judged(INFEASIBLE, lenient).differences}


def test_a_rover_that_refuses_to_be_disarmed_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Commander, "disarm", lambda self, force: Result.TEMPORARILY_REJECTED)
    judgement = compare(trace("13_rover_delivery"))
    assert {"command acks", "mode and arming", "landed_state"} <= {one.aspect for one in judgement.differences}
    assert not judgement.agrees


def test_the_replay_sends_what_the_recorded_ground_station_sent() -> None:
    def said(dialogue: Dialogue) -> list[tuple[str, object]]:
        return [(sent.name, sent.fields.get("seq")) for sent in dialogue.sent if sent.name != "HEARTBEAT"]

    assert said(flown(UPLOAD)) == said(trace(UPLOAD).dialogue)


def test_a_known_difference_has_a_reason_that_says_something() -> None:
    assert all(len(known.reason) > 20 for known in KNOWN)


def test_a_known_difference_of_one_scenario_excuses_no_other() -> None:
    known = next(known for known in KNOWN if known.scenario == "17_gripper_commands")
    assert not known.covers(QUAD, known.aspect, known.what)


def test_a_known_difference_that_is_over_is_named() -> None:
    gone = replace(judged(QUAD), scenario="17_gripper_commands")
    assert any("no longer seen" in line and "17_gripper_commands" in line for line in lines([gone]))
    assert not any("no longer seen" in line for line in lines([judged(QUAD)]))


def test_the_report_tells_where_each_release_was_and_how_fast() -> None:
    row = next(line for line in lines([judged(QUAD)]) if line.startswith(QUAD) and "m/s" in line)
    ours, theirs = judged(QUAD).releases[0]
    assert row.split()[1:3] == [f"{ours.distance_m:.1f}", "m"]
    assert f"{theirs.distance_m:.1f} m" in row
    assert row.count("m/s") == 2


def test_the_report_names_the_aspects_that_agree_and_no_other() -> None:
    judgement = judged(QUAD, refusing)
    assert "landed_state" in judgement.agreeing
    assert "command acks" not in judgement.agreeing
    count = f"{len(judgement.agreeing)} of {len(judgement.aspects)}"
    assert any(count in line for line in lines([judgement]) if line.startswith(QUAD))
    assert any(
        f"landed_state {judgement.aspects['landed_state']}," in line for line in lines([judgement], verbose=True)
    )


def test_the_command_prints_a_table_and_ends_with_0_when_all_agree(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(TRACES), "--only", "25"]) == 0
    assert "25_land_detector_rover" in capsys.readouterr().out


def test_the_command_ends_with_1_when_something_new_differs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded = gzip.decompress((TRACES / f"{ROVER}.jsonl.gz").read_bytes()).decode().splitlines()
    changed = [line.replace('"landed_state":2', '"landed_state":3') for line in recorded]
    (tmp_path / f"{ROVER}.jsonl").write_text("\n".join(changed))
    assert main([str(tmp_path)]) == 1
    assert "DIFFERS" in capsys.readouterr().out


@pytest.mark.parametrize("folder", ["empty", "missing"])
def test_the_command_ends_with_2_without_recordings(folder: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert main([str(tmp_path / folder)]) == 2


def test_the_whole_comparison_is_what_its_parts_say() -> None:
    assert compare(trace(ROVER)) == judged(ROVER)
