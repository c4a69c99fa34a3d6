"""Disarmed, a mode that cannot run is said by an event, once (scenarios 01, 18 and 21)."""

from __future__ import annotations

from app.simulator.events import EVENTS
from app.simulator.wire import Mode
from tests.support.offboard_sender import Sender
from tests.support.simulated_vehicle import GroundStation

WARNING = EVENTS["commander_failsafe_enter_generic_warn"][0]


def warned_of(gcs: GroundStation) -> list[int]:
    """The modes in the events' first argument."""
    return [int.from_bytes(e.arguments[:4], "little") for e in gcs.messages("EVENT") if e.id == WARNING]


def test_a_mode_that_cannot_run_is_said_once_each_time_it_is_asked_for() -> None:
    gcs = GroundStation()
    assert warned_of(gcs) == [], "nothing at power-up"
    gcs.set_mode(Mode.MISSION)
    gcs.fly(2.0)
    assert warned_of(gcs) == [Mode.MISSION]
    gcs.set_mode(Mode.LOITER)
    gcs.set_mode(Mode.OFFBOARD)
    assert warned_of(gcs) == [Mode.MISSION, Mode.OFFBOARD]
    assert gcs.texts() == []


def test_missing_sticks_are_another_matter() -> None:
    gcs = GroundStation()
    gcs.set_mode(Mode.POSCTL)
    assert warned_of(gcs) == []


def test_after_a_landing_offboard_is_wanted_again_and_has_no_stream() -> None:
    """But a failsafe that brought it down has said so before."""
    sender = Sender("quad", COM_OBL_RC_ACT=4).airborne()
    sender.gcs.set_mode(Mode.LAND)
    sender.gcs.until(lambda: not sender.gcs.armed, 60.0)
    sender.gcs.fly(0.1)
    assert warned_of(sender.gcs) == [Mode.OFFBOARD]
    other = Sender("quad", COM_OBL_RC_ACT=4).airborne()
    other.gcs.until(lambda: not other.gcs.armed, 60.0)
    other.gcs.fly(0.1)
    assert warned_of(other.gcs) == []
