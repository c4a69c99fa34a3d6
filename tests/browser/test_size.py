"""How much a browser loads before the page can be used: exact, from the files that were built."""

from __future__ import annotations

import gzip
from typing import Final

from tests.support.paths import ROOT

DIST: Final = ROOT / "web" / "dist"
LIMIT_BYTES: Final = 1_000_000


def first_load() -> dict[str, int]:
    """Bytes on the wire of each file of the page, the map library's apart; a font is compressed in itself."""
    files = [path for path in DIST.rglob("*") if path.is_file() and path.suffix != ".gz"]
    page = [path for path in files if not path.is_relative_to(DIST / "docs") and "maplibre" not in path.name]
    return {path.name: len(gzip.compress(path.read_bytes())) for path in page}


def test_the_page_without_its_map_library_is_less_than_a_megabyte() -> None:
    loaded = first_load()
    assert {name.partition("-")[0].rpartition(".")[2] for name in loaded} >= {"index", "inter", "svg", "html"}
    assert sum(loaded.values()) < LIMIT_BYTES, loaded


def test_every_script_and_style_sheet_is_there_compressed_and_is_the_same() -> None:
    texts = [path for path in DIST.rglob("*") if path.suffix in (".js", ".css", ".json")]
    assert texts
    for path in texts:
        assert gzip.decompress(path.with_name(f"{path.name}.gz").read_bytes()) == path.read_bytes(), path.name
