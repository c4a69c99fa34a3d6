"""Hypothesis strategies: a plan that may be accepted, and a vehicle whose parameters may forbid it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from app.domain.plan import Plan, parse_plan
from app.simulator.firmware import PROFILES, FirmwareProfile
from app.simulator.params import Value
from tests.support.plan_pieces import at, square
from tests.support.plan_strategies import PLANS, sensible_plans

PARAMS: st.SearchStrategy[Mapping[str, Value]] = st.fixed_dictionaries(
    {},
    optional={
        "MIS_TKO_LAND_REQ": st.integers(0, 5),
        "GF_MAX_HOR_DIST": st.sampled_from([0.0, 150.0, 400.0, 700.0, 1200.0]),
        "GF_MAX_VER_DIST": st.sampled_from([0.0, 20.0, 39.9, 40.0, 60.0]),
        "FW_LND_ANG": st.sampled_from([3.0, 5.0, 8.0, 15.0]),
        "NAV_LOITER_RAD": st.sampled_from([30.0, 80.0, 150.0]),
        "NAV_ACC_RAD": st.sampled_from([0.5, 2.0, 10.0, 30.0]),
    },
)
_AREA = st.builds(
    square,
    st.sampled_from(["inclusion", "inclusion", "exclusion"]),
    st.integers(-300, 300).map(float),
    st.integers(-300, 300).map(float),
    st.sampled_from([20.0, 300.0, 1000.0, 1500.0]),
)
_CIRCLE = st.tuples(
    st.sampled_from(["inclusion", "exclusion"]),
    st.builds(at, st.integers(-400, 400).map(float), st.integers(-400, 400).map(float)),
    st.sampled_from([15.0, 200.0, 1200.0]),
).map(lambda parts: {"kind": parts[0], **parts[1], "radius_m": parts[2]})
_FENCE = st.fixed_dictionaries(
    {"polygons": st.lists(_AREA, max_size=2), "circles": st.lists(_CIRCLE, max_size=1)},
)
_APPROACH = st.tuples(
    st.builds(at, st.integers(-900, 900).map(float), st.integers(-300, 300).map(float)),
    st.sampled_from([10.0, 20.0, 30.0, 60.0]),
    st.sampled_from([0, 60, -100]),
).map(lambda parts: {**parts[0], "relative_altitude_m": parts[1], "radius_m": parts[2]})

_FIRMWARE = st.sampled_from(list(PROFILES.values()))


@dataclass(frozen=True, slots=True)
class Case:
    """A plan, the parameters that the vehicle does not have at their defaults, and its firmware."""

    plan: Plan
    params: Mapping[str, Value]
    profile: FirmwareProfile


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Mostly plans that are nearly right, some of no sense at all."""
    plan = draw(st.one_of(sensible_plans(), sensible_plans(), sensible_plans(), PLANS))
    document: dict[str, Any] = plan.model_dump(mode="json")
    if draw(st.booleans()):
        document["geofence"] = draw(_FENCE)
    if draw(st.booleans()) and document["items"][-1]["type"] == "land" and plan.vehicle_type == "fixed_wing":
        document["items"][-1]["approach"] = draw(_APPROACH)
    if draw(st.integers(0, 5)) == 0:
        del document["items"][draw(st.integers(0, len(document["items"]) - 1))]
    if not document["items"]:
        document = plan.model_dump(mode="json")
    return Case(parse_plan(document), draw(PARAMS), draw(_FIRMWARE))
