"""docs/reference/interchange.md says every code that a conversion may answer, and no other."""

from __future__ import annotations

import re

from tests.support.paths import ROOT

CODE = re.compile(r'"(conversion\.[a-z_]+)"')


def test_every_code_is_described_and_no_other() -> None:
    sources = (path.read_text(encoding="utf-8") for path in (ROOT / "app" / "interchange").glob("*.py"))
    codes = {code for text in sources for code in CODE.findall(text)} - {"conversion.refused"}
    page = (ROOT / "docs" / "reference" / "interchange.md").read_text(encoding="utf-8")
    table = page.partition("## Codes")[2]
    assert set(re.findall(r"`(conversion\.[a-z_]+)`", table)) == codes
