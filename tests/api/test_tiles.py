"""The map under the page's map: a server's pictures or a file's, named in the page and let in by its policy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from pmtiles.tile import Compression, Entry, TileType, serialize_directory, serialize_header, zxy_to_tileid

from app.api.tiles import Pmtiles
from app.config import Settings
from app.domain.errors import InvalidInputError
from tests.support.service_in_process import SETTINGS, run_service

PNG = b"\x89PNG\r\n\x1a\n"


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
    [(TileType.MVT, b"PMTiles", "no pictures"), (TileType.PNG, b"MBTiles", "not a PMTiles file")],
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
        SETTINGS, web_root=tmp_path, tile_file=write_file(tmp_path / "m.pmtiles"), tile_attribution="A<B"
    )
    async with run_service(tmp_path, settings=settings) as service:
        _, headers, text = await service.call("GET", "/")
        assert '<meta name="waydrop-tiles" content="/tiles/{z}/{x}/{y}" />' in text
        assert '<meta name="waydrop-tiles-by" content="A&lt;B" />' in text
        assert '<meta name="waydrop-tiles-zooms" content="0 2" />' in text
        assert "img-src 'self' data:" in headers["Content-Security-Policy"]
        async with service.http.get(f"{service.url}/tiles/1/0/1") as answer:
            assert (answer.status, answer.content_type) == (200, "image/png")
            assert await answer.read() == PNG + b"quarter"
        async with service.http.get(f"{service.url}/tiles/2/0/0") as answer:
            assert (answer.status, await answer.read()) == (204, b"")


async def test_only_the_server_of_the_tiles_is_let_in_beside_the_service(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("<head>", encoding="utf-8")
    settings = replace(SETTINGS, web_root=tmp_path, tile_url="https://tiles.example:8443/{z}/{x}/{y}.png")
    async with run_service(tmp_path, settings=settings) as service:
        _, headers, text = await service.call("GET", "/")
        policy = headers["Content-Security-Policy"]
        assert "img-src 'self' https://tiles.example:8443 data:" in policy
        assert "connect-src 'self' https://tiles.example:8443;" in policy
        assert 'content="https://tiles.example:8443/{z}/{x}/{y}.png"' in text


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
