"""What vehicles and users put into texts does not steer the terminal of who reads them."""

from __future__ import annotations

import json

import pytest
from rich.table import Table
from rich.text import Text

from app.cli.terminal import err, out, write_json

CLEARS = "\x1b[2J\x1b[Hvehicle \u202esays\u202c"


def test_texts_and_tables_are_shown_without_escapes(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table("text")
    table.add_row(CLEARS)
    out().print(CLEARS)
    out().print(Text(CLEARS, style="bold"), table)
    err().print(CLEARS)
    written = capsys.readouterr()
    assert written.out.count("vehicle says") == 3
    assert written.err == "vehicle says\n"
    assert not {"\x1b", "\u202e"} & set(written.out)


def test_json_is_the_same_document_with_escapes_written_out(capsys: pytest.CaptureFixture[str]) -> None:
    write_json({"text": f"{CLEARS}\x9b"})
    written = capsys.readouterr().out
    assert not {"\x1b", "\u202e", "\x9b"} & set(written)
    assert json.loads(written) == {"text": f"{CLEARS}\x9b"}
