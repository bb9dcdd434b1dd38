"""The rigs of the conformance suite."""

from collections.abc import Callable, Iterator

import pytest

from arm_rigs import RIGS, Rig
from drivers import StopPolicy


@pytest.fixture(scope="session", params=list(RIGS))
def make_rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Rig]]:
    with RIGS[request.param](tmp_path_factory.mktemp("rig")) as maker:
        yield maker


@pytest.fixture
def rig(make_rig: Callable[[], Rig]) -> Iterator[Rig]:
    one = make_rig()
    yield one
    one.backend.stop(StopPolicy.TORQUE_OFF)
    one.backend.disconnect()
