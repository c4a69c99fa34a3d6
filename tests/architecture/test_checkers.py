"""The laws themselves are tested: each catches what it forbids and lets pass what it allows."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from tests.architecture import autopilots, events, imports, items, shape
from tests.architecture.sources import Source, source

Checker = Callable[[Iterable[Source]], list[str]]

FORBIDDEN: list[tuple[Checker, str, str]] = [
    (imports.wrong_directions, "app/domain/plan.py", "from app.services import runs"),
    (imports.wrong_directions, "app/domain/plan.py", "import app.config"),
    (imports.wrong_directions, "app/services/runs.py", "def f():\n    from app.vehicles.link import Link"),
    (imports.wrong_directions, "app/services/runs/start.py", "from ...storage import tables"),
    (imports.wrong_directions, "app/services/runs/__init__.py", "from ...storage import tables"),
    (imports.wrong_directions, "app/api/plans.py", "from app import storage"),
    (imports.wrong_directions, "app/application.py", "import app.simulator.fleet"),
    (imports.wrong_directions, "app/cli/sim.py", "from app.simulator import main"),
    (imports.wrong_directions, "app/simulator/fleet.py", "from app.domain.mission import MavCmd"),
    (imports.unknown_layers, "app/core/x.py", ""),
    (imports.unknown_layers, "app/things.py", ""),
    (imports.shared_exclusives, "app/services/fleet.py", "import mavsdk"),
    (imports.shared_exclusives, "app/vehicles/link.py", "from pymavlink import mavutil"),
    (imports.shared_exclusives, "app/services/journal.py", "import sqlalchemy.ext.asyncio"),
    (imports.shared_exclusives, "app/application.py", "from aiohttp import web"),
    (imports.servers_outside_api, "app/cli/serve.py", "from aiohttp import web"),
    (imports.servers_outside_api, "app/cli/serve.py", "import aiohttp\nx = aiohttp.web.Application()"),
    (imports.words_inside, "app/services/runs/offboard.py", "from app.domain.reasons import Reason, describe"),
    (events.wildcards, "app/cli/a.py", "match x:\n  case RunAck():\n    pass\n  case _:\n    pass"),
    (events.wildcards, "app/cli/a.py", "match x:\n  case run.RunAck() as ack:\n    pass\n  case _ if y:\n    pass"),
    (imports.impure_parts, "app/domain/plan.py", "import asyncio"),
    (imports.impure_parts, "app/interchange/kml.py", "from urllib.request import urlopen"),
    (imports.wrong_directions, "app/interchange/kml.py", "from app.services import plans"),
    (imports.wrong_directions, "app/domain/plan.py", "from app.interchange import kml"),
    (imports.impure_parts, "app/domain/rules/fence.py", "from pathlib import Path"),
    (items.ladders, "app/domain/a.py", "from app.domain.items import Land, Loiter\nx = isinstance(y, Land | Loiter)"),
    (items.ladders, "app/domain/a.py", "from app.domain.items import Land\nmatch y:\n    case Land():\n        pass"),
    (shape.long_functions, "app/a.py", "def f():\n" + "    x = 1\n" * 49),
    (shape.long_functions, "app/a.py", "class A:\n  async def f(self):\n" + "    x = 1\n" * 49),
    (shape.wide_constructors, "app/a.py", "class A:\n  def __init__(self, a, b, c, d, e, f, g, h, *, i): ..."),
    (shape.double_class_names, "app/a.py", "class A: ...\nclass A: ..."),
    (imports.tests_imported, "tests/api/test_a.py", "from tests.api.test_b import made"),
    (imports.tests_imported, "bench/a.py", "import tests.api.test_b.made"),
    (shape.vague_names, "app/api/utils.py", ""),
    (shape.vague_names, "app/api/run_manager.py", ""),
    (shape.vague_names, "app/api/runs.py", "class RunManager: ..."),
    (shape.prints, "app/cli/fly.py", "print('x')"),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept Exception: ..."),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept (OSError, Exception) as e: ..."),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept: ..."),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept BaseException: ..."),
    (shape.unbounded_queues, "app/a.py", "import asyncio\nq = asyncio.Queue()"),
    (shape.unbounded_queues, "app/a.py", "q = asyncio.Queue[int](maxsize=0)"),
    (shape.unbounded_queues, "app/a.py", "q = SimpleQueue()"),
    (shape.fixed_paths, "app/a.py", "x = '/tmp/waydrop'"),
    (autopilots.named_outside, "app/domain/a.py", "x = parameter(facts, 'NAV_ACC_RAD')"),
    (autopilots.named_outside, "app/domain/a.py", "x = f'set {name}, or RTL_TYPE to {1}'"),
    (autopilots.named_outside, "app/services/a.py", "raise Error('no gripper', hint='set PWM_MAIN_FUNCn to 430')"),
    (autopilots.named_outside, "app/services/a.py", "x = Violation('', 'NAV_DLL_ACT is 0')"),
    (autopilots.named_outside, "app/domain/a.py", "x = Rule('a.RTL_TYPE', ERROR, 'It flies back.', 'PX4', check)"),
    (autopilots.named_outside, "app/domain/autopilot/base.py", "x = 'MAV_SYS_ID'"),
    (autopilots.named_outside, "app/domain/a.py", "SINCE = FirmwareVersion(1, 14, 0)"),
    (autopilots.named_outside, "app/domain/a.py", "if facts.firmware < other: ..."),
    (autopilots.named_outside, "app/domain/a.py", "if found >= PAYLOAD_SINCE: ..."),
    (autopilots.named_outside, "app/domain/a.py", "x = message.custom_mode >> 16"),
    (autopilots.named_outside, "app/services/a.py", "send(main_mode=4)"),
    (autopilots.folders_imported, "app/domain/a.py", "from app.domain.autopilot.px4.parameters import parameter"),
    (autopilots.folders_imported, "app/services/a.py", "from app.domain.autopilot import px4"),
    (autopilots.folders_imported, "app/services/a.py", "import app.domain.autopilot.px4.modes"),
    (autopilots.folders_imported, "app/vehicles/a.py", "from app.domain.autopilot.px4.modes import flight_mode"),
]

ALLOWED: list[tuple[Checker, str, str]] = [
    (imports.wrong_directions, "app/services/runs/start.py", "from .model import A\nfrom app.domain import run"),
    (imports.wrong_directions, "app/application.py", "from app.api import server\nfrom app.storage import journal"),
    (imports.shared_exclusives, "app/vehicles/link.py", "import mavsdk"),
    (imports.servers_outside_api, "app/cli/client.py", "import aiohttp\nx = aiohttp.ClientSession()"),
    (imports.servers_outside_api, "app/api/server.py", "from aiohttp import web"),
    (imports.words_inside, "app/services/runs/offboard.py", "from app.domain.reasons import Reason"),
    (imports.words_inside, "app/cli/runs.py", "from app.domain.reasons import describe"),
    (events.wildcards, "app/cli/a.py", "match x:\n  case RunAck() | RunCommand():\n    pass"),
    (events.wildcards, "app/cli/a.py", "match x:\n  case Land():\n    pass\n  case _:\n    pass"),
    (imports.impure_parts, "app/services/journal.py", "import asyncio"),
    (shape.long_functions, "app/a.py", "def f():\n" + "    x = 1\n" * 48),
    (shape.vague_names, "app/api/runs.py", "class Runs: ..."),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept OSError: ..."),
    (shape.blind_excepts, "app/a.py", "try: ...\nexcept BaseException:\n    x = 1\n    raise"),
    (shape.unbounded_queues, "app/a.py", "q = asyncio.Queue(maxsize=10)\np = Queue(5)"),
    (autopilots.named_outside, "app/domain/a.py", "x = 1\n'''PX4 NAV_ACC_RAD.'''  # FW_LND_ANG"),
    (
        autopilots.named_outside,
        "app/domain/a.py",
        "@rules.error('a', 'RTL_TYPE 2 flies back.', 'PX4')\ndef check(): pass",
    ),
    (autopilots.named_outside, "app/domain/a.py", "x = 'NAV_DELAY, NAV_VTOL_TAKEOFF, MAV_TYPE, MISSION_CURRENT'"),
    (autopilots.folders_imported, "app/domain/a.py", "from app.domain.autopilot import Quantity, quantity"),
    (autopilots.folders_imported, "app/domain/autopilot/__init__.py", "from app.domain.autopilot.px4 import Px4"),
    (autopilots.named_outside, "app/domain/autopilot/px4/a.py", "x = facts['NAV_ACC_RAD']"),
    (autopilots.named_outside, "app/vehicles/a.py", "x = beat.custom_mode, 'MAV_SYS_ID'"),
]


@pytest.mark.parametrize(("check", "path", "text"), FORBIDDEN)
def test_what_is_forbidden_is_caught_with_its_place(check: Checker, path: str, text: str) -> None:
    violations = check([source(path, text)])
    assert violations
    assert all(violation.startswith(f"{path}:") for violation in violations)


@pytest.mark.parametrize(("check", "path", "text"), ALLOWED)
def test_what_is_allowed_passes(check: Checker, path: str, text: str) -> None:
    assert check([source(path, text)]) == []


def test_modules_that_import_each_other_are_caught_also_by_way_of_a_package() -> None:
    a = source("app/domain/a.py", "from app.domain.b import x")
    assert imports.import_cycles([a, source("app/domain/b.py", "from app.domain.a import y")])
    by_package = [
        source("app/domain/p/__init__.py", "from app.domain.p.q import x"),
        source("app/domain/p/q.py", "from app.domain.a import y"),
        source("app/domain/p/r.py", ""),
        source("app/domain/a.py", "from app.domain.p.r import z"),
    ]
    assert imports.import_cycles(by_package)
    later = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from app.domain.a import y"
    assert imports.import_cycles([a, source("app/domain/b.py", later)]) == []


def test_a_unit_test_outside_of_a_package_is_caught() -> None:
    packages = [source("app/domain/plan/parse.py", "")]
    assert imports.tests_outside_packages([source("tests/unit/domain/test_parse.py", "")], packages)
    assert imports.tests_outside_packages([source("tests/unit/domain/plan/test_parse.py", "")], packages) == []


def test_a_file_of_501_lines_is_too_long_and_one_of_500_is_not() -> None:
    assert shape.long_files({"app/a.py": "x\n" * 501})
    assert shape.long_files({"app/a.py": "x\n" * 500}) == []


@pytest.mark.parametrize(
    "line",
    [
        "--index" + "-url packages.example",
        '"resolved": ' + '"https:' + '//packages.example/x.tgz"',
        "pip install --find-links dir x",
        "curl https://pypi.org/simple",
    ],
)
def test_download_addresses_are_caught(line: str) -> None:
    assert shape.addresses({"Makefile": f"all:\n\t{line}\n"}) == ["Makefile:2: names a download address"]


def test_requirements_without_version_or_hash_are_caught() -> None:
    assert shape.unpinned({"requirements.txt": "six\n"})
    assert shape.unpinned({"requirements.txt": "six==1.17.0\n"})
    assert shape.unpinned({"requirements.txt": "six==1.17.0 \\\n    --hash=sha256:aa\n    # via x\n"}) == []


def test_packages_that_import_each_other_are_found() -> None:
    graph = {"domain.a": frozenset({"domain.b"}), "domain.b": frozenset({"domain.a"}), "api": frozenset({"domain.a"})}
    assert imports.package_cycles(graph) == [
        "domain.a and domain.b import each other; move what both need into one of them"
    ]
    assert imports.package_cycles(graph | {"domain.b": frozenset({"api"})}) == []
