"""Laws that hold for every plan, sensible or not."""

from __future__ import annotations

import contextlib
import json
import math
from types import MappingProxyType
from typing import Any

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from app.domain.autopilot.declared import default_facts
from app.domain.errors import PlanRejectedError
from app.domain.items import Gripper, Winch
from app.domain.mission import MavCmd, MavFrame, Mission
from app.domain.plan import Plan, PlanInvalid, parse_plan, plan_hash
from app.domain.plan.compiler import compile_plan
from app.domain.prediction import predict
from app.domain.rules import check_plan
from app.domain.validation.finding import Finding, Severity
from tests.support.plan_strategies import (
    JSON_SCRAP,
    PLANS,
    damaged_documents,
    plan_documents,
    sensible_plans,
    vehicle_facts,
)

SLOW_DATA = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
RELEASES = (MavCmd.DO_GRIPPER, MavCmd.DO_WINCH)
# What PX4 v1.18 takes: the commands with a position, those without, and the parameters that each may use.
POSITION_COMMANDS = {16, 17, 19, 21, 22, 31, 84, 85}
OTHER_COMMANDS = {20, 93, 177, 178, 189, 211, 3000, 42600}
USED_PARAMS: dict[int, tuple[int, ...]] = {16: (1, 2, 4), 22: (1, 4), 21: (1, 2, 4), 211: (1, 2), 20: ()}


@SLOW_DATA
@given(PLANS)
def test_what_is_written_is_read_again(plan: Plan) -> None:
    again = parse_plan(plan.model_dump_json())
    assert again == plan
    assert plan_hash(again) == plan_hash(plan)


@SLOW_DATA
@given(PLANS, st.data())
def test_every_plan_is_checked_compiled_and_predicted_without_a_crash(plan: Plan, data: st.DataObject) -> None:
    facts = data.draw(st.none() | vehicle_facts(plan.vehicle_type))
    for finding in check_plan(plan, facts):
        assert _resolves(finding.pointer, plan.model_dump(mode="json"))
    known = facts or default_facts(plan.vehicle_type)
    timeline = predict(plan, known)
    assert math.isfinite(timeline.duration_s)
    assert timeline.duration_s >= 0
    with contextlib.suppress(PlanRejectedError):
        assert compile_plan(plan, known).items


@SLOW_DATA
@given(sensible_plans())
def test_an_accepted_plan_compiles_to_items_that_a_vehicle_can_take(plan: Plan) -> None:
    assume(not _has_errors(plan))
    mission = compile_plan(plan, default_facts(plan.vehicle_type))
    assert [item.seq for item in mission.items] == list(range(len(mission.items)))
    assert [item.current for item in mission.items] == [True] + [False] * (len(mission.items) - 1)
    for item in mission.items:
        positioned = item.frame in (MavFrame.GLOBAL_INT, MavFrame.GLOBAL_RELATIVE_ALT_INT)
        assert positioned != (item.frame is MavFrame.MISSION)
        assert item.command in (POSITION_COMMANDS if positioned else OTHER_COMMANDS)
        used = USED_PARAMS.get(item.command, (1, 2, 3, 4))
        params = enumerate((item.param1, item.param2, item.param3, item.param4), start=1)
        assert all(math.isnan(value) or value == 0 for number, value in params if number not in used)
        assert not (item.command in RELEASES and math.isnan(item.param2)), "NaN would be read as RELEASE"


@SLOW_DATA
@given(sensible_plans())
def test_ids_and_numbers_map_both_ways(plan: Plan) -> None:
    assume(not _has_errors(plan))
    mission = compile_plan(plan, default_facts(plan.vehicle_type))
    ids = [item.id for item in plan.items]
    ids += [item.alternate.id for item in plan.items if isinstance(item, Gripper) and item.alternate]
    assert len(set(ids)) == len(ids)
    assert set(mission.plan_item_of) == set(range(len(mission.items)))
    assert sorted(seq for item_id in ids for seq in mission.seqs_of(item_id)) == list(range(len(mission.items)))
    without = {item_id for item_id in ids if not mission.seqs_of(item_id)}
    assert without <= {drop.plan_item_id for drop in mission.drops if drop.supervised}


@SLOW_DATA
@given(sensible_plans())
def test_every_drop_of_an_accepted_plan_can_be_carried_out(plan: Plan) -> None:
    assume(not _has_errors(plan))
    mission = compile_plan(plan, default_facts(plan.vehicle_type))
    no_drops = ("grab", "lock", "hold", "retract", "load_line", "load_payload")
    drops = [item.id for item in plan.items if isinstance(item, Gripper | Winch) and item.action not in no_drops]
    assert [drop.plan_item_id for drop in mission.drops] == drops
    for drop in mission.drops:
        assert 0 <= max(drop.hold_seqs) < drop.resume_seq < len(mission.items)
        _assert_carried_out(mission, drop.supervised, drop.stopped, drop.resume_seq, drop.release_seq)


@SLOW_DATA
@given(sensible_plans())
def test_the_predicted_order_is_the_plans_and_every_drop_is_predicted(plan: Plan) -> None:
    timeline = predict(plan, default_facts(plan.vehicle_type))
    assert list(timeline.order) == [item.id for item in plan.items]
    assert [drop.item_id for drop in timeline.drops] == [item.id for item in plan.items if item.type == "gripper"]
    assert [entry.start_s for entry in timeline.entries] == sorted(entry.start_s for entry in timeline.entries)


@SLOW_DATA
@given(sensible_plans())
def test_most_sensible_plans_are_accepted_or_say_why_not(plan: Plan) -> None:
    allowed = {"fixed_wing.glide_too_steep", "drop.offset_not_reachable"}
    assert {finding.code for finding in check_plan(plan, None) if finding.severity is Severity.ERROR} <= allowed


@given(st.binary(max_size=200) | st.text(max_size=200))
def test_no_bytes_raise_anything_but_plan_invalid(raw: bytes | str) -> None:
    _read_or_refuse(raw)


@given(JSON_SCRAP)
def test_no_json_raises_anything_but_plan_invalid(value: Any) -> None:
    _read_or_refuse(json.dumps(value))
    _read_or_refuse(value if isinstance(value, dict) else {"items": value})


@settings(max_examples=500, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(damaged_documents())
def test_five_hundred_damaged_plans_get_an_answer_each(document: dict[str, Any]) -> None:
    _read_or_refuse(document)
    _read_or_refuse(json.dumps(document))


@settings(max_examples=300, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(plan_documents() | damaged_documents())
def test_a_document_is_read_alike_at_once_and_in_search_of_faults(document: dict[str, Any]) -> None:
    thoroughly = _answer(MappingProxyType(document))  # what no JSON reader makes is never read at once
    assert _answer(document) == thoroughly
    assert _answer(json.dumps(document))[0] == thoroughly[0]


def _read_or_refuse(raw: Any) -> None:
    plan, findings = _answer(raw)
    assert (plan is None) == bool(findings)
    if plan is not None:
        check_plan(plan, None)
    for finding in findings:
        assert finding.code.startswith("plan.")
        json.dumps(finding.model_dump(mode="json"), ensure_ascii=False).encode("utf-8")


def _answer(raw: Any) -> tuple[Plan | None, tuple[Finding, ...]]:
    try:
        return parse_plan(raw), ()
    except PlanInvalid as refused:
        return None, refused.findings


def _has_errors(plan: Plan) -> bool:
    return any(finding.severity is Severity.ERROR for finding in check_plan(plan, None))


def _resolves(pointer: str, document: Any) -> bool:
    for part in pointer.split("/")[1:]:
        document = document[int(part)] if isinstance(document, list) else document[part]
    return True


def _assert_carried_out(
    mission: Mission, supervised: bool, stopped: bool, resume_seq: int, release_seq: int | None
) -> None:
    assert mission.items[resume_seq].command not in RELEASES
    if supervised:
        assert stopped
        assert release_seq is None
    else:
        assert release_seq is not None
        assert mission.items[release_seq].command in RELEASES
