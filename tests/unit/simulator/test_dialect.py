"""The dialect is a build product named by what it was made of, and its messages have the bytes of MAVLink's own."""

from __future__ import annotations

import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common

from app.simulator import dialect_build
from app.simulator.dialect import mavlink

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


def test_a_module_is_named_by_its_xml_and_by_the_version_of_pymavlink(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    xml = copy_of_xml(tmp_path)
    name = dialect_build.module_name(tmp_path)
    assert name == dialect_build.module_name(), "the folder has no say"
    content = xml.read_text()
    xml.write_text(content.replace('name="HEARTBEAT"', 'name="HEARTBEET"'))
    changed = dialect_build.module_name(tmp_path)
    xml.write_text(content)
    (tmp_path / "included.xml").write_text("<mavlink/>")
    with_another_file = dialect_build.module_name(tmp_path)
    monkeypatch.setattr(dialect_build, "version", lambda package: f"{package} 9.9")
    with_another_pymavlink = dialect_build.module_name(tmp_path)
    assert len({name, changed, with_another_file, with_another_pymavlink}) == 4


def test_two_builds_have_the_same_bytes(tmp_path: Path) -> None:
    one, two = (dialect_build.generate(tmp_path / folder / f"{folder}.py") for folder in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()
    assert 'WIRE_PROTOCOL_VERSION = "2.0"' in one.read_text()


def test_a_build_leaves_only_the_module_of_this_xml(tmp_path: Path) -> None:
    xml = copy_of_xml(tmp_path)
    before = dialect_build.build(tmp_path)
    assert before == dialect_build.build(tmp_path)
    xml.write_text(xml.read_text().replace('name="HEARTBEAT"', 'name="HEARTBEET"'))
    after = dialect_build.build(tmp_path)
    assert list(after.parent.iterdir()) == [after]
    assert "HEARTBEET" in after.read_text()


def test_what_was_not_built_is_made_in_the_users_cache_and_never_in_the_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_of_xml(tmp_path / "package")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    first = dialect_build.module_path(tmp_path / "package")
    assert first.is_relative_to(tmp_path / "cache")
    assert [path.name for path in (tmp_path / "package").iterdir()] == [dialect_build.MAIN_XML]
    made_at = first.stat().st_mtime_ns
    assert dialect_build.module_path(tmp_path / "package") == first
    assert first.stat().st_mtime_ns == made_at


def test_the_one_in_the_package_comes_first_then_the_users_cache_and_neither_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package, name = tmp_path / "package", dialect_build.module_name()
    copy_of_xml(package)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    cached, built = tmp_path / ".cache/waydrop/dialect" / name, package / dialect_build.BUILT / name
    for path in cached, built:
        path.parent.mkdir(parents=True)
        path.write_text("as it was")
        assert dialect_build.module_path(package) == path
    assert dialect_build.build(package) == built
    assert [path.read_text() for path in (cached, built)] == ["as it was"] * 2
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    built.unlink()
    assert dialect_build.module_path(package) == cached, "empty is not set"


def test_many_processes_at_once_make_one_good_module(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path)
    env = environment(package, tmp_path / "cache")
    with ThreadPoolExecutor(4) as pool:
        ended = list(pool.map(lambda _: python(env, "-c", "import app.simulator.dialect"), range(4)))
    assert [process.returncode for process in ended] == [0] * 4, ended
    folder = tmp_path / "cache" / "waydrop" / "dialect"
    assert [path.name for path in folder.iterdir() if path.name != "__pycache__"] == [dialect_build.module_name()]


def test_once_built_a_process_needs_no_folder_that_it_can_write_to(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path)
    read_only = tmp_path / "home"
    read_only.write_text("a file: root could write to any folder")
    env = environment(package, read_only)
    failed = python(env, "-c", "import app.simulator.dialect")
    assert failed.returncode == 1
    assert "NotADirectoryError" in failed.stderr
    built = python(env, "-m", "app.simulator.dialect_build")
    assert built.stdout.strip() == str(package / "app/simulator/dialect/generated" / dialect_build.module_name())
    before = sorted(package.rglob("*"))
    started = python(
        env, "-c", "from app.simulator.fleet import build_vehicle; from app.simulator.dialect import mavlink"
    )
    assert (started.returncode, started.stderr) == (0, "")
    assert sorted(package.rglob("*")) == before


def copy_of_xml(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    return Path(shutil.copy(dialect_build.XML_FOLDER / dialect_build.MAIN_XML, folder))


def copy_of_package(folder: Path) -> Path:
    """The simulator alone, not yet built; the folder to start Python in."""
    source = dialect_build.XML_FOLDER.parent
    ignored = shutil.ignore_patterns("__pycache__", dialect_build.BUILT)
    shutil.copytree(source, folder / "package/app/simulator", ignore=ignored)
    (folder / "package/app/__init__.py").touch()
    return folder / "package"


def environment(package: Path, cache: Path) -> dict[str, str]:
    return {
        "PYTHONPATH": str(package),
        "XDG_CACHE_HOME": str(cache),
        "HOME": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def python(env: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], cwd=env["PYTHONPATH"], env=env, capture_output=True, text=True, timeout=60.0
    )
