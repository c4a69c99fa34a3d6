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
from tools.compare.trace import Dialogue, Heard, Trace, read_trace, trace_files

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


def judged(scenario: str, change: Callable[[Heard], Heard | None] = lambda heard: heard) -> Judgement:
    """The recording against a simulated vehicle that speaks as `change` says; None: it keeps silent."""
    changed = (change(heard) for heard in flown(scenario).heard)
    simulated = replace(flown(scenario), heard=tuple(heard for heard in changed if heard is not None))
    return judge(trace(scenario), simulated, [])


def other(heard: Heard, **fields: object) -> Heard:
    return replace(heard, fields={**heard.fields, **fields})


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


def slower(heard: Heard) -> Heard:
    return replace(heard, t_s=heard.t_s + 0.5) if heard.name == "COMMAND_ACK" else heard


def refusing(heard: Heard) -> Heard:
    return other(heard, result=2) if heard.name == "COMMAND_ACK" and heard.fields["command"] == 300 else heard


def to_somebody_else(heard: Heard) -> Heard:
    return other(heard, target_component=1) if heard.name == "MISSION_ACK" else heard


def without_item_2(heard: Heard) -> Heard | None:
    return None if heard.name == "MISSION_ITEM_REACHED" and heard.fields["seq"] == 2 else heard


def never_landing(heard: Heard) -> Heard:
    lands = heard.name == "EXTENDED_SYS_STATE" and heard.fields["landed_state"] == 4
    return other(heard, landed_state=2) if lands else heard


def never_active(heard: Heard) -> Heard:
    active = heard.name == "MISSION_CURRENT" and heard.fields["mission_state"] == 3
    return other(heard, mission_state=2) if active else heard


def without_gripper_command(heard: Heard) -> Heard | None:
    gripper = heard.name == "COMMAND_LONG" and heard.fields["command"] == 211 and heard.fields["target_system"]
    return None if gripper else heard


def grabbing(heard: Heard) -> Heard:
    return other(heard, param2=1.0) if heard.name == "COMMAND_LONG" and heard.fields["target_system"] else heard


def saying_it_once(heard: Heard) -> Heard | None:
    return None if heard.name == "COMMAND_LONG" and heard.fields["confirmation"] else heard


def late_command(heard: Heard) -> Heard:
    first = heard.name == "COMMAND_LONG" and not heard.fields["confirmation"] and heard.fields["command"] == 20
    return replace(heard, t_s=heard.t_s + 3.0) if first else heard


def from_elsewhere(heard: Heard) -> Heard:
    return other(heard, param7=heard.fields["param7"] + 5.0) if heard.name == "COMMAND_LONG" else heard


def with_other_items(heard: Heard) -> Heard:
    return other(heard, z=heard.fields["z"] + 1.0) if heard.name == "MISSION_ITEM_INT" else heard


def without_holds(heard: Heard) -> Heard:
    return other(heard, param1=7.0) if heard.name == "MISSION_ITEM_INT" else heard


def always_in_mission(heard: Heard) -> Heard:
    return other(heard, mission_mode=1) if heard.name == "MISSION_CURRENT" else heard


def homeless(heard: Heard) -> Heard | None:
    return None if heard.name == "HOME_POSITION" else heard


def at_home_elsewhere(heard: Heard) -> Heard:
    return other(heard, longitude=heard.fields["longitude"] + 400) if heard.name == "HOME_POSITION" else heard


def at_home_higher(heard: Heard) -> Heard:
    return other(heard, altitude=heard.fields["altitude"] + 700) if heard.name == "HOME_POSITION" else heard


def with_home_at_the_start(heard: Heard) -> Heard | None:
    late = heard.name == "HOME_POSITION" and heard.t_s > 20.0
    return None if late else heard


def speechless(heard: Heard) -> Heard | None:
    return None if heard.name in ("STATUSTEXT", "EVENT") else heard


def elsewhere(heard: Heard) -> Heard:
    """10 m further north."""
    return other(heard, lat=heard.fields["lat"] + 900) if heard.name == "GLOBAL_POSITION_INT" else heard


def higher(heard: Heard) -> Heard:
    """By 3 m."""
    return other(heard, relative_alt=heard.fields["relative_alt"] + 3000) if "relative_alt" in heard.fields else heard


def late_release(heard: Heard) -> Heard:
    return replace(heard, t_s=heard.t_s + 2.0) if heard.name == "SERVO_OUTPUT_RAW" else heard


def later_landing(heard: Heard) -> Heard:
    return replace(heard, t_s=heard.t_s * 1.4) if heard.name == "EXTENDED_SYS_STATE" else heard


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
def test_a_vehicle_that_behaves_otherwise_is_caught(change: Callable[[Heard], Heard | None], aspect: str) -> None:
    judgement = judged(QUAD, change)
    assert aspect in {difference.aspect for difference in judgement.differences}
    assert not judgement.agrees


@pytest.mark.parametrize("change", [with_other_items, without_holds])
def test_another_mission_than_the_one_sent_is_caught_on_its_download(change: Callable[[Heard], Heard | None]) -> None:
    assert "mission protocol" in {difference.aspect for difference in judged(UPLOAD, change).differences}


def test_another_value_of_a_parameter_is_caught() -> None:
    def deaf(heard: Heard) -> Heard:
        return other(heard, param_value=0.0) if heard.name == "PARAM_VALUE" else heard

    assert "parameters" in {difference.aspect for difference in judged(PARAMETER, deaf).differences}


def test_a_home_that_stays_behind_is_caught() -> None:
    differences = judged(ROVER, with_home_at_the_start).differences
    assert {difference.aspect for difference in differences} == {"home position"}


def test_an_infeasible_mission_that_is_accepted_is_caught() -> None:
    def lenient(heard: Heard) -> Heard:
        return other(heard, mission_state=2) if heard.name == "MISSION_CURRENT" else heard

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
