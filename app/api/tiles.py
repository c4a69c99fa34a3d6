"""Map tiles for the page: from a tile server, or from a PMTiles file that this service reads."""

from __future__ import annotations

import asyncio
import html
import os
from pathlib import Path
from typing import Final, Self

from aiohttp import web
from pmtiles.reader import Reader
from pmtiles.tile import Compression, MagicNumberNotFound, SpecVersionUnsupported, TileType, deserialize_header
from yarl import URL

from app.api.bodies import meet_expectation
from app.api.guard import PAGE_POLICY
from app.api.problems import ApiError
from app.domain.errors import InvalidInputError

MEDIA: Final = {TileType.PNG: "image/png", TileType.JPEG: "image/jpeg", TileType.WEBP: "image/webp"}
_HEADER_BYTES: Final = 127


class Pmtiles:
    """One open PMTiles file (version 3) with raster tiles; the page's style has no layers for vector tiles.

    Reads are positioned, so threads may share it. It stays open as long as the service runs.
    """

    def __init__(self, path: Path) -> None:
        """Raises InvalidInputError: it cannot be read, or is not a PMTiles file with pictures."""
        try:
            self._file = os.open(path, os.O_RDONLY)
            header = deserialize_header(self._read(0, _HEADER_BYTES))
        except (OSError, IndexError) as error:
            raise InvalidInputError(f"{path} cannot be read: {error}", hint="give a .pmtiles file") from error
        except (MagicNumberNotFound, SpecVersionUnsupported, ValueError) as error:
            raise InvalidInputError(
                f"{path} is not a PMTiles file of version 3", hint="make one with `pmtiles convert`"
            ) from error
        if header["internal_compression"] is not Compression.GZIP:
            raise InvalidInputError(
                f"{path} has directories that are not compressed by gzip", hint="make one with `pmtiles convert`"
            )
        if header["tile_type"] not in MEDIA:
            raise InvalidInputError(
                f"{path} has no pictures", hint="PNG, JPEG and WebP tiles are shown, no vector tiles"
            )
        self.media_type = MEDIA[header["tile_type"]]
        self.zooms = (header["min_zoom"], header["max_zoom"])
        self._reader = Reader(self._read)  # type: ignore[no-untyped-call]

    @classmethod
    def opened(cls, path: Path | None) -> Self | None:
        """The file, if there is one."""
        return None if path is None else cls(path)

    def tile(self, z: int, x: int, y: int) -> bytes | None:
        """The picture, or None if the file has none there."""
        low, high = self.zooms
        if not (low <= z <= high and 0 <= x < 1 << z and 0 <= y < 1 << z):
            return None
        picture: bytes | None = self._reader.get(z, x, y)  # type: ignore[no-untyped-call]
        return picture

    def _read(self, offset: int, length: int) -> bytes:
        return os.pread(self._file, length, offset)


OWN_PATH: Final = "/tiles/{z}/{x}/{y}"
_DAY: Final = "public, max-age=86400"


class Tiles:
    """Configures the page for tiles, and serves those of a file. Like the page, they need no token."""

    def __init__(self, url: str | None, file: Pmtiles | None, attribution: str) -> None:
        self._url = OWN_PATH if file is not None else url
        self._file = file
        self._attribution = attribution

    def add_to(self, app: web.Application) -> None:
        """Add /tiles/{z}/{x}/{y} if the tiles come from a file."""
        if self._file is not None:
            path = "/tiles/{z:[0-9]{1,2}}/{x:[0-9]{1,8}}/{y:[0-9]{1,8}}"
            app.router.add_get(path, self.tile, expect_handler=meet_expectation)

    def told(self, index: str) -> str:
        """Insert the tile source into the head of the page."""
        if self._url is None:
            return index
        facts = {"waydrop-tiles": self._url, "waydrop-tiles-by": self._attribution}
        if self._file is not None:
            facts["waydrop-tiles-zooms"] = "{} {}".format(*self._file.zooms)
        tags = "".join(f'<meta name="{name}" content="{html.escape(value)}" />' for name, value in facts.items())
        return index.replace("<head>", f"<head>{tags}", 1)

    @property
    def policy(self) -> str:
        """Extend the page's security policy by the tile server."""
        if self._url is None or self._file is not None:
            return PAGE_POLICY
        origin = str(URL(self._url, encoded=True).origin())
        return PAGE_POLICY.replace("img-src 'self'", f"img-src 'self' {origin}").replace(
            "connect-src 'self'", f"connect-src 'self' {origin}"
        )

    async def tile(self, request: web.Request) -> web.Response:
        """Serve one tile of the file, or no content where the file has none."""
        if self._file is None:
            raise ApiError("path.not_found", "no map tiles are configured")
        z, x, y = (int(request.match_info[name]) for name in ("z", "x", "y"))
        picture = await asyncio.to_thread(self._file.tile, z, x, y)
        if picture is None:
            return web.Response(status=204)  # not a 404: browsers would log an error for each tile outside the area
        return web.Response(body=picture, content_type=self._file.media_type, headers={"Cache-Control": _DAY})
