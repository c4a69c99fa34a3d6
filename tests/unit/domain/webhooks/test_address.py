"""Where a webhook may lead."""

from __future__ import annotations

import pytest

from app.domain.errors import InvalidInputError
from app.domain.webhooks.webhook import checked_url, host_of, is_loopback


@pytest.mark.parametrize(
    "url",
    [
        "https://dispatch.example/waydrop?key=1",
        "https://10.0.0.7:8443/",
        "http://127.0.0.1:16600/hook",
        "http://localhost/",
        "http://[::1]:16600/",
    ],
)
def test_https_anywhere_and_http_to_this_machine_are_taken(url: str) -> None:
    assert checked_url(url, http_anywhere=False) == url


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://dispatch.example/", "plain http to dispatch.example"),
        ("http://169.254.169.254/latest/meta-data", "plain http"),
        ("http://127.0.0.1.example.com/", "plain http"),
        ("http://localhost.example/", "plain http"),
        ("http://[::ffff:10.0.0.1]/", "plain http"),
        ("https://user:secret@dispatch.example/", "user name"),
        ("https://dispatch.example/#part", "fragment"),
        ("ftp://dispatch.example/", "no http or https address"),
        ("file:///etc/passwd", "no http or https address"),
        ("dispatch.example", "URL"),
        ("https://", "URL"),
        ("https://" + "a" * 3000 + ".example/", "url"),
        ("", "URL"),
    ],
)
def test_all_else_is_refused_in_words(url: str, said: str) -> None:
    with pytest.raises(InvalidInputError, match=r"url") as refused:
        checked_url(url, http_anywhere=False)
    assert said.lower() in refused.value.detail.lower()


def test_plain_http_to_others_is_a_choice_of_whoever_runs_it() -> None:
    assert checked_url("http://receiver:8080/x", http_anywhere=True) == "http://receiver:8080/x"


def test_what_the_journal_is_told_of_a_url_is_its_host_alone() -> None:
    assert host_of("https://dispatch.example/services/T0/secret") == "dispatch.example"


def test_other_ways_to_write_this_machine_are_this_machine() -> None:
    assert checked_url("http://0x7f000001/", http_anywhere=False) == "http://127.0.0.1/"
    assert is_loopback("127.9.9.9")
    assert not is_loopback("0.0.0.0")
