"""Predicted against flown: every example plan on every suited simulated vehicle, in calm air and in wind.

Usage: python -m bench.prediction [--wind 5] [PLAN.json ...]

The flights are in this process on simulated time, so that the table is the same on every machine. Exit status 1 when an
item's time is off by more than 15 % (a second for an item shorter than 6.7 s), or a release by more than 15 % of its
lead (fixed wings) or 3 m (all others). `+-` is what the prediction itself calls unsure: it may be off by so much more.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from app.domain.plan import Plan, parse_plan
from app.domain.vehicle.state import VehicleType
from bench.predicted_flight import AIRFRAMES, DropRow, ItemRow, PredictedFlight, predicted_and_flown
from tests.support.paths import PLANS

WIDTHS = (24, 10, 10, 8, 8)


def winds(speed_m_s: float) -> Sequence[tuple[float, float]]:
    """Calm air, a wind to the north, and one to the east (where the air goes)."""
    return ((0.0, 0.0), (speed_m_s, 0.0), (0.0, speed_m_s)) if speed_m_s > 0.0 else ((0.0, 0.0),)


def main() -> None:
    """Fly all, print the table; exit status 1 if anything is out of bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plans", nargs="*", type=Path)
    parser.add_argument("--wind", type=float, default=5.0, help="m/s; 0: calm air only")
    arguments = parser.parse_args()
    failures: list[str] = []
    flights = 0
    for path in arguments.plans or sorted(PLANS.glob("*.json")):
        plan = parse_plan(json.loads(path.read_text(encoding="utf-8")))
        for airframe in AIRFRAMES[plan.vehicle_type]:
            for wind_m_s in winds(arguments.wind):
                title = f"{path.stem}, {airframe}, {_wind_words(wind_m_s)}"
                if _is_blown_away(plan, wind_m_s):
                    sys.stdout.write(f"\n{title}: not flown, it is slower than the wind\n")
                    continue
                flown = predicted_and_flown(plan, airframe, wind_m_s=wind_m_s)
                flights += 1
                sys.stdout.writelines(f"{line}\n" for line in table(title, flown))
                failures += [f"{title}: {failure}" for failure in flown.failures]
    sys.stdout.write(f"\n{flights} flights, {len(failures)} out of bounds\n")
    sys.stdout.writelines(f"  {failure}\n" for failure in failures)
    sys.exit(1 if failures else 0)


def table(title: str, flown: PredictedFlight) -> Iterator[str]:
    """One flight: a line for each visit of an item, one for each release, the whole."""
    yield ""
    yield title
    yield _line("item", "predicted", "flown", "off", "+-")
    for item in flown.items:
        yield _item_line(item)
    yield _line("whole flight", _s(flown.predicted_s), _s(flown.flown_s), _percent(_whole(flown)), "")
    for drop in flown.drops:
        yield _drop_line(drop)


def _item_line(item: ItemRow) -> str:
    name = item.item_id if item.visit == 1 else f"{item.item_id} ({item.visit})"
    unsure = f"{item.uncertainty_s:.1f} s" if item.uncertainty_s else ""
    line = _line(name, _s(item.predicted_s), _s(item.flown_s), _percent(item.difference), unsure)
    return line if item.is_within else f"{line}   OUT OF BOUNDS"


def _drop_line(drop: DropRow) -> str:
    apart = "not released" if drop.apart_m is None else f"{drop.apart_m:.1f} m from the predicted position"
    line = f"  release {drop.item_id}: {apart} (lead {drop.lead_m:.1f} m, bound {drop.bound_m:.1f} m)"
    return line if drop.is_within else f"{line}   OUT OF BOUNDS"


def _line(name: str, *columns: str) -> str:
    return (
        "  "
        + name.ljust(WIDTHS[0])
        + "".join(text.rjust(width) for text, width in zip(columns, WIDTHS[1:], strict=True))
    )


def _whole(flown: PredictedFlight) -> float | None:
    return None if not flown.flown_s else (flown.predicted_s - flown.flown_s) / flown.flown_s


def _s(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.1f} s"


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:+.0f} %"


def _wind_words(wind_m_s: tuple[float, float]) -> str:
    north, east = wind_m_s
    if not north and not east:
        return "calm"
    return f"{abs(north or east):g} m/s of wind to the {'north' if north else 'east'}"


def _is_blown_away(plan: Plan, wind_m_s: tuple[float, float]) -> bool:
    """An airship that is slower than the air."""
    if plan.vehicle_type is not VehicleType.AIRSHIP:
        return False
    return max(abs(part) for part in wind_m_s) >= 3.0


if __name__ == "__main__":
    main()
