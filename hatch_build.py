"""Build hook: a wheel carries the built page (web/dist becomes app/page); an editable install reads web/dist."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageHook(BuildHookInterface):  # type: ignore[type-arg]
    """Puts the page into a wheel, and refuses to build one without it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling before it collects files; `version` is "standard" or "editable"."""
        if version != "standard":
            return
        page = Path(self.root) / "web" / "dist"
        if not (page / "index.html").is_file():
            raise FileNotFoundError(f"{page} is missing: run `make` first, a wheel without the page is of no use")
        build_data["force_include"][str(page)] = "app/page"
