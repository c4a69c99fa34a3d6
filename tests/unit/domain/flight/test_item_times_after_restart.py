"""The times of items around a restart of the service: what was not seen whole has none, and all others are true."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import islice

import pytest

from app.domain.events.run import RunItemEnded
from tests.support.flown_flights import BEGAN_S, DROP, MISSION, TICK_S, Flown, prefixes

LATE_S = 3.0 * TICK_S


@dataclass
class Timed(Flown):
    """`went`: when the vehicle went on to each mission item, and `landed_s` when it landed, as nobody else knows."""

    went: tuple[tuple[int, float], ...] = ((0, BEGAN_S),)

    def go_on(self, seq: int) -> None:
        super().go_on(seq)
        self.went += ((seq, self.now_s),)

    @property
    def ended(self) -> list[RunItemEnded]:
        return [one for one in self.recorded if isinstance(one, RunItemEnded)]

    def true_s(self) -> dict[str, float]:
        """How long each leg took. The hold is left out: of it, the waypoint and its drop have a share."""
        times = [*self.went, (-1, self.now_s)]
        legs = {seq: times[at + 1][1] - began_s for at, (seq, began_s) in enumerate(times[:-1])}
        return {MISSION.plan_item_of[seq]: took_s for seq, took_s in legs.items() if seq not in DROP.hold_seqs}


@pytest.mark.parametrize("down_s", [0.5, 3.0, 12.0])
def test_an_item_has_its_true_time_or_none(down_s: float) -> None:
    for before in islice(prefixes(Timed()), 0, None, 9):
        after = before.restarted(down_s)
        assert isinstance(after, Timed)
        after.to_the_end()
        told = Counter(one.item_id for one in after.ended)
        assert max(told.values(), default=1) == 1, f"each is told once, killed after {before.now_s - BEGAN_S:.1f} s"
        true_s = after.true_s()
        for one in after.ended:
            if one.began_s is None or one.ended_s is None:
                continue
            took_s = one.ended_s - one.began_s
            longest_s = true_s.get(one.item_id, DROP.hold_s + 10.0)
            assert took_s <= longest_s + LATE_S, (before.now_s - BEGAN_S, one, longest_s)
            if one.item_id in true_s and one.item_id != "home":
                assert took_s >= longest_s - LATE_S, (before.now_s - BEGAN_S, one, longest_s)
            if one.item_id == "home":  # it lands seconds before its run is over
                assert took_s >= longest_s - 4.0, (before.now_s - BEGAN_S, one, longest_s)


def test_a_drop_that_was_commanded_before_a_restart_has_no_time() -> None:
    flown = Timed()
    while flown.released_s is None:
        flown.tick()
    told = [one.item_id for one in flown.ended]
    assert told[-1] == MISSION.plan_item_of[DROP.hold_seqs[-1]], "the wait for it is over"
    again = flown.restarted(5.0)
    assert isinstance(again, Timed)
    again.to_the_end()
    (drop,) = (one for one in again.ended if one.item_id == DROP.plan_item_id)
    assert drop.began_s is None
    assert len({one.item_id for one in again.ended}) == len(again.ended)
