"""Whatever a vehicle's parameters are set to, there is a prediction: no plan check and no run fails for them."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.domain.autopilot.declared import default_facts
from app.domain.plan import Plan, parse_plan
from app.domain.plan.walk import speed_range_m_s
from app.domain.prediction import predict
from app.domain.rules import check_plan
from app.domain.vehicle.state import FlightRegime, VehicleType
from tests.support.paths import PLANS
from tests.support.plan_pieces import HOME, facts

PLANS = sorted((PLANS).glob("*.json"))
NAMES = sorted({name for one in VehicleType for name in default_facts(one).parameters})
LARGEST, SMALLEST = 3.4028234663852886e38, 1.401298464324817e-45
"""Of the float32 in which PARAM_VALUE carries a parameter. One that is not finite is not decoded."""
EXTREMES = [-1.0, 0.0, LARGEST, -LARGEST, SMALLEST, -SMALLEST]
VALUES = st.one_of(
    st.sampled_from([*EXTREMES, 1e-9, 1e9, -1e9]),
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.integers(min_value=-(2**31), max_value=2**32 - 1),
)


@cache
def plan_in(path: Path) -> Plan:
    return parse_plan(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
@settings(max_examples=40, deadline=None)
@given(parameters=st.dictionaries(st.sampled_from(NAMES), VALUES))
def test_any_parameters_have_a_prediction_and_findings(path: Path, parameters: dict[str, float]) -> None:
    plan = plan_in(path)
    own = facts(plan.vehicle_type.value, home=HOME, **parameters)
    timeline = predict(plan, own)
    assert math.isfinite(timeline.duration_s)
    assert all(entry.duration_s >= 0.0 for entry in timeline.entries)
    check_plan(plan, own)


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
@pytest.mark.parametrize("value", EXTREMES)
def test_each_parameter_by_itself_may_be_anything(path: Path, value: float) -> None:
    plan = plan_in(path)
    for name in default_facts(plan.vehicle_type).parameters:
        own = facts(plan.vehicle_type.value, home=HOME, **{name: value})
        assert math.isfinite(predict(plan, own).duration_s), name
        check_plan(plan, own)


@pytest.mark.parametrize("unlimited", [-1.0, 0.0])
def test_a_speed_that_cannot_be_flown_is_the_types_default(unlimited: float) -> None:
    assert speed_range_m_s(facts("rover", RO_SPEED_LIM=unlimited), FlightRegime.WHEELS) == (0.0, 3.0)
    assert speed_range_m_s(facts(MPC_XY_VEL_MAX=unlimited), FlightRegime.ROTARY_WING) == (0.0, 12.0)
