"""The built page: its own files, nothing else, and under a strict policy."""

from __future__ import annotations

import gzip
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest
from yarl import URL

from tests.support.service_in_process import SETTINGS, Service, run_service


@pytest.fixture
async def built(tmp_path: Path) -> AsyncIterator[Service]:
    """A service with a page, and a secret next to it."""
    root = tmp_path / "dist"
    for name, text in (
        ("index.html", "<!doctype html><title>page</title>"),
        ("favicon.svg", "<svg/>"),
        ("assets/index-abc123.js", "1"),
        ("assets/index-abc123.css", "a{}"),
        ("docs/index.html", "<!doctype html><title>docs</title>"),
        ("docs/docs.js", "2"),
    ):
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        if path.name == "index-abc123.js":
            path.with_name(f"{path.name}.gz").write_bytes(gzip.compress(text.encode()))
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    async with run_service(tmp_path, settings=replace(SETTINGS, web_root=root)) as service:
        yield service


async def test_the_page_comes_with_a_policy_that_lets_no_foreign_or_inline_script_run(built: Service) -> None:
    status, headers, text = await built.call("GET", "/")
    assert (status, "<title>page" in text) == (200, True)
    policy = headers["Content-Security-Policy"]
    assert "script-src 'self';" in policy
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["Cache-Control"] == "no-cache"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["X-Frame-Options"] == "DENY"


async def test_hashed_files_are_kept_for_ever_and_have_the_right_type(built: Service) -> None:
    for name, content_type in (("js", "text/javascript; charset=utf-8"), ("css", "text/css; charset=utf-8")):
        status, headers, _ = await built.call("GET", f"/assets/index-abc123.{name}")
        assert (status, headers["Content-Type"]) == (200, content_type)
        assert "immutable" in headers["Cache-Control"]
    status, headers, _ = await built.call("GET", "/favicon.svg")
    assert (status, headers["Cache-Control"]) == (200, "no-cache")


async def test_what_the_build_compressed_is_sent_so_to_a_browser_that_takes_it(built: Service) -> None:
    for accepted, encoding in (("gzip, deflate, br", "gzip"), ("identity", None)):
        status, headers, body = await built.call(
            "GET", "/assets/index-abc123.js", headers={"Accept-Encoding": accepted}
        )
        assert (status, headers.get("Content-Encoding"), body) == (200, encoding, "1")
        assert headers["Content-Type"] == "text/javascript; charset=utf-8"
        assert "immutable" in headers["Cache-Control"]


async def test_the_documentation_page_is_served_with_its_files(built: Service) -> None:
    for path in ("/api/v1/docs", "/api/v1/docs/", "/api/v1/docs/index.html"):
        status, headers, text = await built.call("GET", path)
        assert (status, "<title>docs" in text) == (200, True), path
        assert "script-src 'self';" in headers["Content-Security-Policy"]
    status, _, text = await built.call("GET", "/api/v1/docs/docs.js")
    assert (status, text) == (200, "2")


@pytest.mark.parametrize(
    "path",
    [
        "/assets/..%2f..%2fsecret.txt",
        "/assets/../../secret.txt",
        "/..%2fsecret.txt",
        "/secret.txt",
        "/waydrop.db",
        "/assets/",
        "/api/v1/docs/..%2findex.html",
        "/assets/%2e%2e%2f%2e%2e%2fsecret.txt",
        "/assets/index-abc123.js%00.txt",
    ],
)
async def test_nothing_outside_the_folder_is_served(built: Service, path: str) -> None:
    async with built.http.get(URL(built.url + path, encoded=True)) as response:
        assert response.status == 404
        assert (await response.json(content_type=None))["code"] == "path.not_found"


async def test_without_a_built_page_there_is_help(service: Service) -> None:
    for path in ("/", "/api/v1/docs"):
        status, headers, text = await service.call("GET", path)
        assert status == 200
        assert headers["Content-Type"].startswith("text/html")
        assert "<code>make</code>" in text
        assert "/api/v1/openapi.json" in text


async def test_api_answers_carry_headers_that_allow_a_browser_nothing(service: Service) -> None:
    for path in ("/api/v1/vehicles", "/nothing", "/healthz"):
        _, headers, _ = await service.call("GET", path)
        assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cache-Control"] == "no-store"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert "Python" not in headers["Server"]
