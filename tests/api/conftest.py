"""Fixtures of the API tests."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Iterator
from enum import Enum
from pathlib import Path
from typing import Any

import pytest

from tests.support.api_node import ClusterServers, cluster_servers, run_node
from tests.support.paths import PLANS
from tests.support.service_in_process import Service, run_service


class Form(Enum):
    """What serves the API."""

    SINGLE = "single"
    NODE = "node"


BOTH_FORMS = (
    "test_idempotency",
    "test_jobs",
    "test_large_plans",
    "test_nul",
    "test_plans",
    "test_runs",
    "test_vehicles",
)
"""Modules whose tests with `service` run against a single Waydrop and against an API node of a cluster.

They are about the routes behind which an API node has services of its own: plans and keys in PostgreSQL, and vehicles,
runs and jobs through calls of a gateway. A test that is marked `single` uses what only a gateway has. The other modules
test code that both forms share (requests, sockets, limits, documents, pages), routes that only a gateway has (offboard
control, tasks, simulator), or look into a single journal; tests/e2e/cluster has events, webhooks and failures.
"""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Both forms for BOTH_FORMS."""
    module = metafunc.module.__name__.rpartition(".")[2]
    is_single = metafunc.definition.get_closest_marker("single") is not None
    if "service" in metafunc.fixturenames and module in BOTH_FORMS and not is_single:
        metafunc.parametrize("service", Form, indirect=True, ids=[form.value for form in Form])


@pytest.fixture(scope="session")
def servers() -> Iterator[ClusterServers]:
    """NATS and PostgreSQL."""
    with cluster_servers() as running:
        yield running


@pytest.fixture
async def service(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[Service]:
    """A service with two vehicles on a tokenless loopback."""
    if getattr(request, "param", Form.SINGLE) is Form.NODE:
        running = run_node(tmp_path, request.getfixturevalue("servers"))
    else:
        running = run_service(tmp_path)
    async with running as started:
        yield started


@pytest.fixture
def plan() -> dict[str, Any]:
    """A plan that can be flown."""
    document: dict[str, Any] = json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8"))
    return document
