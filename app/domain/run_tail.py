"""What is left of a run that is over, as a plan of its own for a vehicle that stands on the ground.

The vehicle may have a new battery or have rebooted, and it may stand anywhere: it takes off as the plan says, and goes
on with the first item that was not done. A drop that is over is never made again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from app.domain.carried import Carried
from app.domain.continuation import Rest, begun_loops, rest_of
from app.domain.drop import DropOutcome
from app.domain.errors import (
    ChangeUnderWayError,
    NothingLeftError,
    PlanRejectedError,
    RunContinuedError,
    RunNotOverError,
)
from app.domain.finding import Finding, Severity
from app.domain.items import ChangeSpeed, PlanItem, Transition
from app.domain.plan import Plan, parse_plan
from app.domain.plan.walk import Step, reference_home, walk
from app.domain.run import Run, RunState
from app.domain.speeds import asked_speed_m_s


def refuse_continued(run: Run, *, is_ending: bool) -> None:
    """`is_ending`: its end is being recorded.

    Raises RunNotOverError, RunContinuedError, NothingLeftError, ChangeUnderWayError.
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

    Raises NothingLeftError; PlanRejectedError whose findings point into the run's plan.
    """
    over = drops_over(run)
    if continue_at is not None:
        _refuse_place(plan, continue_at, over)
    begin = continue_at if continue_at is not None else _first_left(run, plan, over)
    if begin is None:
        raise _nothing_left(run)
    try:
        rest = rest_of(plan, begin, over)
    except PlanRejectedError as error:  # the only reason: all that is left are drops that are over
        raise _nothing_left(run) from error
    if loops := tuple(begun_loops(_flown_since(run), plan, rest)):
        raise _rejected(loops)
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
    items = plan.items if change is None else rest_of(plan, change.continue_at, change.left_out).plan.items
    ids = [item.id for item in items]
    last = next((ids.index(item_id) for item_id in reversed(_flown_since(run)) if item_id in ids), -1)
    kept = {drop.plan_item_id for drop in run.drops} - set(over)
    while last >= 0 and ids[last] in kept:  # its parcel is on board, and it may never have come there
        last -= 1
    steps = walk(plan, reference_home(plan, None))
    return next((i for i in ids[last + 1 :] if i not in over and not _is_done_with(steps, i, over)), None)


def _is_done_with(steps: tuple[Step, ...], item_id: str, over: Collection[str]) -> bool:
    """The item is a place, and all that is done there are drops that are over."""
    at = next(step for step in steps if step.item.id == item_id)
    there = [step.item.id for step in steps if step.anchor == at.index and step is not at]
    return at.anchor == at.index and not at.item.lands and bool(there) and set(there) <= set(over)


def _from_the_ground(run: Run, plan: Plan, rest: Rest) -> Plan:
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
    if takeoff.after is not Carried.FIXED_WING or not (turns or _by_rotor(first)):
        return
    turn = first if turns else next((step for step in reversed(before) if _to_rotors(step)), None)
    if turn is not None:
        at = next((step for step in reversed(steps[: turn.index]) if step.item.is_stop and step.item.flies), None)
        if at is not None:
            yield at.item
    if turn is not None and not turns:
        yield turn.item
    elif turn is None and first.before is Carried.GROUND:
        yield Transition(type="transition", to="multicopter")


def _by_rotor(step: Step) -> bool:
    return step.before is Carried.ROTARY_WING or (step.before is Carried.GROUND and step.after is Carried.ROTARY_WING)


def _to_rotors(step: Step) -> bool:
    return step.item.transition_to() == "multicopter"


def _with_speeds(plan: Plan, done: tuple[Step, ...], tail: Plan) -> Iterator[PlanItem]:
    """The tail's items, and the speed in force where the vehicle first flies in each way. PX4 keeps one for each."""
    asked: set[Carried] = set()
    steps = walk(tail, reference_home(tail, None))
    for step in (None, *steps):
        carried = steps[0].before if step is None else step.after
        if step is not None:
            yield step.item
        if (
            carried in asked
            or carried is Carried.GROUND
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
    raise _rejected((finding,))


def _nothing_left(run: Run) -> NothingLeftError:
    return NothingLeftError(f"nothing is left to fly of run {run.id}", hint="post a new run")


def _rejected(findings: tuple[Finding, ...]) -> PlanRejectedError:
    return PlanRejectedError(
        f"the run cannot be continued there: {findings[0].message}",
        hint=findings[0].hint,
        findings=[finding.model_dump(mode="json") for finding in findings],
    )
