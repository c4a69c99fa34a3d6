"""Maps under the page's grid: named in the page, let in by its policy, and a file's tiles served."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import mapbox_vector_tile
import pytest
from pmtiles.tile import Compression, Entry, TileType, serialize_directory, serialize_header, zxy_to_tileid

from app.api import MapSettings
from app.api.guard import PAGE_POLICY
from app.api.tiles import Pmtiles
from app.config import Settings
from app.domain.errors import InvalidInputError
from tests.support.map_files import ZOOM, tile_at, write_vector_map
from tests.support.service_in_process import SETTINGS, run_service

PNG = b"\x89PNG\r\n\x1a\n"


async def page_of(folder: Path, maps: MapSettings) -> tuple[str, dict[str, Any]]:
    """The security policy of a page with these maps, and what the page is told of them."""
    (folder / "index.html").write_text("<head>", encoding="utf-8")
    async with run_service(folder, settings=replace(SETTINGS, web_root=folder, maps=maps)) as service:
        _, headers, text = await service.call("GET", "/")
    told = re.search('<meta name="waydrop-maps" content="(.*?)" />', text)
    return headers["Content-Security-Policy"], json.loads(html.unescape(told[1])) if told else {}


def write_file(path: Path, *, kind: TileType = TileType.PNG, magic: bytes = b"PMTiles") -> Path:
    """Zooms 0 to 2: one picture for zoom 0, one for all of zoom 1, and one of zoom 2 in a directory of its own."""
    pictures = [PNG + b"world", PNG + b"quarter", PNG + b"corner"]
    at = [0, len(pictures[0]), len(pictures[0]) + len(pictures[1])]
    leaf = serialize_directory([Entry(zxy_to_tileid(2, 3, 3), at[2], len(pictures[2]), 1)])
    inner = [Entry(0, 0, len(pictures[0]), 1), Entry(1, at[1], len(pictures[1]), 4), Entry(5, 0, len(leaf), 0)]
    root = serialize_directory(inner)
    header = serialize_header(
        {
            "root_offset": 127,
            "root_length": len(root),
            "metadata_offset": 0,
            "metadata_length": 0,
            "leaf_directory_offset": 127 + len(root),
            "leaf_directory_length": len(leaf),
            "tile_data_offset": 127 + len(root) + len(leaf),
            "tile_data_length": sum(map(len, pictures)),
            "clustered": True,
            "internal_compression": Compression.GZIP,
            "tile_compression": Compression.NONE,
            "tile_type": kind,
            "min_zoom": 0,
            "max_zoom": 2,
        }
    )
    path.write_bytes(magic + header[len(magic) :] + root + leaf + b"".join(pictures))
    return path


def test_pictures_are_found_in_runs_and_in_inner_directories_and_nowhere_else(tmp_path: Path) -> None:
    tiles = Pmtiles(write_file(tmp_path / "map.pmtiles"))
    assert (tiles.tile(0, 0, 0), tiles.tile(1, 1, 0)) == (PNG + b"world", PNG + b"quarter")
    assert tiles.tile(2, 3, 3) == PNG + b"corner"
    assert [tiles.tile(*at) for at in ((2, 0, 0), (2, 4, 3), (3, 0, 0), (1, 0, 2))] == [None] * 4


@pytest.mark.parametrize(
    ("kind", "magic", "why"),
    [(TileType.AVIF, b"PMTiles", "cannot show"), (TileType.PNG, b"MBTiles", "not a PMTiles file")],
)
def test_a_file_that_cannot_be_shown_is_refused_at_the_start(
    tmp_path: Path, kind: TileType, magic: bytes, why: str
) -> None:
    with pytest.raises(InvalidInputError, match=why):
        Pmtiles(write_file(tmp_path / "map.pmtiles", kind=kind, magic=magic))
    with pytest.raises(InvalidInputError, match="cannot be read"):
        Pmtiles(tmp_path / "none.pmtiles")
    short, rubbish = tmp_path / "short.pmtiles", tmp_path / "rubbish.pmtiles"
    short.write_bytes(b"PMTiles\x03")
    rubbish.write_bytes(b"\xff" * 200)
    for path in (short, rubbish):
        with pytest.raises(InvalidInputError):
            Pmtiles(path)


async def test_the_page_names_the_file_s_tiles_and_serves_them_itself(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("<html><head><title>page</title></head>", encoding="utf-8")
    settings = replace(
        SETTINGS,
        web_root=tmp_path,
        maps=MapSettings(tile_file=write_file(tmp_path / "m.pmtiles"), tile_attribution="A<B"),
    )
    async with run_service(tmp_path, settings=settings) as service:
        _, headers, text = await service.call("GET", "/")
        assert "&quot;attribution&quot;: &quot;A&lt;B&quot;" in text
        assert "&quot;url&quot;: &quot;/tiles/{z}/{x}/{y}&quot;, &quot;zooms&quot;: [0, 2]" in text
        assert "img-src 'self' data:" in headers["Content-Security-Policy"]
        async with service.http.get(f"{service.url}/tiles/1/0/1") as answer:
            assert (answer.status, answer.content_type) == (200, "image/png")
            assert await answer.read() == PNG + b"quarter"
        async with service.http.get(f"{service.url}/tiles/2/0/0") as answer:
            assert (answer.status, await answer.read()) == (204, b"")


async def test_vector_tiles_are_served_as_they_are_in_the_file(tmp_path: Path) -> None:
    file = write_vector_map(tmp_path / "m.pmtiles", 47.4, 8.5)
    column, row = tile_at(47.4, 8.5, ZOOM)
    async with (
        run_service(tmp_path, settings=replace(SETTINGS, maps=MapSettings(tile_file=file))) as service,
        service.http.get(f"{service.url}/tiles/{ZOOM}/{column}/{row}") as answer,
    ):
        assert answer.headers["Content-Encoding"] == "gzip"
        assert answer.content_type == "application/vnd.mapbox-vector-tile"
        assert set(mapbox_vector_tile.decode(await answer.read())) == {"earth", "water"}


async def test_only_the_servers_of_the_maps_are_let_in_beside_the_service(tmp_path: Path) -> None:
    policy, told = await page_of(
        tmp_path,
        MapSettings(
            tile_url="https://tiles.example:8443/{z}/{x}/{y}.png",
            styles=("https://maps.example/light.json", "https://maps.example/dark.json"),
            origins=("https://sprites.example",),
            satellite_url="https://sky.example/{z}/{x}/{y}.jpg",
            satellite_attribution="Sky",
        ),
    )
    servers = "https://maps.example https://sprites.example https://tiles.example:8443 https://sky.example"
    assert f"img-src 'self' {servers} data:" in policy
    assert f"connect-src 'self' {servers};" in policy
    assert told == {
        "tiles": {"url": "https://tiles.example:8443/{z}/{x}/{y}.png", "attribution": ""},
        "styles": {"light": "https://maps.example/light.json", "dark": "https://maps.example/dark.json"},
        "satellite": {"url": "https://sky.example/{z}/{x}/{y}.jpg", "attribution": "Sky"},
    }


async def test_without_maps_the_policy_is_the_strict_one(tmp_path: Path) -> None:
    assert await page_of(tmp_path, MapSettings()) == (PAGE_POLICY, {})


@pytest.mark.parametrize(
    "url",
    [
        "https://tiles.example/{z}/{x}.png",
        "ftp://t.example/{z}/{x}/{y}",
        "https://a b/{z}/{x}/{y}",
        "/{z}/{x}/{y}",
        "https://t.example/{z}/{x}/{y};x",
    ],
)
def test_an_address_that_is_no_tiles_is_refused(url: str) -> None:
    with pytest.raises(ValueError, match="write it as https"):
        Settings(tile_url=url)


def test_the_page_offers_a_style_unless_it_is_turned_off() -> None:
    default = Settings().basemap_styles
    assert default is not None
    assert all(style.startswith("https://tiles.openfreemap.org/") for style in default)
    own = "https://maps.example/style.json"
    assert Settings(basemap_style=own).basemap_styles == (own, own)
    assert Settings(basemap_style=own, basemap_style_dark=f"{own}?dark").basemap_styles == (own, f"{own}?dark")
    assert Settings(basemap_style="off").basemap_styles is None


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("basemap_style", "maps.example/style.json", "write it as https"),
        ("basemap_style_dark", "off", "write it as https"),
        ("basemap_origins", "https://maps.example/path", "without a path"),
        ("satellite_url", "https://sky.example/", "write it as https"),
    ],
)
def test_an_address_of_a_map_that_is_none_is_refused(name: str, value: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        Settings(**{name: value})
