"""What holds for every test."""

from __future__ import annotations

import gc
from typing import Any

import pytest
import structlog
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling
from xdist.workermanage import WorkerController

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")

TOGETHER = ("tests/browser", "tests/e2e/cluster")
"""Folders whose tests share what is slow to start, a browser or a cluster: one worker has all of each."""

CROWDS = ("tests/e2e/test_drop_failures.py", "tests/e2e/test_every_plan.py")
"""A dozen vehicles fly in each: one crowd at a time."""

SLOW = ("tests/browser", "tests/e2e", "tests/contract")
"""Folders whose tests mostly wait, for flights and links."""

SLOW_AT_ONCE = 2
"""With four at a time and five workers, browsers and vehicles took all of two cores, and tests waited in vain. The
third worker has the quick ones, which use what the others leave.
"""


DIED: list[str] = []


class SlowBesideQuick(LoadFileScheduling):
    """One worker has all tests of a file, or of a folder of TOGETHER. Slow ones come first, some of them at a time."""

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.partition("::")[0]
        if path in CROWDS:
            return CROWDS[0]
        return next((folder for folder in TOGETHER if path.startswith(f"{folder}/")), path)

    def _assign_work_unit(self, node: WorkerController) -> None:
        others = [units for other, units in self.assigned_work.items() if other is not node]
        if sum(any(map(self._is_slow_and_open, units.items())) for units in others) >= SLOW_AT_ONCE:
            quick = next((scope for scope in self.workqueue if not is_slow(scope)), None)
            if quick is not None:
                self.workqueue.move_to_end(quick, last=False)
        super()._assign_work_unit(node)

    @staticmethod
    def _is_slow_and_open(unit: tuple[str, dict[str, bool]]) -> bool:
        scope, is_done = unit
        return is_slow(scope) and not all(is_done.values())


gc.disable()  # until all is collected: thousands of tests, and what they import, stay until the end


def pytest_collection_finish() -> None:
    """From here on garbage is looked for, and only in what the tests themselves make; and logs tell all."""
    gc.freeze()
    gc.enable()
    structlog.reset_defaults()  # a benchmark whose parts a test imports is silent, and would silence all tests


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: WorkerController, error: object) -> None:
    """A worker that dies while it collects leaves no failed test, and pytest would call that a success."""
    if error:
        DIED.append(node.gateway.id)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if DIED and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.INTERNAL_ERROR


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> SlowBesideQuick:
    """Called by pytest-xdist when it runs with several workers."""
    return SlowBesideQuick(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes longest is not begun last: the folders that stay together, then other flights, then all else."""
    items.sort(key=lambda item: (not item.nodeid.startswith(TOGETHER), not is_slow(item.nodeid)))


def is_slow(path: str) -> bool:
    return path.startswith(SLOW)
