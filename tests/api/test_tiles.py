"""The map under the page's map: a server's pictures or a file's, named in the page and let in by its policy."""

from __future__ import annotations

import gzip
import itertools
import struct
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.api.tiles import Pmtiles, tile_id
from app.config import Settings
from app.domain.errors import InvalidInputError
from tests.support.service_in_process import SETTINGS, run_service

PNG = b"\x89PNG\r\n\x1a\n"


def varint(value: int) -> bytes:
    """As protobuf writes it."""
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def directory(entries: Sequence[tuple[int, int, int, int]]) -> bytes:
    """A packed directory of (tile id, run, length, offset)."""
    ids = [entry[0] for entry in entries]
    steps = [now - before for before, now in zip([0, *ids], ids, strict=False)]
    columns = [steps, [e[1] for e in entries], [e[2] for e in entries], [e[3] + 1 for e in entries]]
    return gzip.compress(b"".join(map(varint, [len(entries), *(n for column in columns for n in column)])))


def write_file(path: Path, *, kind: int = 2, magic: bytes = b"PMTiles") -> Path:
    """Zooms 0 to 2: one picture for zoom 0, one for all of zoom 1, and one of zoom 2 in a directory of its own."""
    pictures = [PNG + b"world", PNG + b"quarter", PNG + b"corner"]
    at = [0, len(pictures[0]), len(pictures[0]) + len(pictures[1])]
    leaf = directory([(tile_id(2, 3, 3), 1, len(pictures[2]), at[2])])
    root = directory([(0, 1, len(pictures[0]), 0), (1, 4, len(pictures[1]), at[1]), (5, 0, len(leaf), 0)])
    places = [127, len(root), 0, 0, 127 + len(root), len(leaf), 127 + len(root) + len(leaf), sum(map(len, pictures))]
    head = struct.pack("<7sB11QBBBBBB", magic, 3, *places, 6, 3, 3, 1, 2, 1, kind, 0, 2)
    path.write_bytes(head.ljust(127, b"\0") + root + leaf + b"".join(pictures))
    return path


def test_tiles_are_numbered_as_the_specification_does() -> None:
    assert [tile_id(*at) for at in ((0, 0, 0), (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0), (2, 0, 0))] == [*range(6)]


@given(st.integers(0, 6))
def test_each_tile_of_a_zoom_has_a_number_of_its_own_next_to_its_neighbour_s(z: int) -> None:
    places = {tile_id(z, x, y): (x, y) for x in range(1 << z) for y in range(1 << z)}
    first = (4**z - 1) // 3
    assert sorted(places) == list(range(first, first + 4**z))
    way = [places[number] for number in sorted(places)]
    assert all(abs(a - c) + abs(b - d) == 1 for (a, b), (c, d) in itertools.pairwise(way))


def test_pictures_are_found_in_runs_and_in_inner_directories_and_nowhere_else(tmp_path: Path) -> None:
    tiles = Pmtiles(write_file(tmp_path / "map.pmtiles"))
    assert (tiles.tile(0, 0, 0), tiles.tile(1, 1, 0)) == (PNG + b"world", PNG + b"quarter")
    assert tiles.tile(2, 3, 3) == PNG + b"corner"
    assert [tiles.tile(*at) for at in ((2, 0, 0), (2, 4, 3), (3, 0, 0), (1, 0, 2))] == [None] * 4


@pytest.mark.parametrize(("kind", "magic", "why"), [(1, b"PMTiles", "no pictures"), (2, b"MBTiles", "no PMTiles file")])
def test_a_file_that_cannot_be_shown_is_refused_at_the_start(tmp_path: Path, kind: int, magic: bytes, why: str) -> None:
    with pytest.raises(InvalidInputError, match=why):
        Pmtiles(write_file(tmp_path / "map.pmtiles", kind=kind, magic=magic))
    with pytest.raises(InvalidInputError, match="cannot be read"):
        Pmtiles(tmp_path / "none.pmtiles")


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
