"""Each item of a flight gets the time that it took, whatever the reports of the link say too early or together."""

from __future__ import annotations

from app.domain.events.run import RunItemEnded
from app.domain.flight.progress import ItemTimes, MissionProgress
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem

W, LAND, RTL = MavCmd.NAV_WAYPOINT, MavCmd.NAV_LAND, MavCmd.NAV_RETURN_TO_LAUNCH


def mission(*items: tuple[str, MavCmd]) -> Mission:
    made = tuple(MissionItem(seq, MavFrame.MISSION, command, param1=0.0) for seq, (_, command) in enumerate(items))
    return Mission(items=made, plan_item_of={seq: item_id for seq, (item_id, _) in enumerate(items)})


class Told:
    """Looks at a flight; `ended` is what came out, with the seconds that each item took."""

    def __init__(self, flown: Mission) -> None:
        self.times = ItemTimes.of(flown).started(0.0)
        self.progress = MissionProgress.of(flown).now_current(0)
        self.ended: list[RunItemEnded] = []

    def look(self, now_s: float, *, landed: bool = False, gap: bool = False) -> None:
        self.times, ended = self.times.seen(self.progress, now_s, landed=landed, gap=gap)
        self.ended += ended

    def reached(self, seq: int, now_s: float) -> None:
        self.progress = self.progress.reached(seq)
        self.look(now_s)

    def current(self, seq: int, now_s: float, *, gap: bool = False) -> None:
        self.progress = self.progress.now_current(seq)
        self.look(now_s, gap=gap)

    def took(self) -> list[tuple[str, float | None]]:
        return [
            (item.item_id, None if item.began_s is None or item.ended_s is None else item.ended_s - item.began_s)
            for item in self.ended
        ]


def test_an_item_ends_as_it_is_reached_and_only_once() -> None:
    told = Told(mission(("a", W), ("b", W)))
    told.reached(0, 10.0)
    told.reached(0, 11.0)
    told.current(1, 11.5)
    told.reached(1, 25.0)
    assert told.took() == [("a", 10.0), ("b", 15.0)]


def test_a_plan_item_of_several_mission_items_ends_with_the_last() -> None:
    told = Told(mission(("speed and point", W), ("speed and point", W), ("b", W)))
    told.reached(0, 1.0)
    assert told.took() == []
    told.reached(1, 12.0)
    assert told.took() == [("speed and point", 12.0)]


def test_a_landing_on_the_way_ends_when_the_mission_goes_on_and_not_as_it_begins() -> None:
    told = Told(mission(("yard", LAND), ("leave", W)))
    told.reached(0, 14.0)
    assert told.took() == []
    told.current(1, 31.0)
    assert told.took() == [("yard", 31.0)]


def test_a_return_ends_on_the_ground() -> None:
    told = Told(mission(("a", W), ("home", RTL)))
    told.reached(0, 10.0)
    told.reached(1, 10.1)  # PX4 reports it as it begins, perhaps before it shows it as current
    told.look(30.0)
    assert told.took() == [("a", 10.0)]
    told.look(60.0, landed=True)
    told.look(61.0, landed=True)
    assert told.took() == [("a", 10.0), ("home", 50.0)]


def test_a_jump_back_ends_the_item_before_it() -> None:
    told = Told(mission(("a", W), ("b", W), ("again", MavCmd.DO_JUMP), ("c", W)))
    for seq, now_s in ((1, 10.0), (0, 20.0), (1, 30.0), (3, 40.0)):
        told.current(seq, now_s)
    assert told.took() == [("a", 10.0), ("b", 10.0), ("a", 10.0), ("b", 10.0)]


def test_the_order_to_release_parts_the_waypoint_from_its_drop() -> None:
    told = Told(mission(("door", W), ("home", RTL)))
    for now_s in (20.0, 20.1):
        told.times, ended = told.times.releases("door", now_s)
        told.ended += ended
    told.progress = told.progress.also_flown("drop", through_seq=0)
    told.look(21.2)
    told.current(1, 21.3)
    assert [(item, round(took or 0.0, 3)) for item, took in told.took()] == [("door", 20.0), ("drop", 1.2)]


def test_what_ended_unseen_has_no_time_and_the_next_no_beginning() -> None:
    told = Told(mission(("a", W), ("b", W), ("c", W), ("d", W)))
    told.current(1, 10.0)
    told.current(2, 50.0, gap=True)
    told.current(3, 60.0)
    told.reached(3, 75.0)
    assert told.took() == [("a", 10.0), ("b", None), ("c", None), ("d", 15.0)]


def test_after_a_restart_of_ours_only_what_was_seen_whole_has_a_time() -> None:
    flown = mission(("a", W), ("b", W), ("c", W))
    told = Told(flown)
    told.times = ItemTimes.of(flown).recovered(1)
    told.progress = MissionProgress(2, {}, flown.plan_item_of, current=1, passed_to=0, flown=("a",))
    told.reached(1, 12.0)
    told.reached(2, 20.0)
    assert told.took() == [("b", None), ("c", 8.0)]


def test_a_pause_belongs_to_the_item_in_which_it_was_and_to_no_other() -> None:
    told = Told(mission(("a", W), ("b", W), ("c", W)))
    told.times = told.times.paused(3.0).paused(2.0)
    told.reached(0, 15.0)
    told.reached(1, 25.0)
    told.times = told.times.paused(4.0)
    told.times, ended = told.times.releases("c", 40.0)
    assert [item.paused_s for item in (*told.ended, *ended)] == [5.0, 0.0, 4.0]
    assert told.took() == [("a", 15.0), ("b", 10.0)], "the clock goes on meanwhile"
    assert told.times.paused(1.0).flown_on(mission(("d", W)), 41.0).paused_s == 0.0
