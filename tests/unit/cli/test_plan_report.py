"""What the command line says of a predicted flight."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from app.cli.plan_report import show_timeline
from app.domain.autopilot.declared import default_facts
from app.domain.prediction import CALM, Wind, predict
from tests.support.plan_pieces import multicopter, waypoint


@pytest.mark.parametrize(("wind", "told"), [(CALM, True), (Wind(), False), (Wind(3.0, 4.0), False)])
def test_a_prediction_for_calm_air_says_that_wind_is_not_in_it(wind: Wind, told: bool) -> None:
    plan, written = multicopter(waypoint()), io.StringIO()
    show_timeline(Console(file=written, width=200), plan, predict(plan, default_facts(plan.vehicle_type), wind))
    assert ("in calm air" in written.getvalue()) is told


def test_a_prediction_that_is_cut_off_says_so() -> None:
    jump = {"type": "jump", "target": "a", "repeats": 1000}
    plan, written = multicopter(waypoint(id="a"), *[waypoint(50)] * 5, jump), io.StringIO()
    show_timeline(Console(file=written, width=200), plan, predict(plan, default_facts(plan.vehicle_type)))
    assert "min: only the first 5000 visits are predicted" in written.getvalue().splitlines()[-1]
