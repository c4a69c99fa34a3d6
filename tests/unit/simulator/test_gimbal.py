"""What the navigator says to cameras and gimbals, and when."""

from __future__ import annotations

import math

from app.simulator.navigator.gimbal import RELEASE_CONTROL, SET_NEUTRAL, GimbalTimer

TAKE_CONTROL = (1001, (7.0, 1.0, -1.0, -1.0))


def test_the_gimbal_turns_to_neutral_a_quarter_of_a_second_after_it_was_asked_to() -> None:
    timer = GimbalTimer(7)
    timer.start(10.0)
    assert timer.due(10.25) == ()
    assert timer.due(10.26) == (TAKE_CONTROL, SET_NEUTRAL, RELEASE_CONTROL)


def test_it_does_so_once() -> None:
    timer = GimbalTimer(7)
    timer.start(10.0)
    timer.due(10.3)
    assert timer.due(20.0) == ()


def test_asking_again_meanwhile_does_not_put_it_off() -> None:
    timer = GimbalTimer(7)
    timer.start(10.0)
    timer.start(10.2)
    assert timer.due(10.26) != ()


def test_a_restart_forgets_it() -> None:
    timer = GimbalTimer(7)
    timer.start(10.0)
    timer.boot()
    assert timer.due(math.nextafter(math.inf, 0.0)) == ()
