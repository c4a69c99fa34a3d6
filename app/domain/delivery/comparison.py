"""Compares prediction and flight, item by item and drop by drop, with reasons where they cannot be compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise

from app.domain.drop.record import DropPhase, DropRecord
from app.domain.events.run import RunItemEnded
from app.domain.geo import distance_m
from app.domain.model import FrozenForm
from app.domain.prediction import PredictedDrop, Timeline, TimelineEntry
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Run


class ItemComparison(FrozenForm):
    """One visit of a plan item, in seconds of the vehicle's clock.

    `flown_s` excludes `paused_s`, the time in which the run was paused or under offboard control, which no prediction
    covers. `difference_percent` is relative to the predicted time; null for an item that takes no time.
    `uncertainty_s`: see the timeline. A null has a `reason`.
    """

    item_id: str
    type: str
    visit: int
    predicted_s: float | None
    flown_s: float | None
    paused_s: float = 0.0
    difference_percent: float | None
    uncertainty_s: float
    reason: Reason | None


class DropComparison(FrozenForm):
    """The release of a drop. `distance_m` is the distance between the predicted and the flown release point.

    Offsets are from the planned point. Flown values are taken from the drop's record. A null has a `reason`.
    """

    item_id: str
    predicted_latitude_deg: float | None
    predicted_longitude_deg: float | None
    predicted_offset_m: float | None
    predicted_ground_speed_m_s: float | None
    flown_latitude_deg: float | None
    flown_longitude_deg: float | None
    flown_offset_m: float | None
    flown_ground_speed_m_s: float | None
    distance_m: float | None
    reason: Reason | None


class Comparison(FrozenForm):
    """The comparison of a run. `reason` says why there is none. The totals cover the compared items.

    `paused_s` is how long the run was paused during these items, which `flown_s` excludes.
    """

    run_id: str
    items: tuple[ItemComparison, ...]
    drops: tuple[DropComparison, ...]
    predicted_s: float | None
    flown_s: float | None
    paused_s: float = 0.0
    reason: Reason | None


def compare(
    run: Run, timeline: Timeline | None, flown: Sequence[RunItemEnded], why_none: Reason | None = None
) -> Comparison:
    """Compare. `flown` are the finished visits, in order; `why_none` says why there is no timeline."""
    times = _by_visit(flown)
    kept = {drop.plan_item_id: why for drop in run.drops if (why := _why_not_released(drop)) is not None}
    kept |= _from_elsewhere(run, flown)
    entries = () if timeline is None else timeline.entries
    items = [_item(run, entry, times.pop((entry.item_id, entry.visit), None), kept) for entry in entries]
    alternates = {
        drop.plan_item_id: Reason.of(ReasonCode.ALTERNATE_OF, item_id=drop.alternate_to)
        for drop in run.drops
        if drop.alternate_to
    }
    for (item_id, visit), ended in times.items():
        items.append(_unpredicted(item_id, visit, ended, why_none or alternates.get(item_id)))
    both = [item for item in items if item.predicted_s is not None and item.flown_s is not None]
    predicted_drops = {} if timeline is None else {drop.item_id: drop for drop in timeline.drops if drop.visit == 1}
    return Comparison(
        run_id=run.id,
        items=tuple(items),
        drops=tuple([_drop(drop, predicted_drops.get(drop.plan_item_id), why_none) for drop in run.drops]),
        predicted_s=sum(item.predicted_s or 0.0 for item in both) if both else None,
        flown_s=sum(item.flown_s or 0.0 for item in both) if both else None,
        paused_s=sum(item.paused_s for item in both),
        reason=why_none,
    )


def difference_percent(predicted_s: float, flown_s: float) -> float | None:
    """Return the difference relative to the predicted time; None if no time was predicted."""
    return None if predicted_s < 0.05 else 100.0 * (flown_s - predicted_s) / predicted_s


def _from_elsewhere(run: Run, flown: Sequence[RunItemEnded]) -> dict[str, Reason]:
    """Return the items whose leg began at an alternate instead of the predicted position. They are never in a loop."""
    alternates = {drop.plan_item_id for drop in run.drops if drop.alternate_to is not None}
    pairs = pairwise(flown)
    return {
        after.item_id: Reason.of(ReasonCode.FLOWN_FROM, item_id=before.item_id)
        for before, after in pairs
        if before.item_id in alternates
    }


def _by_visit(flown: Sequence[RunItemEnded]) -> dict[tuple[str, int], RunItemEnded]:
    visits: Counter[str] = Counter()
    found: dict[tuple[str, int], RunItemEnded] = {}
    for ended in flown:
        visits[ended.item_id] += 1
        found[ended.item_id, visits[ended.item_id]] = ended
    return found


def _flown_s(ended: RunItemEnded) -> float | None:
    if ended.began_s is None or ended.ended_s is None:
        return None
    return max(0.0, ended.ended_s - ended.began_s - ended.paused_s)


def _item(run: Run, entry: TimelineEntry, ended: RunItemEnded | None, kept: Mapping[str, Reason]) -> ItemComparison:
    flown_s = None if ended is None else _flown_s(ended)
    reason = kept.get(entry.item_id)
    if reason is not None:
        flown_s = None
    elif ended is None:
        over = Reason.of(ReasonCode.NOT_FLOWN, state=run.state.value)
        reason = over if run.is_over else Reason.of(ReasonCode.NOT_FLOWN_YET)
    elif flown_s is None:
        reason = Reason.of(ReasonCode.ENDS_UNSEEN)
    return ItemComparison(
        item_id=entry.item_id,
        type=entry.type,
        visit=entry.visit,
        predicted_s=entry.duration_s,
        flown_s=flown_s,
        paused_s=0.0 if ended is None or flown_s is None else ended.paused_s,
        difference_percent=None if flown_s is None else difference_percent(entry.duration_s, flown_s),
        uncertainty_s=entry.uncertainty_s,
        reason=reason,
    )


def _unpredicted(item_id: str, visit: int, ended: RunItemEnded, why_none: Reason | None) -> ItemComparison:
    return ItemComparison(
        item_id=item_id,
        type="",
        visit=visit,
        predicted_s=None,
        flown_s=_flown_s(ended),
        paused_s=ended.paused_s,
        difference_percent=None,
        uncertainty_s=0.0,
        reason=why_none or Reason.of(ReasonCode.VISIT_NOT_PREDICTED),
    )


def _why_not_released(drop: DropRecord) -> Reason | None:
    """Return why a finished supervised drop has no release time; None if it has one, or may get one."""
    if drop.supervised and drop.phase is DropPhase.DONE and drop.attempts == 0:
        return Reason.of(ReasonCode.NO_RELEASE_SENT, drop.reason)
    return None


def _drop(record: DropRecord, predicted: PredictedDrop | None, why_none: Reason | None) -> DropComparison:
    reason = _why_not_released(record)
    if not reason and predicted is None:
        reason = why_none or Reason.of(ReasonCode.DROP_NOT_PREDICTED)
    if not reason and record.phase is not DropPhase.DONE:
        reason = Reason.of(ReasonCode.NOT_DROPPED_YET)
    if not reason and record.latitude_deg is None:
        reason = Reason.of(ReasonCode.RELEASE_UNSEEN)
    distance_m = _apart_m(record, predicted)
    if not reason and distance_m is None:
        reason = Reason.of(ReasonCode.PLACE_NOT_PREDICTED)
    return DropComparison(
        item_id=record.plan_item_id,
        predicted_latitude_deg=None if predicted is None else predicted.release_latitude_deg,
        predicted_longitude_deg=None if predicted is None else predicted.release_longitude_deg,
        predicted_offset_m=None if predicted is None else predicted.offset_m,
        predicted_ground_speed_m_s=None if predicted is None else predicted.ground_speed_m_s,
        flown_latitude_deg=record.latitude_deg,
        flown_longitude_deg=record.longitude_deg,
        flown_offset_m=record.offset_m,
        flown_ground_speed_m_s=record.ground_speed_m_s,
        distance_m=distance_m,
        reason=reason,
    )


def _apart_m(record: DropRecord, predicted: PredictedDrop | None) -> float | None:
    if predicted is None or predicted.release_latitude_deg is None or predicted.release_longitude_deg is None:
        return None
    if record.latitude_deg is None or record.longitude_deg is None:
        return None
    there = (record.latitude_deg, record.longitude_deg)
    return distance_m(predicted.release_latitude_deg, predicted.release_longitude_deg, *there)
