"""One cluster for this folder: starting it takes longer than most of what is asked of it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.cluster_process import Cluster, running_cluster


@pytest.fixture(scope="package")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Two gateways with a quad each, two API nodes."""
    with running_cluster(tmp_path_factory.mktemp("cluster")) as running:
        yield running
