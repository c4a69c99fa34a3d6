"""Map tiles for the page: from a tile server, or from a PMTiles file that this service reads."""

from __future__ import annotations

import asyncio
import gzip
import html
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final, Self

from aiohttp import web
from yarl import URL

from app.api.bodies import meet_expectation
from app.api.guard import PAGE_POLICY
from app.api.problems import ApiError
from app.domain.errors import InvalidInputError

# Reads pictures of a map from one PMTiles file (version 3), so that the page has a map without internet.
#
# Source: the PMTiles version 3 specification. Only raster tiles: the page's style has no layers for vector tiles.


_HEADER: Final = struct.Struct("<7sB11QBBBBBB")
_NO_COMPRESSION, _GZIP = 1, 2
MEDIA: Final = {2: "image/png", 3: "image/jpeg", 4: "image/webp"}
MAX_DEPTH: Final = 4
"""Directories within directories; the specification expects at most three."""


@dataclass(frozen=True, slots=True)
class Entry:
    """`run` tiles from `tile_id` on are the same `length` bytes at `offset`; with a run of 0 they are a directory."""

    tile_id: int
    offset: int
    length: int
    run: int


class Pmtiles:
    """One open file. Reads are positioned, so threads may share it. It stays open as long as the service runs."""

    def __init__(self, path: Path) -> None:
        """Raises InvalidInputError: it cannot be read, or is no PMTiles file with pictures."""
        try:
            self._file = os.open(path, os.O_RDONLY)
            head = _HEADER.unpack(os.pread(self._file, _HEADER.size, 0))
        except (OSError, struct.error) as error:
            raise InvalidInputError(f"{path} cannot be read: {error}", hint="give a .pmtiles file") from error
        magic, version, root, root_length, _, _, self._leaves, _, self._data, *_, compression, _, kind, low, high = head
        if magic != b"PMTiles" or version != 3 or compression not in (_NO_COMPRESSION, _GZIP):
            raise InvalidInputError(f"{path} is no PMTiles file of version 3", hint="make one with `pmtiles convert`")
        if kind not in MEDIA:
            raise InvalidInputError(
                f"{path} has no pictures", hint="PNG, JPEG and WebP tiles are shown, no vector tiles"
            )
        self.media_type = MEDIA[kind]
        self.zooms = (low, high)
        self._is_packed = compression == _GZIP
        self._root = (root, root_length)
        self._directory = lru_cache(maxsize=64)(self._read_directory)

    @classmethod
    def opened(cls, path: Path | None) -> Self | None:
        """The file, if there is one."""
        return None if path is None else cls(path)

    def tile(self, z: int, x: int, y: int) -> bytes | None:
        """The picture, or None if the file has none there."""
        low, high = self.zooms
        if not (low <= z <= high and 0 <= x < 1 << z and 0 <= y < 1 << z):
            return None
        wanted, (offset, length) = tile_id(z, x, y), self._root
        for _ in range(MAX_DEPTH):
            found = _find(self._directory(offset, length), wanted)
            if found is None:
                return None
            if found.run:
                return os.pread(self._file, found.length, self._data + found.offset)
            offset, length = self._leaves + found.offset, found.length
        return None

    def _read_directory(self, offset: int, length: int) -> Sequence[Entry]:
        raw = os.pread(self._file, length, offset)
        return read_directory(gzip.decompress(raw) if self._is_packed else raw)


def tile_id(z: int, x: int, y: int) -> int:
    """The number of a tile: all smaller zooms come first, and a zoom's tiles follow Hilbert's curve."""
    number = ((1 << 2 * z) - 1) // 3
    s = 1 << z >> 1
    while s:
        right, low = int(x & s > 0), int(y & s > 0)
        number += s * s * (3 * right ^ low)
        if not low:
            if right:
                x, y = s - 1 - x, s - 1 - y
            x, y = y, x
        s >>= 1
    return number


def read_directory(raw: bytes) -> tuple[Entry, ...]:
    """The entries of an unpacked directory: a count, then all ids, runs, lengths and offsets as varints."""
    numbers = _varints(raw)
    count = numbers[0]
    ids, runs, lengths, offsets = (numbers[1 + part * count : 1 + (part + 1) * count] for part in range(4))
    entries: list[Entry] = []
    at = 0
    for step, run, length, told in zip(ids, runs, lengths, offsets, strict=True):
        at += step
        offset = told - 1 if told else entries[-1].offset + entries[-1].length
        entries.append(Entry(at, offset, length, run))
    return tuple(entries)


def _varints(raw: bytes) -> list[int]:
    numbers, value, shift = [], 0, 0
    for byte in raw:
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            numbers.append(value)
            value, shift = 0, 0
    return numbers


def _find(entries: Sequence[Entry], wanted: int) -> Entry | None:
    low, high = 0, len(entries)
    while low < high:
        middle = (low + high) // 2
        if entries[middle].tile_id <= wanted:
            low = middle + 1
        else:
            high = middle
    if low == 0:
        return None
    found = entries[low - 1]
    return found if found.run == 0 or wanted - found.tile_id < found.run else None


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
