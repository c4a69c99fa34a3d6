"""Maps made for tests: a PMTiles file with vector tiles, and a server outside with a style and pictures."""

from __future__ import annotations

import gzip
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

import mapbox_vector_tile
from aiohttp import web
from pmtiles.tile import Compression, TileType, zxy_to_tileid
from pmtiles.writer import Writer

EXTENT: Final = 4096
STRIPES: Final = 64
ZOOM: Final = 14


def tile_at(latitude_deg: float, longitude_deg: float, zoom: int) -> tuple[int, int]:
    """Column and row of the tile there."""
    turned = math.asinh(math.tan(math.radians(latitude_deg)))
    across = 1 << zoom
    return int((longitude_deg + 180) / 360 * across), int((1 - turned / math.pi) / 2 * across)


def rectangle(west: float, south: float, east: float, north: float) -> str:
    """A polygon in a tile's own units, as well-known text."""
    return f"POLYGON(({west} {south}, {east} {south}, {east} {north}, {west} {north}, {west} {south}))"


def striped_tile() -> bytes:
    """Land with canals from north to south, some tens of metres wide at this zoom."""
    width = EXTENT / STRIPES
    water = [
        {"geometry": rectangle(n * width, 0, (n + 0.5) * width, EXTENT), "properties": {"kind": "water"}}
        for n in range(STRIPES)
    ]
    earth = [{"geometry": rectangle(0, 0, EXTENT, EXTENT), "properties": {"kind": "earth"}}]
    tile: bytes = mapbox_vector_tile.encode(
        [{"name": "earth", "features": earth}, {"name": "water", "features": water}]
    )
    return gzip.compress(tile)


def write_vector_map(path: Path, latitude_deg: float, longitude_deg: float) -> Path:
    """Some square kilometres of `striped_tile` in Protomaps' schema around a place, at one zoom."""
    column, row = tile_at(latitude_deg, longitude_deg, ZOOM)
    around = sorted(zxy_to_tileid(ZOOM, column + x, row + y) for x in (-1, 0, 1) for y in (-1, 0, 1))
    with path.open("wb") as file:
        writer = Writer(file)  # type: ignore[no-untyped-call]
        for tile_id in around:
            writer.write_tile(tile_id, striped_tile())  # type: ignore[no-untyped-call]
        header = {
            "tile_type": TileType.MVT,
            "tile_compression": Compression.GZIP,
            "min_lon_e7": int(longitude_deg * 1e7),
            "min_lat_e7": int(latitude_deg * 1e7),
            "max_lon_e7": int(longitude_deg * 1e7),
            "max_lat_e7": int(latitude_deg * 1e7),
            "center_zoom": ZOOM,
            "center_lon_e7": int(longitude_deg * 1e7),
            "center_lat_e7": int(latitude_deg * 1e7),
        }
        writer.finalize(header, {})  # type: ignore[no-untyped-call]
    return path


PINK_STYLE: Final = {
    "version": 8,
    "sources": {
        "zones": {
            "type": "geojson",
            "attribution": "© Map makers",
            "data": {
                "type": "Feature",
                "properties": {"name": "Zone"},
                "geometry": {"type": "Point", "coordinates": [8.5456, 47.398]},
            },
        }
    },
    "glyphs": "https://glyphs.example/{fontstack}/{range}.pbf",
    "layers": [
        {"id": "background", "type": "background", "paint": {"background-color": "#ff00aa"}},
        {
            "id": "places",
            "type": "symbol",
            "source": "zones",
            "layout": {"text-field": ["get", "name"], "text-font": ["Noto Sans Regular"]},
        },
    ],
}
"""It has an id that the page's own style has too, and a glyph server that does not exist."""


class MapServer:
    """Its address, and the paths that it was asked for."""

    def __init__(self) -> None:
        self.url = ""
        self.asked: list[str] = []

    async def style(self, request: web.Request) -> web.Response:
        """A style that is all pink."""
        self.asked.append(request.path)
        return web.json_response(PINK_STYLE, headers={"Access-Control-Allow-Origin": "*"})


@asynccontextmanager
async def map_server() -> AsyncIterator[MapServer]:
    """A server of another origin with /style.json."""
    server = MapServer()
    app = web.Application()
    app.router.add_get("/style.json", server.style)
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    host, port = runner.addresses[0][:2]
    server.url = f"http://{host}:{port}"
    yield server
    await runner.cleanup()
