"""What holds for every test."""

from __future__ import annotations

import gc
import signal
from typing import Any

import pytest
import structlog
from hypothesis import settings
from xdist.scheduler import LoadFileScheduling
from xdist.workermanage import WorkerController

# a slow machine is no broken law: time is measured in bench/, never in a test
settings.register_profile("waydrop", deadline=None)
settings.load_profile("waydrop")

TOGETHER = ("tests/browser/flying", "tests/browser", "tests/e2e/cluster")
"""Folders whose tests share what is slow to start, a browser or a cluster: one worker has all of each."""

CROWDS = ("tests/e2e/test_drop_failures.py", "tests/e2e/test_every_plan.py")
"""A dozen vehicles fly in each: one crowd at a time."""

LONG = {
    "tests/browser": 0.7,
    "tests/e2e/cluster": 0.5,
    "tests/e2e/test_takeover.py": 0.5,
    CROWDS[0]: 0.6,
}
"""Minutes of tests for one worker: not begun last."""

CORES = {**LONG, "tests/e2e": 0.2, "tests/contract": 0.2, "tests/api": 0.5}
"""How much of a core tests take, with all processes: they wait for flights and links. All others compute."""

CORES_IN_USE = 2.0
"""When browsers and vehicles took all of two cores, and computing tests more, others waited in vain."""


if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a shell's background: all that the tests start would ignore it
    signal.signal(signal.SIGINT, signal.default_int_handler)

DIED: list[str] = []


class WaitingBesideComputing(LoadFileScheduling):
    """One worker has all tests of a file, or of a folder of TOGETHER. Those that fill the cores go together."""

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.partition("::")[0]
        if path in CROWDS:
            return CROWDS[0]
        return next((folder for folder in TOGETHER if path.startswith(f"{folder}/")), path)

    def _assign_work_unit(self, node: WorkerController) -> None:
        others = [units for other, units in self.assigned_work.items() if other is not node]
        idle = CORES_IN_USE - sum(max(map(self._cores_in_use, units.items()), default=0.0) for units in others)
        fitting = [scope for scope in self.workqueue if cores(scope) <= idle]
        long = next((scope for scope in fitting if scope.startswith(tuple(LONG))), None)
        chosen = long or max(fitting, key=cores, default=None) or min(self.workqueue, key=cores)
        self.workqueue.move_to_end(chosen, last=False)
        super()._assign_work_unit(node)

    @staticmethod
    def _cores_in_use(unit: tuple[str, dict[str, bool]]) -> float:
        scope, is_done = unit
        return 0.0 if all(is_done.values()) else cores(scope)


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


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> WaitingBesideComputing:
    """Called by pytest-xdist when it runs with several workers."""
    return WaitingBesideComputing(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes longest is not begun last: the folders that stay together, then other flights, then all else."""
    items.sort(key=lambda item: _place(item.nodeid))


def _place(path: str) -> int:
    """In the order of CORES."""
    return next((number for number, start in enumerate(CORES) if path.startswith(start)), len(CORES))


def cores(path: str) -> float:
    """Of the whole machine, while the tests of a file or folder run."""
    return next((share for start, share in CORES.items() if path.startswith(start)), 1.0)
