"""Benchmarks: each prints ratios against a floor measured in the same run."""

import logging
import sys

import structlog

# A bench prints its table; of the service in its process only what is wrong, and not amid the table.
structlog.configure(
    wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING),
    logger_factory=structlog.PrintLoggerFactory(sys.stderr),
)
