"""A changed mission on its way to a vehicle in flight: steps of the flight."""

from __future__ import annotations

from dataclasses import replace

from app.domain.events.run import RunMissionChanged
from app.domain.flight import inputs
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import Observation, PendingChange
from app.domain.flight.progress import MissionCompleteDetector, MissionProgress
from app.domain.flight.segment import fields_after_change, segment_of
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import RunAction


def change_begun(flight: Flight, given: inputs.ChangeBegun) -> Flight:
    """A changed mission is about to be sent."""
    return replace(flight, change=given.change).with_run(given.observed, changing=given.change.change)


def change_withdrawn(flight: Flight, given: inputs.ChangeWithdrawn) -> Flight:
    """It was not sent."""
    return replace(flight, change=None).with_run(given.observed, changing=None)


def change_arrived(flight: Flight, given: inputs.ChangeArrived) -> Flight:
    """The transfer reports that the change is on board."""
    return flight if flight.change is None else _take_change(flight, flight.change, given.observed)


def change_transfer_ended(flight: Flight, given: inputs.ChangeTransferEnded) -> Flight:
    """From now on, a missing mission ID means that the change did not arrive."""
    if flight.change is None:
        return flight
    return replace(flight, change=replace(flight.change, ended_s=given.observed.now_s))


def change_refused(flight: Flight, given: inputs.ChangeRefused) -> Flight:
    """The vehicle holds until it is commanded."""
    return flight.with_run(given.observed, commanded=RunAction.REFUSED)


def settle_change(flight: Flight, change: PendingChange, observed: Observation) -> Flight:
    """Follow the mission that the vehicle names as its own."""
    if change.has_arrived(observed.state):
        return _take_change(flight, change, observed)
    since_s = flight.link.connected_since_s
    if change.is_missing(observed.state, observed.now_s if since_s is None else since_s, observed.now_s):
        return replace(flight, change=replace(change, is_open=False)).with_run(observed, changing=None)
    return flight


def _take_change(flight: Flight, change: PendingChange, observed: Observation) -> Flight:
    """The vehicle carries the changed mission: follow that one from here on."""
    ahead = {drop.plan_item_id for drop in change.mission.drops}
    for release in flight.segment.releases:
        if not release.is_over and (release.is_busy or release.compiled.plan_item_id not in ahead):
            ended = release.ended(Reason.of(ReasonCode.PLAN_CHANGED), observed.now_s)  # a change took it out
            flight = flight.with_record(observed, ended.record)
    skip_to = change.first_seq(flight.segment.plan, flight.progress)
    # recorded before the run's own change, so that the events show which plan was flown until then
    flight = flight.recording(RunMissionChanged(change=change.change, timeline=change.timeline))
    flight = flight.with_run(observed, **fields_after_change(flight.run, change.change, change.mission))
    segment = segment_of(
        flight.run,
        change.plan,
        change.mission,
        flight.default_max_offset_m,
        change.approach_speeds_m_s,
        changed_at=change.change.at,
    )
    progress = replace(MissionProgress.of(change.mission), flown=flight.progress.flown, passed_to=skip_to - 1)
    return replace(
        flight,
        segment=segment,
        progress=progress,
        skip_to=skip_to,
        item_clock=flight.item_clock.flown_on(change.mission),
        completion=MissionCompleteDetector(),
        target=replace(flight.target, refused=None),
        mission_done=False,
        change=None,
    )
