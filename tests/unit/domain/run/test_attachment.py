"""An attachment's name ends as its type does, so that no computer opens it as something else."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.run.attachment import ENDINGS, MAX_NAME_CHARS, SIGNATURES, with_ending


@pytest.mark.parametrize(
    ("name", "media_type", "ended"),
    [
        ("door.jpg", "image/jpeg", "door.jpg"),
        ("door.JPEG", "image/jpeg", "door.JPEG"),
        ("door.html", "image/jpeg", "door.html.jpg"),
        ("door.png", "application/pdf", "door.png.pdf"),
        ("door", "image/png", "door.png"),
        (".png", "image/png", ".png.png"),
        ("x" * MAX_NAME_CHARS, "image/png", "x" * (MAX_NAME_CHARS - 4) + ".png"),
    ],
)
def test_a_name_gets_the_ending_of_its_type(name: str, media_type: str, ended: str) -> None:
    assert with_ending(name, media_type) == ended


@given(name=st.text(min_size=1, max_size=MAX_NAME_CHARS), media_type=st.sampled_from(sorted(ENDINGS)))
def test_every_name_ends_as_its_type_and_is_not_too_long(name: str, media_type: str) -> None:
    ended = with_ending(name, media_type)
    assert ended.lower().endswith(ENDINGS[media_type])
    assert len(ended) <= MAX_NAME_CHARS
    assert with_ending(ended, media_type) == ended, "a second time changes nothing"


def test_every_type_that_can_be_attached_has_an_ending() -> None:
    assert set(ENDINGS) == set(SIGNATURES)
