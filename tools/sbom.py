"""`python -m tools.sbom FILE [LOCK]`: the bill of materials of the container image (CycloneDX), from the lock files.

The Python packages are those of LOCK (requirements.txt) that are installed on Linux, by the hashes that the image
installs them with; the page's are those of web/package-lock.json that are built into it. What the base image itself
contains is in that image's own bill of materials.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any, Final

from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation import make_schemabased_validator
from packaging.markers import Marker

ROOT: Final = Path(__file__).resolve().parents[1]
SPEC: Final = "1.5"
"""npm writes this version, so that both parts have it."""

IMAGE: Final = {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix", "python_version": "3.11"}
_MARKED = re.compile(r"^(?P<package>[A-Za-z0-9._-]+==[^\s;]+)\s*;\s*(?P<marker>[^\\]*[^\\\s])")


def installed_on_linux(lock: str) -> str:
    """A lock file without the packages that other platforms need."""
    kept, is_kept = [], True
    for line in lock.splitlines():
        if line and not line.startswith((" ", "#")):
            marked = _MARKED.match(line)
            is_kept = marked is None or Marker(marked["marker"]).evaluate(dict(IMAGE))
            line = line if marked is None else line.replace(line[marked.end("package") : marked.end("marker")], "")
        if is_kept:
            kept.append(line)
    return "\n".join(kept) + "\n"


def python_part(lock_file: str = "requirements.txt") -> dict[str, Any]:
    """What pip installs into the image."""
    lock = installed_on_linux((ROOT / lock_file).read_text(encoding="utf-8"))
    command = [sys.executable, "-m", "cyclonedx_py", "requirements", "--pyproject", "pyproject.toml"]
    return _made([*command, "--spec-version", SPEC, "--short-PURLs", "-"], ROOT, lock)


def page_part() -> dict[str, Any]:
    """What npm builds into the page."""
    return _made(
        ["npm", "sbom", "--omit", "dev", "--sbom-format", "cyclonedx", "--package-lock-only"], ROOT / "web", ""
    )


def merged(python: dict[str, Any], page: dict[str, Any]) -> dict[str, Any]:
    """Both as one: the page is a component of the service."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    whole = {**python["metadata"]["component"], "version": project["version"]}
    its_page = page["metadata"]["component"]
    from_python, from_page = python["components"], [its_page, *page["components"]]
    uses = [part["bom-ref"] for part in from_python] + [its_page["bom-ref"]]
    return {
        **python,
        "metadata": {**python["metadata"], "component": whole},
        "components": [*(_package(part) for part in from_python), *from_page],
        "dependencies": [{"ref": whole["bom-ref"], "dependsOn": sorted(uses)}, *page["dependencies"]],
    }


def problems_of(document: dict[str, Any]) -> str:
    """What does not fit the schema of CycloneDX; empty if nothing."""
    validator = make_schemabased_validator(OutputFormat.JSON, SchemaVersion.from_version(SPEC))
    return str(validator.validate_str(json.dumps(document)) or "")


def _package(component: dict[str, Any]) -> dict[str, Any]:
    """With its licence, and without an address: where it comes from is the choice of whoever builds."""
    hashes = [one for part in component.get("externalReferences", ()) for one in part.get("hashes", ())]
    plain = {name: value for name, value in component.items() if name not in ("externalReferences", "description")}
    return {**plain, "hashes": hashes, **_licences(component["name"])}


def _licences(package: str) -> dict[str, Any]:
    """As the installed package itself says; nothing if it does not say, or is not installed here."""
    try:
        said = metadata(package)
    except PackageNotFoundError:
        return {}
    if "License-Expression" in said:
        return {"licenses": [{"expression": said["License-Expression"]}]}
    name = said["License"].strip().partition("\n")[0] if "License" in said else ""
    return {"licenses": [{"license": {"name": name}}]} if name else {}


def _made(command: list[str], folder: Path, given: str) -> dict[str, Any]:
    done = subprocess.run(command, cwd=folder, input=given, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
    document: dict[str, Any] = json.loads(done.stdout)
    return document


def main() -> None:
    """Write the file of the command line."""
    if len(sys.argv) not in (2, 3):
        raise SystemExit("usage: python -m tools.sbom FILE [LOCK]")
    document = merged(python_part(*sys.argv[2:]), page_part())
    if problems := problems_of(document):
        raise SystemExit(f"the bill of materials does not fit CycloneDX {SPEC}: {problems}")
    path = Path(sys.argv[1])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    sys.stdout.write(f"{path}: {len(document['components'])} components\n")


if __name__ == "__main__":
    main()
