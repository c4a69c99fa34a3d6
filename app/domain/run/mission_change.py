"""Whether the plan of a vehicle in flight may be changed, and how items are inserted into it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.domain.errors import ConflictError, DropInProgressError, HoldRequiredError, NotFoundError, WrongStateError
from app.domain.items import PlanItem
from app.domain.mission import Mission
from app.domain.plan.document import Plan
from app.domain.plan.parse import PlanInvalid, parse_plan
from app.domain.run.run import HOLDS, Run, RunAction, RunState
from app.domain.validation.finding import Finding
from app.domain.vehicle.state import (
    IN_TRANSITION,
    FlightMode,
    InFlight,
    LandedState,
    VehicleState,
    VehicleType,
    VtolState,
    names_other_mission,
)

FRESH_POSITION_S: Final = 2.0
_TAKEN_OUT: Final = frozenset({*HOLDS, RunAction.RETURN, RunAction.LAND, RunAction.CONTINGENCY})
"""Commanded: the vehicle leaves Mission mode in a moment."""


@dataclass(frozen=True, slots=True)
class ChangeTerms:
    """What is looked at. `mission` is on board, `current` the item of it that is flown.

    `drop_is_busy`: the vehicle waits at a drop, or the outcome of a release is awaited. `item_is_fresh`: its
    MISSION_CURRENT is not from before the link was lost.
    """

    run: Run
    plan: Plan
    mission: Mission
    state: VehicleState
    current: int | None
    drop_is_busy: bool
    item_is_fresh: bool

    def refuse_unfit(self) -> None:
        """Raises WrongStateError, DropInProgressError, HoldRequiredError, ConflictError."""
        self._refuse_state()
        if self.drop_is_busy or self.run.state is RunState.AT_DROP:
            raise DropInProgressError(
                "a drop is in progress: what it will have been decides what is left to fly",
                hint="order it again when the drop has its outcome",
            )
        self._refuse_phase()
        self._refuse_unseen()
        if self.state.mode is FlightMode.MISSION:
            self._refuse_moving()

    def in_flight(self) -> InFlight:
        """Where the vehicle is. Raises ConflictError if that is not known."""
        state = self.state
        place = (state.latitude_deg, state.longitude_deg, state.relative_altitude_m)
        is_fresh = state.position_age_s is not None and state.position_age_s <= FRESH_POSITION_S
        if not is_fresh or place[0] is None or place[1] is None or place[2] is None:
            raise ConflictError("the vehicle's position is not known", hint="wait until it is heard again")
        return InFlight(
            latitude_deg=place[0],
            longitude_deg=place[1],
            relative_altitude_m=place[2],
            ground_speed_m_s=state.ground_speed_m_s or 0.0,
            course_deg=state.heading_deg,
            wing_borne=state.vtol_state is VtolState.FIXED_WING,
        )

    def _refuse_state(self) -> None:
        run, state = self.run, self.state
        holds = state.mode is FlightMode.HOLD and run.commanded in (*HOLDS, RunAction.REFUSED)
        paused = run.state is RunState.PAUSED and holds
        flying = run.state in (RunState.FLYING, RunState.AT_DROP) and state.mode is FlightMode.MISSION
        if not state.connected:
            raise ConflictError("the link to the vehicle is lost", hint="wait until it is connected")
        if not (paused or (flying and run.commanded not in _TAKEN_OUT)):
            raise _wrong(run, f"run {run.id} is {run.state.value}: its mission cannot be changed now")

    def _refuse_phase(self) -> None:
        """Near the ground and in a transition a new mission would begin in the middle of what cannot be broken off."""
        if self.plan.vehicle_type is VehicleType.ROVER:
            return
        item_id = self.run.item_id
        index = None if item_id is None else self.plan.index_of(item_id)
        item = None if index is None else self.plan.items[index]
        if self.state.landed is not LandedState.IN_AIR or (item is not None and (item.takes_off or item.lands)):
            raise _wrong(self.run, "the vehicle takes off, lands or stands: its mission cannot be changed now")
        if self.state.vtol_state in IN_TRANSITION:
            raise _wrong(self.run, "the vehicle is in a transition: its mission cannot be changed now")

    def _refuse_unseen(self) -> None:
        """It may have made a drop while unobserved; continuing with the last observed item would repeat it."""
        seq = self.state.mission_seq
        if names_other_mission(self.state, self.run.mission_id):
            raise ConflictError(
                "another mission is on board: another client uploaded it",
                hint="return or land; a continuation of the run flies the rest",
            )
        if not self.item_is_fresh or (seq is not None and seq != (self.current or 0)):
            raise ConflictError(
                "it is not known yet how far the vehicle flew on unseen", hint="order it again in a few seconds"
            )

    def _refuse_moving(self) -> None:
        if self.run.mission_id is None:
            raise HoldRequiredError(
                "this firmware names no missions: which one it flies would not be known if the link died now",
                hint="pause the run, change its mission, and resume it",
            )
        for drop in self.mission.drops:
            if drop.release_seq is not None and self._is_near(min(drop.hold_seqs), drop.release_seq):
                raise HoldRequiredError(
                    f"the drop {drop.plan_item_id} is near: it may happen while the upload is under way",
                    hint="pause the run, change its mission, and resume it; or wait until the drop has ended",
                )

    def _is_near(self, first_seq: int, release_seq: int) -> bool:
        """The next position item is the drop's, or the one before it."""
        if self.current is None:
            return True
        places = [item.seq for item in self.mission.items if item.x or item.y]
        before = [seq for seq in places if seq < first_seq]
        return (before[-1] if before else 0) <= self.current <= release_seq


def _wrong(run: Run, message: str) -> WrongStateError:
    return WrongStateError(
        message, hint="it is changed in flight, between the take-off and the landing", state=run.state.value
    )


def with_items(plan: Plan, items: Sequence[Any], *, at: str, after: bool) -> tuple[Plan, tuple[str, ...]]:
    """The plan with more items before or after the stop of the item `at`, and the ids that the new ones got.

    Raises NotFoundError, and PlanInvalid with pointers into `{"items": items}`.
    """
    index = plan.index_of(at)
    if index is None:
        raise NotFoundError(f"the plan has no item {at!r}", hint="GET the run's plan: its items have ids")
    place = _behind_stop(plan.items, index) if after else _before_stop(plan.items, index)
    document = plan.model_dump(mode="json")
    parse_plan({**document, "items": list(items)})  # by themselves, so that findings point to them as they were given
    document["items"][place:place] = list(items)
    try:
        changed = parse_plan(document)
    except PlanInvalid as error:
        raise PlanInvalid([_at_new_item(finding, items) for finding in error.findings]) from None
    return changed, tuple(item.id for item in changed.items[place : place + len(items)])


def _at_new_item(finding: Finding, items: Sequence[Any]) -> Finding:
    """What is wrong with the whole alone is an id that is used twice, or how many items there are."""
    ids = [item.get("id") if isinstance(item, dict) else None for item in items]
    known = finding.item_id is not None and finding.item_id in ids
    return finding.model_copy(update={"pointer": f"/items/{ids.index(finding.item_id)}" if known else "/items"})


def _before_stop(items: Sequence[PlanItem], index: int) -> int:
    while index > 0 and items[index].stays:
        index -= 1
    return index


def _behind_stop(items: Sequence[PlanItem], index: int) -> int:
    index += 1
    while index < len(items) and items[index].stays:
        index += 1
    return index
