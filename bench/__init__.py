"""Benchmarks: each prints ratios against a floor measured in the same run."""

import logging

import structlog

# A bench prints its table; of the service in its process only what is wrong.
structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.WARNING))
