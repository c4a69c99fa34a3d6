"""Runs of a cluster, as its parts have them: a part may not have a run yet, or be away."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import aiohttp

from tests.support.service_process import ServiceProcess, until

FLIGHT_S = 300.0
ENDS = ("completed", "aborted", "failed", "lost")


async def run_or_none(http: aiohttp.ClientSession, part: ServiceProcess, run_id: str) -> Any:
    """The run; None while the part does not have it or its store is away."""
    async with http.get(f"{part.url}/api/v1/runs/{run_id}") as answer:
        return await answer.json() if answer.status == 200 else None


async def until_run(
    http: aiohttp.ClientSession, part: ServiceProcess, run_id: str, states: Sequence[str], promise: str
) -> Any:
    """Wait until the part has the run in one of the states."""
    return await until(
        lambda: run_or_none(http, part, run_id),
        lambda run: run is not None and run["state"] in states,
        promise,
        FLIGHT_S,
    )


def require_delivered(run: Any) -> None:
    """The flight was completed, and its drop released. If not, say why, and when another gateway went on with it."""
    drop = run["drops"][0]
    why = {"reason": run["reason"], "drop": drop["reason"], "attempts": drop["attempts"], "item": run["item_id"]}
    times = {name: run[name] for name in ("started_at", "taken_over", "ended_at")}
    assert (run["state"], drop["outcome"]) == ("completed", "released"), json.dumps(why | times)
