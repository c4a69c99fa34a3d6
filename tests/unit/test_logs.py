"""Logs are one line for each event, JSON where no person reads them."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Iterator

import pytest
import structlog

from app.config import load_settings
from app.logs import ALIKE_FOR_S, MOST_ALIKE, ForeignThrottle, configure_logs


@pytest.fixture(autouse=True)
def _logging_as_before() -> Iterator[None]:
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)
    structlog.reset_defaults()


def test_without_a_terminal_each_line_is_json() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(), stream)
    structlog.get_logger("app.x").info("run started", run_id="r1")
    logging.getLogger("asyncio").warning("slow %s", "callback")
    first, second = (json.loads(line) for line in stream.getvalue().splitlines())
    assert (first["event"], first["run_id"], first["level"], first["logger"]) == ("run started", "r1", "info", "app.x")
    assert (second["event"], second["logger"]) == ("slow callback", "asyncio")
    assert first["timestamp"].endswith("Z")


def test_what_a_vehicle_says_makes_no_line_of_its_own() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(log_format="console"), stream)
    structlog.get_logger("app.x").warning("vehicle says", text="\x1b[2JAll is well\n12:00:00 [info] run completed")
    logging.getLogger("mavsdk").warning("%s", "one\ntwo\x1b[31m")
    assert "\x1b[2J" not in stream.getvalue()
    assert "\x1b[31m" not in stream.getvalue()
    assert len(stream.getvalue().splitlines()) == 2


def test_an_exception_stays_on_its_line() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(log_format="json"), stream)
    try:
        raise ValueError("broken")
    except ValueError:
        structlog.get_logger().exception("failed")
    (line,) = stream.getvalue().splitlines()
    assert "ValueError: broken" in json.loads(line)["exception"]


def test_people_read_words() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(log_format="console"), stream)
    structlog.get_logger().info("run started", run_id="r1")
    line = stream.getvalue()
    assert "run started" in line
    assert "run_id=r1" in line


def test_what_is_below_the_level_is_not_written() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(log_level="warning"), stream)
    structlog.get_logger().info("run started")
    assert stream.getvalue() == ""


def test_what_a_library_says_without_end_is_written_a_few_times_and_counted() -> None:
    stream = io.StringIO()
    configure_logs(load_settings(log_format="json"), stream)
    for number in range(1000):
        logging.getLogger("asyncio").error("out of files: %s", number)
    logging.getLogger("asyncio").error("another thing")
    for _ in range(100):
        structlog.get_logger("app.x").info("request")
    events = [json.loads(line)["event"] for line in stream.getvalue().splitlines()]
    assert sum(event.startswith("out of files") for event in events) == MOST_ALIKE
    assert "another thing" in events
    assert events.count("request") == 100, "each request has its line"


def test_what_was_left_out_is_told_when_it_is_said_again_later() -> None:
    now_s = 0.0
    throttle = ForeignThrottle(lambda: now_s)
    records = [logging.LogRecord("asyncio", logging.ERROR, "x.py", 1, "out of files", None, None) for _ in range(30)]
    assert sum(throttle.filter(record) for record in records) == MOST_ALIKE
    now_s = ALIKE_FOR_S
    again = logging.LogRecord("asyncio", logging.ERROR, "x.py", 1, "out of files", None, None)
    assert throttle.filter(again)
    assert again.getMessage() == f"out of files ({30 - MOST_ALIKE} similar messages omitted)"
