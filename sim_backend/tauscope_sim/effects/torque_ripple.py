"""Torque periodic in angle and proportional to the load: τ = L Σ a_i sin(k_i q' + φ_i), a_i without unit.

L is the torque that the transmission hands to the link: see `tauscope_sim.plant.loads`.
"""

from collections.abc import Callable
from typing import ClassVar

from tauscope.robot.robot import Robot
from tauscope_sim.effects.angle_harmonics import AngleHarmonics
from tauscope_sim.plant.coordinates import Coordinates
from tauscope_sim.plant.loads import LARGEST_GAIN
from tauscope_sim.plant.term import Forces, Moment, Slopes, Term


class TorqueRipple(AngleHarmonics):
    """τ = L Σ a_i sin(k_i q' + φ_i).

    joint : int
        its number, counted from 1
    amplitude : list of float
        a_i, a number or one an order [Nm/Nm]
    phase : list of float
        φ_i, a number or one an order [rad]
    """

    effect_id: ClassVar[str] = "torque_ripple"

    def check(self, robot: Robot) -> None:
        """Refuse a ripple larger than the load."""
        super().check(robot)
        repeats = len(self.order) if len(self.amplitude) == 1 else 1
        total = repeats * sum(abs(amplitude) for amplitude in self.amplitude)
        if total > LARGEST_GAIN:
            raise self.refused("amplitude", f"adds up to {total:g} of the load; make it at most {LARGEST_GAIN:g}")

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        """The gain of the load."""
        return (_Ripple(self.index, coordinates.motor(self.index), *self.sine_and_slope(robot)),)


class _Ripple(Term):
    """A gain of the load that depends on the motor's position."""

    depends_on_load = True

    def __init__(self, joint: int, place: int, sine: Callable[[float], float], slope: Callable[[float], float]) -> None:
        self._joint, self._place, self._sine, self._slope = joint, place, sine, slope

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add s(q) to the gain."""
        forces.load_gain[self._joint] += self._sine(moment.position[self._place])

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add L ds/dq."""
        place = self._place
        slopes.by_position[place, place] += moment.load[self._joint] * self._slope(moment.position[place])
