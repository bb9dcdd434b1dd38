"""What a black box could still predict of held-out motion, beside what the models of a diagnosis leave there."""

from tauscope.headroom.entries import measure_headroom, require_black_box

__all__ = ["measure_headroom", "require_black_box"]
