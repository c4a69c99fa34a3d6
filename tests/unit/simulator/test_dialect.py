"""The dialect is built by itself, and its messages have the bytes of MAVLink's own."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from app.simulator.dialect import build, mavlink

EXTENDED_OR_NEW = {"MISSION_CURRENT", "MISSION_ACK", "MISSION_COUNT", "EVENT", "CURRENT_EVENT_SEQUENCE"} | {
    "PROTOCOL_VERSION",
    "CURRENT_MODE",
    "AVAILABLE_MODES",
    "AVAILABLE_MODES_MONITOR",
}
CRC_EXTRA = {"EVENT": 160, "CURRENT_EVENT_SEQUENCE": 106, "CURRENT_MODE": 193, "PARAM_ERROR": 209}
"""From MAVLink's generated C headers."""


def test_every_message_that_pymavlink_has_too_is_the_same() -> None:
    theirs = {message.msgname: message for message in common.mavlink_map.values()}
    compared = 0
    for message in mavlink.mavlink_map.values():
        other = theirs.get(message.msgname)
        if other is None or message.msgname in EXTENDED_OR_NEW:
            continue
        assert (message.id, message.crc_extra, message.ordered_fieldnames) == (
            other.id,
            other.crc_extra,
            other.ordered_fieldnames,
        )
        compared += 1
    assert compared > 35


def test_what_pymavlink_lacks_is_added_behind_what_it_has() -> None:
    for name in ("MISSION_CURRENT", "MISSION_ACK", "MISSION_COUNT"):
        ours = next(m for m in mavlink.mavlink_map.values() if m.msgname == name)
        theirs = next(m for m in common.mavlink_map.values() if m.msgname == name)
        assert ours.crc_extra == theirs.crc_extra
        assert ours.ordered_fieldnames[: len(theirs.ordered_fieldnames)] == theirs.ordered_fieldnames
    assert [m.crc_extra for n in CRC_EXTRA for m in mavlink.mavlink_map.values() if m.msgname == n] == list(
        CRC_EXTRA.values()
    )


def test_many_processes_at_once_build_one_good_module(tmp_path: Path) -> None:
    target = tmp_path / "dialect.py"
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: _build_in_a_process(target), range(4)))
    compile(target.read_text(), str(target), "exec")
    assert list(tmp_path.iterdir()) == [target]


def _build_in_a_process(target: Path) -> None:
    code = f"from pathlib import Path; from app.simulator.dialect import build; build._generate(Path({str(target)!r}))"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_module_older_than_the_xml_is_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    xml = tmp_path / "waydrop.xml"
    xml.write_bytes(build.XML.read_bytes())
    monkeypatch.setattr(build, "XML", xml)
    first = build.module_path()
    assert first.parent == tmp_path / "generated"
    os.utime(first, (1, 1))
    assert build.module_path() == first
    assert first.stat().st_mtime > 1


def test_a_package_that_cannot_be_written_uses_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    xml = tmp_path / "waydrop.xml"
    xml.write_bytes(build.XML.read_bytes())
    (tmp_path / "generated").write_text("a file where the folder should be")
    monkeypatch.setattr(build, "XML", xml)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert build.module_path().is_relative_to(tmp_path / "cache")
