"""Turns waydrop.xml into a Python module with pymavlink's mavgen, whenever the module is missing or older."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from pathlib import Path

from pymavlink.generator import mavgen, mavparse  # type: ignore[import-untyped]

XML = Path(__file__).with_name("waydrop.xml")
MODULE_NAME = "waydrop_dialect.py"


def module_path() -> Path:
    """The generated module: in the package when it can be written, else in the user's cache. Built if stale."""
    for folder in (XML.with_name("generated"), _cache_folder()):
        target = folder / MODULE_NAME
        if _is_fresh(target):
            return target
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            _generate(target)
            return target
    raise OSError(f"no folder to write the MAVLink dialect to (tried the package and {_cache_folder()})")


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "waydrop" / "dialect"


def _is_fresh(target: Path) -> bool:
    try:
        return target.stat().st_mtime >= XML.stat().st_mtime
    except OSError:
        return False


def _generate(target: Path) -> None:
    """Write `target` in one step: processes that start together each make their own copy, the last rename wins."""
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".build-") as scratch:
        made = Path(scratch) / MODULE_NAME
        options = mavgen.Opts(str(made), wire_protocol=mavparse.PROTOCOL_2_0, language="Python3", validate=False)
        with contextlib.redirect_stdout(io.StringIO()):
            mavgen.mavgen(options, [str(XML)])
        os.replace(made, target)
