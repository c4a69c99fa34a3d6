"""Whatever the document, there is a plan or a refusal with places in it; never a crash."""

from __future__ import annotations

import copy
import json
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.domain.items import FORMS
from app.domain.plan import Plan, PlanInvalid
from app.domain.validation.finding import Finding
from app.interchange.findings import ConversionFinding, ConversionRefused
from app.interchange.formats import convert_to_plan
from app.interchange.qgc_writer import qgc_document, qgc_text
from tests.support.interchange_files import Json, document, meaning, raw
from tests.support.plan_strategies import JSON_SCRAP

FILES = ["multicopter-delivery.plan", "vtol-delivery.plan", "fixed-wing-delivery.plan", "multicopter-patrol.plan"]
SLOW_DATA = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
_NUMBERS = st.one_of(
    st.sampled_from([0, -0.0, 1, -1, 0.5, 2, 3, 5, 90.0000001, 1e308, 2**53, 10**17]), st.integers(-400, 400), st.none()
)
_VALUES = st.one_of(_NUMBERS, _NUMBERS, st.booleans(), st.text(max_size=6), JSON_SCRAP)
_ITEMS = st.fixed_dictionaries(
    {
        "type": st.just("SimpleItem"),
        "autoContinue": st.just(True),
        "command": st.sampled_from([*FORMS, 189, 206, 112, 7]),
        "frame": st.sampled_from([0, 2, 3, 3, 3, 5, 6, 10]),
        "params": st.lists(_NUMBERS, min_size=7, max_size=7),
    },
    optional={
        "doJumpId": st.integers(0, 9),
        "waydrop": st.fixed_dictionaries(
            {},
            optional={
                "id": st.sampled_from(["a", "b", "item-2"]),
                "role": st.sampled_from(["speed", "cruise_speed", "wait"]),
                "fields": st.dictionaries(st.sampled_from(["hold_s", "mode", "speed_m_s", "x"]), _VALUES, max_size=2),
                "written": st.dictionaries(st.sampled_from(["hold_s", "duration_s"]), _NUMBERS, max_size=2),
            },
        ),
    },
)


@st.composite
def bent_files(draw: st.DrawFn) -> Json:
    """A good file with a few values replaced, taken away or repeated, or with items of any kind in it."""
    made = copy.deepcopy(document(draw(st.sampled_from(FILES))))
    if draw(st.booleans()):
        made["mission"]["items"][1:1] = draw(st.lists(_ITEMS, min_size=1, max_size=6))
        made["mission"]["vehicleType"] = draw(st.sampled_from([0, 1, 2, 7, 10, 22]))
    for _ in range(draw(st.integers(0, 3))):
        holder, key = draw(st.sampled_from(_places(made)))
        change = draw(st.sampled_from(["replace", "remove", "repeat"]))
        if change == "replace":
            holder[key] = draw(_VALUES)
        elif change == "remove":
            del holder[key]
        elif isinstance(holder, list):
            holder.append(copy.deepcopy(holder[key]))
    return made


@st.composite
def files_of_items(draw: st.DrawFn) -> Json:
    """A good file whose items are others, of values that mostly can be used."""
    made = copy.deepcopy(document("multicopter-delivery.plan"))
    items = draw(st.lists(_GOOD_ITEMS, min_size=1, max_size=4))
    made["mission"]["items"] = [{**item, "doJumpId": number} for number, item in enumerate(items, start=1)]
    made["mission"]["vehicleType"] = draw(st.sampled_from([1, 2, 10, 22]))
    return made


def _good_item(command: int, params: list[Any], place: list[float]) -> Json:
    """Parameters that the command does not use are 0: what they said would be lost."""
    used, positioned = FORMS[command].used(), FORMS[command].positioned
    own = [value if number in used else 0 for number, value in enumerate(params, start=1)]
    values = [*own, *(place if positioned else [0, 0, 0])]
    frame = 3 if positioned else 2
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": values}


_GOOD_ITEMS = st.builds(
    _good_item,
    st.sampled_from([command for command in FORMS if command not in (211, 42600)]),
    st.lists(st.sampled_from([0, 1, 2, 3, 4, -1, 30, None]), min_size=4, max_size=4),
    st.tuples(st.floats(47, 48), st.floats(8, 9), st.floats(0, 50)).map(list),
)


def _places(node: Any) -> list[tuple[Any, Any]]:
    """(holder, key) of every value in the document."""
    keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
    return [pair for key in keys for pair in [(node, key), *_places(node[key])]]


def answer(content: bytes) -> tuple[Plan | None, tuple[Finding | ConversionFinding, ...]]:
    """The plan and what was found, or None and why not."""
    try:
        conversion = convert_to_plan(content)
    except (ConversionRefused, PlanInvalid) as refused:
        return None, refused.findings
    return conversion.plan, conversion.findings


def answered(content: bytes) -> tuple[Finding | ConversionFinding, ...]:
    """There is an answer, and a plan comes back equal."""
    plan, findings = answer(content)
    assert plan is not None or findings
    assert all(finding.code and finding.message for finding in findings)
    if plan is not None:
        assert convert_to_plan(qgc_text(plan)[0].encode()).plan == plan
    return findings


@settings(SLOW_DATA, max_examples=250)
@given(bent_files())
def test_a_bent_plan_file_gets_an_answer_with_places_and_what_is_read_comes_back_equal(made: Json) -> None:
    for finding in answered(json.dumps(made).encode()):
        assert _leads_somewhere(made, finding.pointer), finding


@settings(SLOW_DATA)
@given(files_of_items())
def test_where_nothing_is_found_the_export_means_what_the_file_meant(made: Json) -> None:
    plan, findings = answer(json.dumps(made).encode())
    if plan is not None and not findings:
        assert meaning(qgc_document(plan)[0]) == meaning(made)


def _leads_somewhere(node: Any, pointer: str) -> bool:
    """Down to the last part, which may be what is missing."""
    *path, _ = pointer.split("/")[1:] or [""]
    for part in path:
        name = part.replace("~1", "/").replace("~0", "~")
        if isinstance(node, list):
            node = node[int(name)]
        elif isinstance(node, dict) and name in node:
            node = node[name]
        else:
            return False
    return True


@settings(SLOW_DATA)
@given(st.binary(max_size=300) | st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_get_an_answer(content: bytes) -> None:
    answered(content)


@settings(SLOW_DATA)
@given(st.lists(st.text("0123456789.-+e \tnaQ", max_size=40), max_size=6), st.integers(0, 600), st.binary(max_size=3))
def test_a_bent_waypoint_file_gets_an_answer(lines: list[str], place: int, junk: bytes) -> None:
    good = raw("mission-planner.waypoints")
    answered(good[:place] + junk + good[place:])
    answered("\n".join(["QGC WPL 110", *lines]).encode())
