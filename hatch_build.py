"""Build hook: a wheel carries what was built, the page (web/dist becomes app/page) and the simulated vehicles' dialect.

An editable install reads both where they were built.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

DIALECT = Path("app", "simulator", "dialect", "generated")


class BuiltFilesHook(BuildHookInterface):  # type: ignore[type-arg]
    """Puts the page into a wheel, and refuses to build one without it; the dialect, if it was built."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before it collects files; `version` is "standard" or "editable"."""
        if version != "standard":
            return
        page = Path(self.root) / "web" / "dist"
        if not (page / "index.html").is_file():
            raise FileNotFoundError(f"{page} is missing: run `make` first, a wheel without the page is of no use")
        build_data["force_include"][str(page)] = "app/page"
        for module in (Path(self.root) / DIALECT).glob("*.py"):  # ignored by git, so hatchling would leave it out
            build_data["force_include"][str(module)] = str(DIALECT / module.name)
