"""Every documented code can be met. Those of one place only are met here; the test at the end counts."""

from __future__ import annotations

import re
from pathlib import Path

from app.api.application import ROUTES
from app.api.problems import PROBLEMS

HERE = Path(__file__).parent
FROM_SERVICES = {
    "cluster.bus_down": "only in a cluster: tests/e2e/cluster",
    "cluster.call_refused": "only in a cluster: tests/unit/services/remote",
    "cluster.site_taken": "only in a cluster: tests/unit/services/test_site_lease.py",
    "cluster.site_undecided": "only in a cluster: tests/unit/services/test_site_lease.py",
    "gateway.elsewhere": "only in a cluster: tests/e2e/cluster",
    "run.not_followed": "while a vehicle is not there, or another gateway has its site: tests/unit/services/runs",
    "job.not_taken": "between a gateway and an API node: tests/unit/services/remote",
    "input.invalid": "raised by services that read documents; its answer is tested with the table",
    "drop.consent_too_late": "comes 5 s after a question at the soonest; its answer is tested with the table",
    "command.expired": "ends a release within a run",
    "link_key.unusable": "raised by the command line, which writes the keys, and at the start",
    "plan.work_timeout": "after 30 s of work on one plan: tests/unit/services/test_plan_work.py",
    "mission.upload_failed": "ends a run, whose request was answered long before",
}


def test_each_code_is_met_over_a_socket_by_a_test() -> None:
    texts = "\n".join(
        path.read_text(encoding="utf-8") for path in HERE.glob("test_*.py") if path.name != Path(__file__).name
    )
    met = set(re.findall(r'"([a-z_]+(?:\.[a-z_]+)*)"', texts))
    assert sorted(set(PROBLEMS) - met - set(FROM_SERVICES)) == []


def test_each_code_that_a_route_names_is_in_the_table() -> None:
    for route in ROUTES:
        assert set(route.problem_codes) <= set(PROBLEMS), route.path
