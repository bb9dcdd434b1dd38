"""Tauscope: a robot arm's true dynamics from its own motion, and what its simulation left out.

>>> import tauscope
>>> robot = tauscope.load_robot("arm.yaml")
>>> result = tauscope.identify(robot, ["train.csv"], held_out=["held_out.csv"])
>>> result.to_dict(), result.to_frame(), result.plot()

A function is loaded when it is first used.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tauscope.library import (
        design_excitation,
        diagnose,
        identify,
        load_robot,
        read_recording,
        rollout,
        simulate,
    )

__all__ = ["design_excitation", "diagnose", "identify", "load_robot", "read_recording", "rollout", "simulate"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from tauscope import library

        return getattr(library, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
