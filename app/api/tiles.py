"""Maps under the page's own grid: what the page may offer, what its security policy allows, and a file's tiles."""

from __future__ import annotations

import asyncio
import html
import json
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
from app.api.settings import MapSettings
from app.domain.errors import InvalidInputError

MEDIA: Final = {
    TileType.PNG: "image/png",
    TileType.JPEG: "image/jpeg",
    TileType.WEBP: "image/webp",
    TileType.MVT: "application/vnd.mapbox-vector-tile",
}
_ENCODINGS: Final = {Compression.UNKNOWN: None, Compression.NONE: None, Compression.GZIP: "gzip"}
_HEADER_BYTES: Final = 127


class Pmtiles:
    """One open PMTiles file (version 3): pictures, or vector tiles in the schema of Protomaps' basemaps.

    Reads are positioned, so threads may share it. It stays open as long as the service runs.
    """

    def __init__(self, path: Path) -> None:
        """Raises InvalidInputError: it cannot be read, or is not a PMTiles file that the page can show."""
        try:
            self._file = os.open(path, os.O_RDONLY)
            header = deserialize_header(self._read(0, _HEADER_BYTES))
        except (OSError, IndexError) as error:
            raise InvalidInputError(
                f"WAYDROP_TILE_FILE: {path} cannot be read: {error}", hint="give a .pmtiles file"
            ) from error
        except (MagicNumberNotFound, SpecVersionUnsupported, ValueError) as error:
            raise InvalidInputError(
                f"{path} is not a PMTiles file of version 3", hint="make one with `pmtiles convert`"
            ) from error
        kind, compression = header["tile_type"], header["tile_compression"]
        if header["internal_compression"] is not Compression.GZIP or compression not in _ENCODINGS:
            raise InvalidInputError(
                f"{path} has directories or tiles that are not compressed by gzip",
                hint="make one with `pmtiles convert`",
            )
        if kind not in MEDIA:
            raise InvalidInputError(
                f"{path} has tiles of a type that the page cannot show", hint="use PNG, JPEG, WebP or MVT tiles"
            )
        self.is_vector = kind is TileType.MVT
        self.media_type = MEDIA[kind]
        self.encoding = _ENCODINGS[compression]
        self.zooms = (header["min_zoom"], header["max_zoom"])
        self._reader = Reader(self._read)  # type: ignore[no-untyped-call]

    @classmethod
    def opened(cls, path: Path | None) -> Self | None:
        """The file, if there is one."""
        return None if path is None else cls(path)

    def tile(self, z: int, x: int, y: int) -> bytes | None:
        """The tile as it is in the file, or None if the file has none there."""
        low, high = self.zooms
        if not (low <= z <= high and 0 <= x < 1 << z and 0 <= y < 1 << z):
            return None
        tile: bytes | None = self._reader.get(z, x, y)  # type: ignore[no-untyped-call]
        return tile

    def _read(self, offset: int, length: int) -> bytes:
        return os.pread(self._file, length, offset)


OWN_PATH: Final = "/tiles/{z}/{x}/{y}"
_DAY: Final = "public, max-age=86400"


class Maps:
    """The maps that the page may show, and the tiles of a file. Like the page, they need no token."""

    def __init__(self, settings: MapSettings, file: Pmtiles | None) -> None:
        self._settings = settings
        self._file = file

    def add_to(self, app: web.Application) -> None:
        """Add /tiles/{z}/{x}/{y} if there is a file."""
        if self._file is not None:
            path = "/tiles/{z:[0-9]{1,2}}/{x:[0-9]{1,8}}/{y:[0-9]{1,8}}"
            app.router.add_get(path, self.tile, expect_handler=meet_expectation)

    def insert_into(self, index: str) -> str:
        """Return the page with the configured maps in its head."""
        given = self._settings
        tiles: dict[str, object] | None = None
        if self._file is not None:
            tiles = {"url": OWN_PATH, "zooms": self._file.zooms, "vector": self._file.is_vector}
        elif given.tile_url is not None:
            tiles = {"url": given.tile_url}
        facts = {
            "tiles": tiles and {**tiles, "attribution": given.tile_attribution},
            "styles": given.styles and dict(zip(("light", "dark"), given.styles, strict=True)),
            "satellite": given.satellite_url
            and {"url": given.satellite_url, "attribution": given.satellite_attribution},
        }
        if not any(facts.values()):
            return index
        tag = f'<meta name="waydrop-maps" content="{html.escape(json.dumps(facts))}" />'
        return index.replace("<head>", f"<head>{tag}", 1)

    @property
    def policy(self) -> str:
        """Extend the page's security policy by the servers of the maps, and by no others."""
        given = self._settings
        addresses = [*(given.styles or ()), *given.origins]
        addresses += [] if self._file is not None or given.tile_url is None else [given.tile_url]
        addresses += [] if given.satellite_url is None else [given.satellite_url]
        origins = "".join(f" {one}" for one in dict.fromkeys(map(_origin, addresses)))
        return PAGE_POLICY.replace("img-src 'self'", f"img-src 'self'{origins}").replace(
            "connect-src 'self'", f"connect-src 'self'{origins}"
        )

    async def tile(self, request: web.Request) -> web.Response:
        """Serve one tile of the file, or no content where the file has none."""
        if self._file is None:
            raise ApiError("path.not_found", "no map tiles are configured")
        z, x, y = (int(request.match_info[name]) for name in ("z", "x", "y"))
        tile = await asyncio.to_thread(self._file.tile, z, x, y)
        if tile is None:
            return web.Response(status=204)  # not a 404: browsers would log an error for each tile outside the area
        headers = {"Cache-Control": _DAY}
        if self._file.encoding is not None:
            headers["Content-Encoding"] = self._file.encoding
        return web.Response(body=tile, content_type=self._file.media_type, headers=headers)


def _origin(address: str) -> str:
    return str(URL(address, encoded=True).origin())
