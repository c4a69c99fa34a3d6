"""Gates: a vehicle or a plan that is not fit is refused before a run is stored, uploaded or started."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Final, Protocol

from app.domain.autopilot import behaviour
from app.domain.errors import ConflictError, PlanRejectedError, VehicleBusyError
from app.domain.flight.modes import armed_by_others
from app.domain.flight.recovery import RECORDED_VISITS
from app.domain.mission import Mission
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.ports.threads import InThread
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import Timeline, Wind
from app.domain.rules import Finding, Severity, check_plan, checked
from app.domain.run.run import Run
from app.domain.vehicle.clock import TOO_FAST_HINT, is_too_fast, needs_longer_look, too_fast_words
from app.domain.vehicle.state import LandedState, VehicleProfile
from app.services.clock import Clock
from app.services.fleet import FleetVehicle

LONGEST_LOOK_S: Final = 12.0
LOOK_EVERY_S: Final = 0.1
LONGEST_UNMEASURED_S: Final = 1.5
"""A vehicle that was just found is measured within about a second. One that sends no positions does not wait here."""


async def refuse_fast_clock(link: VehicleLink, mission: Mission, clock: Clock) -> None:
    """Refuse a start with supervised drops on a clock that is too fast for them. Raises ConflictError.

    Returns at once for a real vehicle after a second of messages, or without supervised drops. The plan's check
    (`vehicle.clock_too_fast`) reports the same earlier, but a vehicle that has just connected has not been measured
    long enough then.
    """
    if not any(drop.supervised for drop in mission.drops):
        return
    began_s = clock.monotonic()
    while True:
        heard, waited_s = link.state().clock, clock.monotonic() - began_s
        undecided = needs_longer_look(heard) if heard.is_measured else waited_s < LONGEST_UNMEASURED_S
        if not undecided or waited_s >= LONGEST_LOOK_S:
            break
        await asyncio.sleep(LOOK_EVERY_S)
    least_rate = heard.least_rate
    if least_rate is not None and is_too_fast(least_rate):
        raise ConflictError(too_fast_words(least_rate), hint=TOO_FAST_HINT)


class FactsRead(Protocol):
    """See Fleet.facts."""

    def __call__(self, *, fresh: bool = False) -> Awaitable[VehicleProfile]:
        """Raises LinkError."""


async def refuse_unfit_plan(plan: Plan, facts: VehicleProfile, wind: Wind, in_thread: InThread) -> Sequence[Finding]:
    """The warnings, as the vehicle is now; slow plans are checked in a thread.

    Raises PlanRejectedError with all findings.
    """
    findings = await in_thread(check_plan, plan, facts, wind)
    _refuse_errors(findings)
    return findings


async def refuse_changed_vehicle(
    plan: Plan,
    then: VehicleProfile,
    now: VehicleProfile,
    wind: Wind,
    id_of: Callable[[Mission], int],
    on_board: int,
    in_thread: InThread,
) -> Sequence[Finding]:
    """Before arming, with parameters read just now: the warnings that the plan did not have `then`. `on_board` is the
    id of the mission that the vehicle holds. It was compiled with the home of `then`, and stays when home moves.

    Raises PlanRejectedError, with `parameters_age_s` too.
    """
    try:
        warnings = await refuse_unfit_plan(plan, now, wind, in_thread)
        mission = await in_thread(compile_plan, plan, replace(now, home=then.home))
        if id_of(mission) != on_board:
            raise PlanRejectedError(
                "the vehicle's parameters changed since the upload and would change the mission",
                hint="abort the run and create it again",
                findings=[],
            )
    except PlanRejectedError as error:
        found = {**error.extra, "parameters_age_s": now.parameters_age_s}
        raise PlanRejectedError(error.detail, hint=error.hint, **found) from error
    known = {(one.code, one.pointer) for one in await in_thread(check_plan, plan, then, wind)} if warnings else set()
    return [one for one in warnings if (one.code, one.pointer) not in known]


async def compiled_and_predicted(
    plan: Plan, facts: VehicleProfile, wind: Wind, in_thread: InThread
) -> tuple[Mission, Timeline]:
    """The mission, and what the vehicle is predicted to do with it, by its own parameters.

    Raises PlanRejectedError.
    """
    found = await in_thread(checked, plan, facts, wind)
    _refuse_errors(found.findings)
    compiled = partial(compile_plan, plan, facts) if found.drafted is None else found.drafted.mission
    return await in_thread(compiled), found.timeline.first(RECORDED_VISITS)


def _refuse_errors(findings: Sequence[Finding]) -> None:
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if errors:
        raise PlanRejectedError(
            f"the plan cannot be flown by this vehicle: {errors[0].message}",
            hint="correct the findings and create a new plan",
            findings=[finding.model_dump(mode="json") for finding in findings],
        )


def refuse_unfit_vehicle(vehicle: FleetVehicle, taken_by: str | None) -> None:
    """Raises VehicleBusyError, VehicleTakenError, ConflictError. `taken_by`: the run that has the vehicle."""
    state = vehicle.link.state()
    if taken_by is not None:
        raise VehicleBusyError(
            f"vehicle {vehicle.id} already flies run {taken_by}",
            hint="wait until the run ends; abort it on the ground, or return it in flight",
            run_id=taken_by,
        )
    if not state.connected:
        raise ConflictError(f"the link to vehicle {vehicle.id} is lost", hint="wait until it is connected")
    if state.armed:
        raise armed_by_others(f"vehicle {vehicle.id}", state.mode)


def refuse_critical_battery(facts: VehicleProfile) -> None:
    """A vehicle that holds with such a battery had its failsafe cancelled, and PX4 does not act again at that level: it
    flew its mission on at 6 % and came down in a field (flown). Raises ConflictError.
    """
    acts_below, percent = behaviour(facts).low_battery.acts_below, facts.battery_percent
    if acts_below is not None and percent is not None and percent <= acts_below.value:
        raise ConflictError(
            f"the battery has {percent:g} %, where the vehicle's failsafe acts ({acts_below}): a command cancelled it",
            hint="return or land",
        )


def refuse_other_or_moving(run: Run, link: VehicleLink) -> None:
    """What is left of a run is flown from the ground, by the vehicle that has its parcels. Raises ConflictError."""
    uid = link.identity.uid
    if run.vehicle_uid is not None and uid is not None and uid != run.vehicle_uid:
        raise ConflictError(
            f"{run.vehicle_id} is now a different vehicle: the parcels of run {run.id} are not on board",
            hint="create a plan with the remaining items and a new run",
        )
    if link.state().landed is not LandedState.ON_GROUND:
        raise ConflictError(f"vehicle {run.vehicle_id} is not confirmed to be on the ground", hint="land it first")
