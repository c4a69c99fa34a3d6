"""What is predicted is what the simulated vehicles fly, on simulated time; `make bench-prediction` flies all plans."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.domain.plan import parse_plan
from bench.predicted_flight import predicted_and_flown

PLANS = Path(__file__).parents[2] / "plans"


@pytest.mark.parametrize(
    ("name", "airframe", "wind_m_s"),
    [
        ("rover-drop", "rover", (0.0, 0.0)),
        ("fixed-wing-pass", "plane", (0.0, 5.0)),
        ("multicopter-landed", "quad", (0.0, 0.0)),
        ("vtol-hover-drop", "vtol", (0.0, 0.0)),
    ],
)
def test_times_and_releases_are_as_predicted(name: str, airframe: str, wind_m_s: tuple[float, float]) -> None:
    """Item times within 15 %, releases within 3 m, of a wing within 15 % of the lead."""
    plan = parse_plan(json.loads((PLANS / f"{name}.json").read_text(encoding="utf-8")))
    flown = predicted_and_flown(plan, airframe, wind_m_s=wind_m_s)
    assert not flown.failures
    assert flown.drops
    assert flown.flown_s == pytest.approx(flown.predicted_s, rel=0.1)


def test_the_vehicles_own_parameters_are_what_is_predicted_with() -> None:
    """A quad that flies at 3 m/s, climbs at 1 m/s, lands slower and returns lower."""
    params = {"MPC_XY_CRUISE": 3.0, "MPC_Z_V_AUTO_UP": 1.0, "MPC_LAND_SPEED": 0.5, "RTL_RETURN_ALT": 20.0}
    plan = parse_plan(json.loads((PLANS / "multicopter-embedded.json").read_text(encoding="utf-8")))
    assert not predicted_and_flown(plan, "quad", params=params).failures
