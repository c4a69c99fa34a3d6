"""The map under the page's map, if there is one: pictures of a server, or of one file that this service reads."""

from __future__ import annotations

import asyncio
import html
from typing import Final

from aiohttp import web
from yarl import URL

from app.api.expectations import meet_expectation
from app.api.pmtiles import Pmtiles
from app.api.problems import ApiError
from app.api.security_headers import PAGE_POLICY

OWN_PATH: Final = "/tiles/{z}/{x}/{y}"
_DAY: Final = "public, max-age=86400"


class Tiles:
    """What the page is told of them, and the tiles of the file. Not secret: like the page they need no token."""

    def __init__(self, url: str | None, file: Pmtiles | None, attribution: str) -> None:
        self._url = OWN_PATH if file is not None else url
        self._file = file
        self._attribution = attribution

    def add_to(self, app: web.Application) -> None:
        """/tiles/{z}/{x}/{y}, if they come from a file."""
        if self._file is not None:
            path = "/tiles/{z:[0-9]{1,2}}/{x:[0-9]{1,8}}/{y:[0-9]{1,8}}"
            app.router.add_get(path, self.tile, expect_handler=meet_expectation)

    def told(self, index: str) -> str:
        """The page's document with the tiles named in its head."""
        if self._url is None:
            return index
        facts = {"waydrop-tiles": self._url, "waydrop-tiles-by": self._attribution}
        if self._file is not None:
            facts["waydrop-tiles-zooms"] = "{} {}".format(*self._file.zooms)
        tags = "".join(f'<meta name="{name}" content="{html.escape(value)}" />' for name, value in facts.items())
        return index.replace("<head>", f"<head>{tags}", 1)

    @property
    def policy(self) -> str:
        """The page's policy, with pictures of the tiles' server let in."""
        if self._url is None or self._file is not None:
            return PAGE_POLICY
        origin = str(URL(self._url, encoded=True).origin())
        return PAGE_POLICY.replace("img-src 'self'", f"img-src 'self' {origin}").replace(
            "connect-src 'self'", f"connect-src 'self' {origin}"
        )

    async def tile(self, request: web.Request) -> web.Response:
        """One picture of the file; nothing where it has none."""
        if self._file is None:
            raise ApiError("path.not_found", "there are no tiles here")
        z, x, y = (int(request.match_info[name]) for name in ("z", "x", "y"))
        picture = await asyncio.to_thread(self._file.tile, z, x, y)
        if picture is None:
            return web.Response(status=204)  # no fault: a browser would write each 404 beside the area into its console
        return web.Response(body=picture, content_type=self._file.media_type, headers={"Cache-Control": _DAY})
