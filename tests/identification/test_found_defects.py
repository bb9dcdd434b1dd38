"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

import pytest

from identification.test_real_data import identified
from shared_data import needs_shared_data


@needs_shared_data
@pytest.mark.xfail(reason="21.5 %: joint 2's slope, clear on the training motion, does not carry over", strict=True)
def test_the_tx40_is_no_worse_held_out_than_the_readmes_own_fit() -> None:
    result = identified("staubli-tx40", 30.0)
    assert result.held_out is not None
    assert 100.0 * result.held_out.relative_error <= 21.1
