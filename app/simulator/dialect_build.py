"""Makes a Python module of the dialect's XML with pymavlink's mavgen.

A build step: `python -m app.simulator.dialect_build` puts the module into the package, which nothing has to write to
later. The module is named by what it was made of, so that none is ever taken for another's.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

XML_FOLDER = Path(__file__).with_name("dialect")
MAIN_XML = "waydrop.xml"
BUILT = "generated"
"""The folder in the package that the build step writes to."""


def module_name(xml_folder: Path = XML_FOLDER) -> str:
    """File name by SHA-256 over every XML and the version of pymavlink, whose templates the module comes from."""
    digest = hashlib.sha256(f"pymavlink {version('pymavlink')}\n".encode())
    for xml in sorted(xml_folder.glob("*.xml")):
        content = xml.read_bytes()
        digest.update(f"{xml.name} {len(content)}\n".encode() + content)
    return f"waydrop_dialect_{digest.hexdigest()[:16]}.py"


def module_path(xml_folder: Path = XML_FOLDER) -> Path:
    """The module that was built; if none was, the one in the user's cache, made now when it is not there.

    Raises OSError when nothing was built and the cache cannot be written.
    """
    name = module_name(xml_folder)
    built, cached = xml_folder / BUILT / name, _cache_folder() / name
    for path in built, cached:
        if path.is_file():
            return path
    return generate(cached, xml_folder)


def build(xml_folder: Path = XML_FOLDER) -> Path:
    """Put the module into the package, and take away those that were made of something else."""
    path = xml_folder / BUILT / module_name(xml_folder)
    if not path.is_file():
        generate(path, xml_folder)
    for other in path.parent.glob("*.py"):
        if other != path:
            other.unlink()
    return path


def generate(target: Path, xml_folder: Path = XML_FOLDER) -> Path:
    """Write `target` in one step: processes that start together each make their own copy, the last rename wins."""
    from pymavlink.generator import mavgen, mavparse  # type: ignore[import-untyped]

    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".build-") as scratch:
        made = Path(scratch) / "waydrop_dialect.py"
        options = mavgen.Opts(str(made), wire_protocol=mavparse.PROTOCOL_2_0, language="Python3", validate=False)
        with contextlib.redirect_stdout(io.StringIO()):
            mavgen.mavgen(options, [str(xml_folder / MAIN_XML)])
        os.replace(made, target)
    return target


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(base) / "waydrop" / "dialect"


if __name__ == "__main__":
    sys.stdout.write(f"{build()}\n")
