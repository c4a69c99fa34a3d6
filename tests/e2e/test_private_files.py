"""Whatever the real service writes, only the user that runs it has access to it."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import aiohttp
import pytest

from tests.support.paths import PLANS
from tests.support.service_process import Dispatcher, ServiceProcess
from tests.support.simulated import SimulatedFleet


@pytest.fixture
def careless_umask() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


def modes_in(data: Path) -> dict[Path, int]:
    """Of all but the test's own log. What goes away while it is looked at, such as a journal of SQLite, has none."""
    modes: dict[Path, int] = {}
    for path in data.rglob("*"):
        if path.name != "service.log":
            with suppress(FileNotFoundError):
                modes[path] = stat.S_IMODE(path.stat().st_mode)
    return modes


@pytest.mark.usefixtures("careless_umask")
async def test_the_data_folder_and_all_in_it(tmp_path: Path, http: aiohttp.ClientSession) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o700)  # the log of the test lies in it
    home = {"HOME": str(tmp_path / "no home")}  # the cache of mavsdk is in the data folder then
    (tmp_path / "no home").write_text("no folder can be made here")
    with SimulatedFleet("quad") as fleet, ServiceProcess(data, fleet.connections, **home) as service:
        dispatcher = Dispatcher(http, service.url)
        await dispatcher.until_vehicles(1)
        await dispatcher.post("/plans", json.loads((PLANS / "clinic-run.json").read_text(encoding="utf-8")))
        await dispatcher.post("/webhooks", {"url": "http://127.0.0.1:9/"})
        modes = modes_in(data)
        assert len(modes) >= 5
        assert [str(path) for path, mode in modes.items() if mode & 0o077] == []
