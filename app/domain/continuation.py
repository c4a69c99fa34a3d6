"""What is left to fly of a plan that is changed in flight: a mission that begins with the item to go on with.

PX4 flies an upload from its first item as soon as the last one has come (px4-traces 15). So the rest is all that is
sent: whenever the link dies, the vehicle flies either what it flew or what it was meant to fly next, and no item of a
drop that is over is on board any more.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from app.domain.carried import Carried
from app.domain.errors import PlanRejectedError
from app.domain.finding import Finding, Severity, json_pointer
from app.domain.items import PlanItem
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step, reference_home, walk
from app.domain.speeds import asked_speed_m_s


@dataclass(frozen=True, slots=True)
class Flown:
    """How far a flight is. `plan` is what it flies now, `passed` the items passed, in order, `current` the item now
    flown, `concluded` the drops that must never be visited again: released, or nobody knows.
    """

    plan: Plan
    passed: Sequence[str]
    current: str | None
    concluded: Collection[str]


@dataclass(frozen=True, slots=True)
class Rest:
    """`plan` has only what is left: from `begins_at` on, without the drops in `left_out`."""

    plan: Plan
    begins_at: str
    left_out: tuple[str, ...]


def rest_of(plan: Plan, continue_at: str, concluded: Collection[str]) -> Rest:
    """The rest of a plan from an item on. A drop or a delay begins with the position item at which it belongs.

    Raises PlanRejectedError if nothing is left, or the plan has no such item.
    """
    begin = _first_open(plan, continue_at, concluded)
    if begin is None:
        raise _refused(plan, continue_at, "change.nothing_left", f"nothing is left to fly from {continue_at} on", "")
    step = walk(plan, reference_home(plan, None))[begin]
    items = [item for item in plan.items[begin:] if item.id not in concluded]
    if step.item.needs_stop and step.anchor is not None:
        items.insert(0, plan.items[step.anchor])
    left_out = tuple(item.id for item in plan.items[plan.index_of(continue_at) :] if item.id in concluded)
    return Rest(plan.model_copy(update={"items": tuple(items)}), items[0].id, left_out)


def continued(
    flown: Flown, changed: Plan, continue_at: str | None, carried: Carried, needed: Collection[str] = ()
) -> Rest:
    """The rest of a changed plan for a flight that is under way. None continues at the item now flown.

    `needed` are items that must be among what is left.

    Raises PlanRejectedError whose findings point into the changed plan.
    """
    wanted = continue_at if continue_at is not None else flown.current
    findings = list(_altered(flown, changed))
    if wanted is None or changed.index_of(wanted) is None:
        what = "no item is known to be flown now" if wanted is None else f"the plan has no item {wanted}"
        findings.append(_finding("change.continue_at_unknown", "", what, "say with continue_at where it goes on"))
    elif continue_at is not None and continue_at in flown.concluded:
        message = f"the drop {continue_at} is over: it is never visited again"
        findings.append(_at(changed, continue_at, "change.drop_concluded", message, "continue at a later item"))
    if findings or wanted is None:
        raise _rejected(findings)
    rest = rest_of(changed, wanted, flown.concluded)
    if findings := [
        *_passed(changed, rest, needed),
        *begun_loops(flown.passed, changed, rest),
        *_misfits(changed, rest, carried),
    ]:
        raise _rejected(findings)
    return rest


def asked_speed_before(plan: Plan, item_id: str, carried: Carried) -> float | None:
    """The speed in m/s that the plan asked for before an item; a new mission must ask for it again."""
    index = plan.index_of(item_id) or 0
    return asked_speed_m_s(plan, walk(plan, reference_home(plan, None))[:index], carried)


def in_whole_plan(finding: Finding, rest: Plan, whole: Plan) -> Finding:
    """A finding about the rest, with its pointer into the whole plan."""
    parts = finding.pointer.split("/")
    if len(parts) < 3 or parts[1] != "items":
        return finding
    index = whole.index_of(rest.items[int(parts[2])].id)
    return finding.model_copy(update={"pointer": "/".join(["", "items", str(index), *parts[3:]])})


def _first_open(plan: Plan, continue_at: str, concluded: Collection[str]) -> int | None:
    """The index to begin at: where it is, or behind a drop that is over."""
    begin = plan.index_of(continue_at)
    while begin is not None and begin < len(plan.items):
        if plan.items[begin].id not in concluded:
            return begin
        begin += 1
    return None


def _altered(flown: Flown, changed: Plan) -> Iterator[Finding]:
    """What has happened cannot be written anew, and what the vehicle is bounded by stays as it was uploaded."""
    if changed.vehicle_type is not flown.plan.vehicle_type:
        message = f"the run's plan is for a {flown.plan.vehicle_type}"
        yield _finding("change.vehicle_type", "/vehicle_type", message, "")
    hint = "change only items that are not flown yet; fence and rally points stay those of the run"
    if changed.geofence != flown.plan.geofence:
        yield _finding("change.fence_altered", "/geofence", "the fence differs from the run's", hint)
    if changed.rally_points != flown.plan.rally_points:
        yield _finding("change.fence_altered", "/rally_points", "the rally points differ from the run's", hint)
    for item_id in dict.fromkeys([*flown.passed, *flown.concluded]):
        before, after = _item(flown.plan, item_id), _item(changed, item_id)
        if before is not None and after is None:
            yield _finding("change.flown_item", "/items", f"{item_id} was flown, and is missing", hint)
        elif before is not None and after != before:
            yield _at(changed, item_id, "change.flown_item", f"{item_id} was flown, and is another item now", hint)


def _passed(changed: Plan, rest: Rest, needed: Collection[str]) -> Iterator[Finding]:
    left = {item.id for item in rest.plan.items}
    for item_id in needed:
        if item_id not in left:
            message = f"the flight is past the place of {item_id}: it would never be flown"
            yield _at(changed, item_id, "change.item_passed", message, "put it behind the item that is flown now")


def begun_loops(passed: Collection[str], changed: Plan, rest: Rest) -> Iterator[Finding]:
    """A jump leads back: never out of the rest, nor into a loop of which some turns were flown."""
    left = {item.id for item in rest.plan.items}
    for index, item in enumerate(changed.items):
        back_to = item.jumps_to()
        if back_to is None or item.id not in left:
            continue
        target = changed.index_of(back_to)
        loop = changed.items[target:index] if target is not None else ()
        if back_to not in left or any(inner.id in passed for inner in loop):
            message = f"the jump leads back to {back_to}, and that loop was begun"
            hint = "continue behind the jump, and write out the turns that are left"
            yield _at(changed, item.id, "change.loop_begun", message, hint)


def _misfits(changed: Plan, rest: Rest, carried: Carried) -> Iterator[Finding]:
    step = _step(changed, rest.begins_at)
    if any(item.takes_off for item in rest.plan.items):
        message = "the vehicle is in the air: it does not take off again"
        yield _at(changed, rest.begins_at, "change.takeoff", message, "continue behind the takeoff")
    elif step.item.transition_to() is None and step.before is not carried is not Carried.GROUND:
        if step.before is Carried.GROUND:
            return  # behind a landing on the way: in the air it is flown to all the same
        message = f"the plan flies {rest.begins_at} by {step.before}, and the vehicle flies by {carried}"
        yield _at(changed, rest.begins_at, "change.flight_differs", message, "continue at the transition before it")


def _step(plan: Plan, item_id: str) -> Step:
    return next(step for step in walk(plan, reference_home(plan, None)) if step.item.id == item_id)


def _item(plan: Plan, item_id: str) -> PlanItem | None:
    index = plan.index_of(item_id)
    return None if index is None else plan.items[index]


def _finding(code: str, pointer: str, message: str, hint: str) -> Finding:
    return Finding(code=code, severity=Severity.ERROR, pointer=pointer, message=message, hint=hint)


def _at(plan: Plan, item_id: str, code: str, message: str, hint: str) -> Finding:
    index = plan.index_of(item_id)
    pointer = "" if index is None else json_pointer("items", index)
    return _finding(code, pointer, message, hint).model_copy(update={"item_id": item_id})


def _refused(plan: Plan, item_id: str, code: str, message: str, hint: str) -> PlanRejectedError:
    return _rejected([_at(plan, item_id, code, message, hint)])


def _rejected(findings: Sequence[Finding]) -> PlanRejectedError:
    return PlanRejectedError(
        f"the flight cannot go on with this plan: {findings[0].message}",
        hint=findings[0].hint,
        findings=[finding.model_dump(mode="json") for finding in findings],
    )
