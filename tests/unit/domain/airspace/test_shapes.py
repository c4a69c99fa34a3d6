"""shapely is loaded with the first shape."""

from __future__ import annotations

import subprocess
import sys

import pytest

from app.domain.airspace import shapes
from tests.support.paths import ROOT

LOOK = "import sys, app.application; sys.exit(bool({'numpy', 'shapely'} & set(sys.modules)))"


def test_the_service_starts_without_shapely() -> None:
    assert subprocess.run([sys.executable, "-c", LOOK], cwd=ROOT, timeout=300).returncode == 0


@pytest.mark.parametrize("name", shapes.__all__)
def test_each_name_is_one_of_shapely(name: str) -> None:
    assert getattr(shapes, name).__module__.startswith("shapely")


def test_another_name_is_an_error() -> None:
    with pytest.raises(AttributeError, match="cirle"):
        shapes.cirle  # noqa: B018 - the lookup is what is tested
