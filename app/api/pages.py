"""The web page and the API documentation page, served from one folder, and a notice if they are not built."""

from __future__ import annotations

import asyncio
import mimetypes
from pathlib import Path
from typing import Final

from aiohttp import web

from app.api.bodies import meet_expectation
from app.api.guard import DOCS_POLICY, PAGE_POLICY
from app.api.problems import ApiError
from app.api.routing import API
from app.api.tiles import Maps

_FOREVER: Final = "public, max-age=31536000, immutable"
_REVALIDATE: Final = "no-cache"
_TYPES: Final = {".js": "text/javascript", ".mjs": "text/javascript", ".json": "application/json"}
_NOT_BUILT: Final = f"""<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Waydrop</title>
<h1>Waydrop is running; its page is not built</h1>
<p>In a checkout, build it with <code>make</code> (Node.js 20 or newer) and restart.</p>
<p>The API needs no page: <a href="{API}/openapi.json">OpenAPI</a>, <a href="{API}/asyncapi.json">AsyncAPI</a>,
<a href="{API}/schemas/plan">plan schema</a>, <a href="/readyz">readiness</a>.</p>
</html>
"""


class Pages:
    """Serves the files that were in the folder at start-up. No request path ever reaches the file system."""

    def __init__(self, root: Path | None, maps: Maps) -> None:
        self._files = _files(root)
        self._maps = maps

    def add_to(self, app: web.Application) -> None:
        """Add `/`, its files, and the documentation at /api/v1/docs/."""
        for path, handler in (
            ("/", self.index),
            ("/assets/{name}", self.asset),
            ("/{name:[^/]+\\.[^/]+}", self.file),
            (f"{API}/docs", self.docs),
            (f"{API}/docs/{{name:[^/]*}}", self.docs_file),
        ):
            app.router.add_get(path, handler, expect_handler=meet_expectation)

    async def index(self, _: web.Request) -> web.StreamResponse:
        """Serve the page."""
        path = self._files.get("index.html")
        if path is None:
            return _not_built()
        text = self._maps.insert_into(await asyncio.to_thread(path.read_text, encoding="utf-8"))
        headers = {"Content-Security-Policy": self._maps.policy, "Cache-Control": _REVALIDATE}
        return web.Response(text=text, content_type="text/html", headers=headers)

    async def asset(self, request: web.Request) -> web.StreamResponse:
        """Serve a file with a hash in its name, which never changes."""
        return self._send(f"assets/{request.match_info['name']}", PAGE_POLICY, _FOREVER)

    async def file(self, request: web.Request) -> web.StreamResponse:
        """Serve a file next to the page."""
        return self._send(request.match_info["name"], PAGE_POLICY, _REVALIDATE)

    async def docs(self, _: web.Request) -> web.StreamResponse:
        """Serve the documentation page."""
        name = "docs/index.html"
        return self._send(name, DOCS_POLICY, _REVALIDATE) if name in self._files else _not_built()

    async def docs_file(self, request: web.Request) -> web.StreamResponse:
        """Serve a file of the documentation page."""
        name = request.match_info["name"]
        return self._send(f"docs/{name}", DOCS_POLICY, _REVALIDATE) if name else await self.docs(request)

    def _send(self, name: str, policy: str, caching: str) -> web.StreamResponse:
        path = self._files.get(name)
        if path is None:
            raise ApiError("path.not_found", "file not found")
        response = web.FileResponse(path)
        response.headers["Content-Security-Policy"] = policy
        response.headers["Cache-Control"] = caching
        response.headers["Content-Type"] = _content_type(path)
        return response


def _files(root: Path | None) -> dict[str, Path]:
    """All files by their relative path. Requests select from these."""
    if root is None or not root.is_dir():
        return {}
    return {path.relative_to(root).as_posix(): path for path in sorted(root.rglob("*")) if path.is_file()}


def _content_type(path: Path) -> str:
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind


def _not_built() -> web.Response:
    headers = {"Content-Security-Policy": PAGE_POLICY, "Cache-Control": _REVALIDATE}
    return web.Response(text=_NOT_BUILT, content_type="text/html", headers=headers)
