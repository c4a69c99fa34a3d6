"""The remainder of a plan: in flight, after a change; on the ground, after a run that has ended."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from app.domain.drop.record import DropOutcome
from app.domain.errors import (
    ChangeUnderWayError,
    NoRemainingItemsError,
    PlanRejectedError,
    RunContinuedError,
    RunNotOverError,
)
from app.domain.items import ChangeSpeed, PlanItem, Transition
from app.domain.plan import parse_plan
from app.domain.plan.document import Plan
from app.domain.plan.walk import Step, asked_speed_m_s, reference_home, walk
from app.domain.run.run import Run, RunState
from app.domain.validation.finding import Finding, Severity, json_pointer
from app.domain.vehicle.state import FlightRegime

# The remainder of a plan that is changed in flight: a mission that begins with the item to continue with.
#
# PX4 flies an upload from its first item as soon as the last one has come (recording 15). So the rest is all that is
# sent: whenever the link dies, the vehicle flies either what it flew or what it was meant to fly next, and no item of
# a drop that is over is on board any more.


@dataclass(frozen=True, slots=True)
class Flown:
    """The progress of a flight. `plan` is the plan that it flies, `passed` the items passed, in order, `current` the
    current item, `concluded` the drops that must never be visited again: released or unknown.
    """

    plan: Plan
    passed: Sequence[str]
    current: str | None
    concluded: Collection[str]


@dataclass(frozen=True, slots=True)
class RemainingMission:
    """`plan` has only what is left: from `begins_at` on, without the drops in `omitted`."""

    plan: Plan
    begins_at: str
    omitted: tuple[str, ...]


def rest_of(plan: Plan, continue_at: str, concluded: Collection[str]) -> RemainingMission:
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
    omitted = tuple(item.id for item in plan.items[plan.index_of(continue_at) :] if item.id in concluded)
    return RemainingMission(plan.model_copy(update={"items": tuple(items)}), items[0].id, omitted)


def continued(
    flown: Flown, changed: Plan, continue_at: str | None, carried: FlightRegime, needed: Collection[str] = ()
) -> RemainingMission:
    """Return the remainder of a changed plan for a flight in progress. None continues with the current item.

    `needed` are items that must be in the remainder.

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


def asked_speed_before(plan: Plan, item_id: str, carried: FlightRegime) -> float | None:
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
        message = f"the run's plan is for {flown.plan.vehicle_type.noun}"
        yield _finding("change.vehicle_type", "/vehicle_type", message, "keep the vehicle type of the run")
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


def _passed(changed: Plan, rest: RemainingMission, needed: Collection[str]) -> Iterator[Finding]:
    left = {item.id for item in rest.plan.items}
    for item_id in needed:
        if item_id not in left:
            message = f"the flight is past the place of {item_id}: it would never be flown"
            yield _at(changed, item_id, "change.item_passed", message, "put it behind the item that is flown now")


def begun_loops(passed: Collection[str], changed: Plan, rest: RemainingMission) -> Iterator[Finding]:
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


def _misfits(changed: Plan, rest: RemainingMission, carried: FlightRegime) -> Iterator[Finding]:
    step = _step(changed, rest.begins_at)
    if any(item.takes_off for item in rest.plan.items):
        message = "the vehicle is in the air: it does not take off again"
        yield _at(changed, rest.begins_at, "change.takeoff", message, "continue behind the takeoff")
    elif step.item.transition_to() is None and step.before is not carried is not FlightRegime.GROUND:
        if step.before is FlightRegime.GROUND:
            return  # after an intermediate landing: in the air it is flown nevertheless
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


# The remainder of a run that has ended, as a plan of its own for a vehicle on the ground.
#
# The vehicle may have a new battery or have rebooted, and it may be anywhere: it takes off as the plan says, and
# continues with the first item that was not flown. A drop that has ended is never repeated.


def refuse_continued(run: Run, *, is_ending: bool) -> None:
    """`is_ending`: its end is being recorded.

    Raises RunNotOverError, RunContinuedError, NoRemainingItemsError, ChangeUnderWayError.
    """
    if is_ending or not run.is_over:
        raise RunNotOverError(
            f"run {run.id} is {run.state.value}: only a run that is over is continued",
            hint="in flight change its mission; on the ground wait for its end, or abort it",
            state=run.state.value,
        )
    if run.continued_by is not None:
        raise RunContinuedError(
            f"run {run.id} was continued by run {run.continued_by}: a second time could deliver a parcel twice",
            hint="if that run ended early too, continue that one",
            continued_by=run.continued_by,
        )
    if run.state is RunState.COMPLETED:
        raise _nothing_left(run)
    if run.changing is not None:
        raise ChangeUnderWayError(
            "the run ended while its mission was changed: nobody knows which of the two was flown",
            hint="find out where the parcels are, and post a plan of what is left",
        )


def tail_of(run: Run, plan: Plan, continue_at: str | None = None) -> Plan:
    """The rest of the plan that the run flew last, behind the last item done or from `continue_at` on.

    It begins with the plan's takeoff, and asks for the speeds that were in force.

    Raises NoRemainingItemsError; PlanRejectedError whose findings point into the run's plan.
    """
    over = drops_over(run)
    if continue_at is not None:
        _refuse_place(plan, continue_at, over)
    begin = continue_at if continue_at is not None else _first_left(run, plan, over)
    if begin is None:
        raise _nothing_left(run)
    try:
        rest = rest_of(plan, begin, over)
    except PlanRejectedError as error:  # the only reason: all remaining drops have ended
        raise _nothing_left(run) from error
    if loops := tuple(begun_loops(_flown_since(run), plan, rest)):
        raise _tail_rejected(loops)
    return _from_the_ground(run, plan, rest)


def drops_over(run: Run) -> frozenset[str]:
    """The drops never to be visited again: all but those kept for sure, there and at the alternate."""
    gone = [drop for drop in run.drops if drop.outcome is not DropOutcome.KEPT]
    elsewhere = {drop.alternate_to for drop in gone if drop.alternate_to is not None}
    return frozenset({drop.plan_item_id for drop in gone} | elsewhere)


def _flown_since(run: Run) -> tuple[str, ...]:
    """What was flown of the mission that the vehicle carried last."""
    return run.flown_item_ids[run.flown_before_change :]


def _first_left(run: Run, plan: Plan, over: Collection[str]) -> str | None:
    """The first item behind the last one done, and not a place where all drops are over. None: there is none."""
    change = run.change
    items = plan.items if change is None else rest_of(plan, change.continue_at, change.omitted).plan.items
    ids = [item.id for item in items]
    last = next((ids.index(item_id) for item_id in reversed(_flown_since(run)) if item_id in ids), -1)
    kept = {drop.plan_item_id for drop in run.drops} - set(over)
    while last >= 0 and ids[last] in kept:  # its parcel is on board, and the vehicle may never have been there
        last -= 1
    steps = walk(plan, reference_home(plan, None))
    return next((i for i in ids[last + 1 :] if i not in over and not _is_done_with(steps, i, over)), None)


def _is_done_with(steps: tuple[Step, ...], item_id: str, over: Collection[str]) -> bool:
    """The item is a place, and all that is done there are drops that are over."""
    at = next(step for step in steps if step.item.id == item_id)
    there = [step.item.id for step in steps if step.anchor == at.index and step is not at]
    return at.anchor == at.index and not at.item.lands and bool(there) and set(there) <= set(over)


def _from_the_ground(run: Run, plan: Plan, rest: RemainingMission) -> Plan:
    steps, items = walk(plan, reference_home(plan, None)), list(rest.plan.items)
    if plan.vehicle_type == "vtol":
        while items and items[0].transition_to() == "fixed_wing":
            del items[0]  # its takeoff ends with that transition
    if not items:
        raise _nothing_left(run)
    index = next(step.index for step in steps if step.item.id == items[0].id)
    items[1:1] = _waits(steps, index, items)
    whole = rest.plan.model_copy(update={"items": (*_way_up(steps, steps[index]), *items)})
    spoken = tuple(_with_speeds(plan, steps[:index], whole))
    items_json = [item.model_dump(mode="json") for item in spoken]
    return parse_plan({**whole.model_dump(mode="json"), "items": items_json})


def _waits(steps: tuple[Step, ...], place: int, items: list[PlanItem]) -> list[PlanItem]:
    """The delays that were done between the first place and a drop there: a rover has no other way to stop for it."""
    drop = next((step for step in steps if step.item.id == items[1].id), None) if len(items) > 1 else None
    if drop is None or not drop.item.is_drop or drop.anchor != place:
        return []
    return [step.item for step in steps[place + 1 : drop.index] if step.item.waits]


def _way_up(steps: tuple[Step, ...], first: Step) -> Iterator[PlanItem]:
    """From the ground to what carries the vehicle at the first item: a VTOL turns where the plan turned."""
    before = steps[: first.index]
    takeoff = next((step for step in reversed(before) if step.item.takes_off), None)
    if takeoff is None:
        return
    yield takeoff.item
    turns = first.item.transition_to() is not None
    if takeoff.after is not FlightRegime.FIXED_WING or not (turns or _by_rotor(first)):
        return
    turn = first if turns else next((step for step in reversed(before) if _to_rotors(step)), None)
    if turn is not None:
        at = next((step for step in reversed(steps[: turn.index]) if step.item.is_stop and step.item.flies), None)
        if at is not None:
            yield at.item
    if turn is not None and not turns:
        yield turn.item
    elif turn is None and first.before is FlightRegime.GROUND:
        yield Transition(type="transition", to="multicopter")


def _by_rotor(step: Step) -> bool:
    return step.before is FlightRegime.ROTARY_WING or (
        step.before is FlightRegime.GROUND and step.after is FlightRegime.ROTARY_WING
    )


def _to_rotors(step: Step) -> bool:
    return step.item.transition_to() == "multicopter"


def _with_speeds(plan: Plan, done: tuple[Step, ...], tail: Plan) -> Iterator[PlanItem]:
    """The tail's items, and the speed in force where the vehicle first flies in each way. PX4 keeps one for each."""
    asked: set[FlightRegime] = set()
    steps = walk(tail, reference_home(tail, None))
    for step in (None, *steps):
        carried = steps[0].before if step is None else step.after
        if step is not None:
            yield step.item
        if (
            carried in asked
            or carried is FlightRegime.GROUND
            or (step is not None and step.item.is_stop and step.item.lands)
        ):
            continue
        asked.add(carried)
        speed_m_s = asked_speed_m_s(plan, done, carried)
        through = steps[: 0 if step is None else step.index + 1]
        own = step is not None and step.item.asked_speed_m_s() is not None
        if speed_m_s is not None and not own and speed_m_s != asked_speed_m_s(tail, through, carried):
            yield ChangeSpeed(type="change_speed", speed_m_s=speed_m_s)


def _refuse_place(plan: Plan, continue_at: str, over: Collection[str]) -> None:
    if plan.index_of(continue_at) is None:
        message, code = f"the run's plan has no item {continue_at}", "change.continue_at_unknown"
    elif continue_at in over:
        message, code = f"the drop {continue_at} is over: it is never visited again", "change.drop_concluded"
    else:
        return
    finding = Finding(code=code, severity=Severity.ERROR, pointer="", message=message, hint="continue at a later item")
    raise _tail_rejected((finding,))


def _nothing_left(run: Run) -> NoRemainingItemsError:
    return NoRemainingItemsError(f"nothing is left to fly of run {run.id}", hint="post a new run")


def _tail_rejected(findings: tuple[Finding, ...]) -> PlanRejectedError:
    return PlanRejectedError(
        f"the run cannot be continued there: {findings[0].message}",
        hint=findings[0].hint,
        findings=[finding.model_dump(mode="json") for finding in findings],
    )
