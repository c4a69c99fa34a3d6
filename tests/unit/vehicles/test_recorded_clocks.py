"""On the recorded flights of a real PX4, a restart is told where one happened, and nowhere else, however late it is."""

from __future__ import annotations

import gzip
import json
import random
from pathlib import Path

import pytest

from app.vehicles.link_watch import ClockAssessment, Fix, Timeline
from tests.support.paths import DATA

TRACES = sorted((DATA / "traces").glob("*.jsonl.gz"))
RESTARTED = "23_reboot_midflight"

Sample = tuple[float, int, Fix | None]
"""Received at these seconds; time_boot_ms; the position, if it is one."""


def samples(path: Path) -> tuple[float, list[Sample]]:
    """The speed of the recorded vehicle, and each sample of its clock."""
    with gzip.open(path, "rt") as lines:
        header, *rows = map(json.loads, lines)
    found: list[Sample] = []
    for row in rows:
        name, fields = row.get("name"), row.get("f") or {}
        if row["dir"] != "rx" or row.get("link") or name not in {"SYSTEM_TIME", "GLOBAL_POSITION_INT"}:
            continue
        fix = None
        if name == "GLOBAL_POSITION_INT":
            fix = Fix(fields["lat"] / 1e7, fields["lon"] / 1e7, fields["vx"] / 1e2, fields["vy"] / 1e2)
        found.append((row["t"], fields["time_boot_ms"], fix))
    return float(header.get("speed_factor") or 1.0), found


def late(given: list[Sample], chance: random.Random) -> list[Sample]:
    """The same, one in three up to half a second late, and all of them after a standstill of the link of 3 s."""
    stands_s = chance.uniform(given[0][0], given[-1][0])
    found = []
    for at_s, boot_ms, fix in given:
        received_s = at_s + (chance.uniform(0.0, 0.5) if chance.random() < 0.3 else 0.0)
        if 0.0 < received_s - stands_s < 3.0:
            received_s = stands_s + 3.0 + chance.uniform(0.0, 0.1)
        found.append((received_s, boot_ms, fix))
    return sorted(found, key=lambda one: one[0])


@pytest.mark.parametrize("disturbed", [False, True], ids=["as recorded", "late"])
@pytest.mark.parametrize("path", TRACES, ids=lambda path: path.name.partition(".")[0])
def test_a_recorded_flight_restarts_where_it_did(path: Path, disturbed: bool) -> None:
    speed, recorded = samples(path)
    for seed in range(20 if disturbed else 1):
        timeline, given = Timeline(), late(recorded, random.Random(seed)) if disturbed else recorded
        found = [timeline.take(boot_ms, at_s, fix, rate=speed) for at_s, boot_ms, fix in given]
        assert found.count(ClockAssessment.REBOOTED) == int(path.name.startswith(RESTARTED)), f"seed {seed}"
        assert ClockAssessment.DUPLICATE not in found, f"seed {seed}"
        assert disturbed or not timeline.is_in_doubt
