"""A leg of a flight: a plan, its mission and its drops, from takeoff or since the plan was changed in flight."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from app.domain.drop.consent import ConsentRecord
from app.domain.drop.embedded import EmbeddedDrop
from app.domain.drop.record import DropOutcome, DropPhase, DropRecord
from app.domain.flight.embedded_release import EmbeddedRelease
from app.domain.flight.progress import GripperTurns
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.items import Drop
from app.domain.mission import CompiledDrop, Mission
from app.domain.plan import Plan
from app.domain.run.run import IN_FLIGHT, PlanChange, Run, RunState
from app.domain.vehicle.link_security import LinkSecurity

_NOT_STARTED = frozenset({RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED})
_NEVER_AGAIN = frozenset({DropOutcome.RELEASED, DropOutcome.UNKNOWN})


Release = SupervisedRelease | EmbeddedRelease
"""A drop of a flight, commanded by Waydrop or executed by the mission.

`is_over`: it has its outcome. `is_active`: the vehicle waits at it. `is_busy`: it was commanded, or its item passed,
and the result is not known yet. `observe` returns the drop after an observation and the commands to send, `ended` the
drop closed at the end of the run.
"""


@dataclass(frozen=True, slots=True)
class MissionSegment:
    """A mission of a flight. `plan` is the whole plan; `mission` may be only its remaining part.

    `alternates` are the drops at other places, by the drop that must fail before; among the `releases` are those that
    the vehicle was sent to. `approach_speeds_m_s`: how fast the waypoints that follow a moving target are flown to, by
    their ids.
    """

    plan: Plan
    mission: Mission
    releases: tuple[Release, ...]
    alternates: Mapping[str, SupervisedRelease] = field(default_factory=dict)
    approach_speeds_m_s: Mapping[str, float] = field(default_factory=dict)

    def find(self, plan_item_id: str) -> Release | None:
        """Return a drop that is flown, or None."""
        return next((one for one in self.releases if one.record.plan_item_id == plan_item_id), None)

    def having(self, release: Release) -> MissionSegment:
        drop_id = release.record.plan_item_id
        return replace(
            self, releases=tuple(release if one.record.plan_item_id == drop_id else one for one in self.releases)
        )

    @property
    def supervised(self) -> tuple[SupervisedRelease, ...]:
        """The drops that Waydrop commands."""
        return tuple(release for release in self.releases if isinstance(release, SupervisedRelease))

    @property
    def feeds(self) -> tuple[str, ...]:
        """The feeds of the moving targets of its drops."""
        return tuple(dict.fromkeys(release.feed for release in self.supervised if release.feed is not None))

    def diverted(self, plan_item_id: str) -> MissionSegment:
        """The segment whose vehicle goes to this drop's alternate."""
        return replace(self, releases=(*self.releases, self.alternates[plan_item_id]))


def segment_of(
    run: Run,
    plan: Plan,
    mission: Mission,
    default_max_offset_m: float,
    approach_speeds_m_s: Mapping[str, float],
    *,
    changed_at: float | None = None,
) -> MissionSegment:
    """The segment for a run that has a record of each of the mission's drops.

    `changed_at`: when the plan was changed in flight. No hold of this mission can have begun before.
    """
    drops = [item for item in plan.items if isinstance(item, Drop)]
    offsets = {drop.id: drop.max_offset_m for drop in drops}
    targets = {drop.id: drop.followed() for drop in drops}
    made: list[Release] = []
    waited_at_s = run.updated_at if run.state in IN_FLIGHT else None
    recovered = run.state not in _NOT_STARTED
    if changed_at is not None:
        waited_at_s, recovered = changed_at, False
    on_failure = plan.contingency.on_drop_failure
    offsets |= {alternate.id: alternate.max_offset_m for _, alternate in plan.alternates}
    alternates: dict[str, SupervisedRelease] = {}

    def supervised(drop: CompiledDrop, record: DropRecord) -> SupervisedRelease:
        offset_m = offsets.get(drop.plan_item_id) or default_max_offset_m
        target = targets.get(drop.plan_item_id)
        was_open = run.link_security is LinkSecurity.OPEN
        return SupervisedRelease.of(drop, record, offset_m, on_failure, waited_at_s, target, mission, was_open)

    for drop in mission.drops:
        record = run.drop(drop.plan_item_id)
        if not drop.supervised:
            turns = GripperTurns.of(drop, mission)
            since_s = math.inf if recovered else -math.inf
            seen = EmbeddedDrop(used_by=record.gripper_used_by)
            made.append(EmbeddedRelease(drop, record, on_failure, turns, since_s, seen))
            continue
        begun = None if drop.alternate is None else run.find_drop(drop.alternate.plan_item_id)
        if drop.alternate is not None and begun is None:
            alternates[drop.plan_item_id] = supervised(drop.alternate, _fresh(drop.alternate, to=drop.plan_item_id))
        made.append(supervised(drop if begun is None else _without_alternate(drop), record))
        if drop.alternate is not None and begun is not None:
            made.append(supervised(drop.alternate, begun))
    return MissionSegment(plan, mission, tuple(made), alternates, approach_speeds_m_s)


def _without_alternate(drop: CompiledDrop) -> CompiledDrop:
    """It was already used: an alternate is tried only once."""
    return replace(drop, alternate=None, alternate_seq=None, leave_s=0.0)


def drop_records(mission: Mission) -> tuple[DropRecord, ...]:
    """Return the initial records of a mission's drops."""
    return tuple(_fresh(drop) for drop in mission.drops)


def drops_after_change(records: Sequence[DropRecord], mission: Mission) -> tuple[DropRecord, ...]:
    """The records after a change: those of the mission's drops are fresh, the others stay as they ended.

    A parcel that was kept may be tried again. The count of consent requests continues, so that old answers stay void.
    Who used the gripper counts on, except for what the changed mission grabs itself.
    """
    used_by = {record.plan_item_id: record.gripper_used_by for record in records}
    anybody = next(filter(None, used_by.values()), None)
    ahead = {drop.plan_item_id: drop for drop in mission.drops}
    concluded = concluded_drops(records)

    def fresh(drop: CompiledDrop, old: DropRecord | None = None) -> DropRecord:
        by = None if GripperTurns.of(drop, mission).loaded_seq >= 0 else used_by.get(drop.plan_item_id, anybody)
        return _fresh(drop, old).model_copy(update={"gripper_used_by": by})

    found = [
        fresh(ahead.pop(old.plan_item_id), old) if old.plan_item_id in ahead.keys() - concluded else old
        for old in records
    ]
    return (*found, *(fresh(drop) for item_id, drop in ahead.items() if item_id not in used_by))


def fields_after_change(run: Run, change: PlanChange, mission: Mission) -> dict[str, object]:
    """The fields of a run whose vehicle carries the changed mission; `mission` is what is left of the plan."""
    return {
        "plan_id": change.plan_id,
        "plan_hash": change.plan_hash,
        "mission_hash": change.mission_hash,
        "mission_id": None if run.mission_id is None else change.mission_id,
        "change": change,
        "changing": None,
        "changes": run.changes + 1,
        "flown_before_change": len(run.flown_item_ids),
        "drops": drops_after_change(run.drops, mission),
        "reached_seq": None,
        "item_id": mission.plan_item_of.get(0),
    }


def concluded_drops(records: Sequence[DropRecord]) -> frozenset[str]:
    """Return the drops that must never be visited again: released, there or at the alternate, or unknown."""
    over = [record for record in records if record.phase is DropPhase.DONE and record.outcome in _NEVER_AGAIN]
    elsewhere = {record.alternate_to for record in over if record.alternate_to is not None}
    return frozenset({record.plan_item_id for record in over} | elsewhere)


def _fresh(drop: CompiledDrop, old: DropRecord | None = None, to: str | None = None) -> DropRecord:
    questions = 0 if old is None or old.consent is None else old.consent.question
    return DropRecord(
        plan_item_id=drop.plan_item_id,
        supervised=drop.supervised,
        alternate_to=to,
        consent=ConsentRecord(question=questions) if drop.needs_consent else None,
        planned_latitude_deg=drop.latitude_deg,
        planned_longitude_deg=drop.longitude_deg,
    )
