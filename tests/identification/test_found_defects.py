"""Defects that these tests found, each as small as it could be made; a test moves to its own file once it passes."""

import pytest

from identification.simulated import (
    PAPER_NOISE,
    paper_robot,
    simulate,
    with_shapes,
)
from identification.test_friction_shapes import identified as identified_without_shapes
from identification.test_real_data import identified
from shared_data import needs_shared_data


@needs_shared_data
@pytest.mark.xfail(reason="21.5 %: joint 2's slope, clear on the training motion, does not carry over", strict=True)
def test_the_tx40_is_no_worse_held_out_than_the_readmes_own_fit() -> None:
    result = identified("staubli-tx40", 30.0)
    assert result.held_out is not None
    assert 100.0 * result.held_out.relative_error <= 21.1


@pytest.mark.xfail(reason="δ = 5.9 ± 0.6 beside K_v = 61 is right, and still called open", strict=True)
def test_a_slope_near_the_other_one_is_called_found() -> None:
    arm = simulate(with_shapes(paper_robot(), 60.0, 6.0), seed=3, period_s=20.0)
    result = identified_without_shapes(arm, 0.1 * PAPER_NOISE, 0)
    assert all(shape.k_v_identifiable and shape.delta_identifiable for shape in result.shapes)


@pytest.mark.xfail(reason="in one of three runs joint 2's δ is 6 for 3: a motion that hardly shows it", strict=True)
def test_a_gentle_stribeck_slope_is_found() -> None:
    arm = simulate(with_shapes(paper_robot(), 60.0, 3.0), seed=3, period_s=20.0)
    for run in range(3):
        result = identified_without_shapes(arm, 0.1 * PAPER_NOISE, run)
        assert [shape.delta for shape in result.shapes] == pytest.approx([3.0] * 3, rel=0.2)
