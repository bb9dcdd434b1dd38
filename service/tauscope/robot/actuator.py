"""The drive of a joint: a torque source, or a loop on position or velocity that a command reaches."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Values = float | NDArray[np.float64]

ActuatorKind = Literal["torque", "position", "velocity"]
GainUnit = Literal["register", "Nm_per_rad"]


@dataclass(frozen=True)
class Servo:
    """Registers of a servo family; `torque_per_volt` at stall [Nm/V], None where it has several motors."""

    duty_per_rad: float  # duty of the bridge per unit of the P register and rad of position error [1/rad]
    max_duty: float = 1.0  # largest duty that the firmware gives, 0 to 1
    dead_band: float = 0.0  # position error below which the bridge is off [rad]
    torque_per_volt: float | None = None


COUNT = 2.0 * np.pi / 4096  # one encoder count of all these servos but XL-320 [rad]

# Servos by name.
SERVOS = {
    "dynamixel-x": Servo(1.0 / COUNT / 128 / 885),  # e-manual: K_P = register / 128; 885 is full duty
    "dynamixel-xl330": Servo(1.0 / COUNT / 256 / 885, torque_per_volt=0.52 / 5.0),  # measured: 0.99 to 1.01 of it
    "dynamixel-mx": Servo(0.158, max_duty=0.9625),  # protocol 1, by oscilloscope (Duclusaud et al., ICRA 2025)
    "dynamixel-xl320": Servo(0.0505, torque_per_volt=0.39 / 7.4),  # likewise
    "feetech-sts3215": Servo(0.166, max_duty=0.97, dead_band=COUNT, torque_per_volt=1.91 / 7.4),  # likewise
}

ASSUMED_SERVO = "dynamixel-xl330"  # servo of register gains without a name
ROOM_C = 25.0  # temperature at which torque per volt is stated [°C]
# Relative standard error of torque per volt from a data sheet: stall torque includes friction and a warm winding.
DATA_SHEET_STD = 0.2


@dataclass(frozen=True)
class Actuator:
    """The drive of a joint; its command is the column ``qref``.

    Position: torque = κ clip(kp (qref - q), ±max_duty V) - kd q̇ - κ k_e q̇, in the units of `unit`.
    Velocity: kp acts on q̇ref - q̇.
    """

    kind: ActuatorKind
    kp: float = 0.0  # register value, or Nm/rad, N/m; of a velocity loop Nm s/rad, N s/m
    kd: float = 0.0  # torque per velocity [Nm s/rad, N s/m]; a register's D has no known unit and is viscous friction
    unit: GainUnit = "Nm_per_rad"
    servo: str | None = None  # register conversion, one of `SERVOS`
    supply_voltage: float | None = None  # of the bridge [V]; a column ``volt`` goes before it
    torque_per_volt: float | None = None  # stall torque per volt across the bridge, κ [Nm/V]
    max_duty: float | None = None  # largest share of the supply that the firmware gives, 0 to 1; None: the servo's own
    back_emf: float = 0.0  # k_e at the joint [V s/rad]
    dead_band: float | None = None  # position error below which the bridge is off [rad]; None: the servo's own
    delay: float | None = None  # from the recorded command to its torque [s]; None: estimated
    rate_hz: float | None = None  # rate at which the loop takes commands [Hz]; None: with every sample
    # relative loss of torque per volt with recorded T, κ / (1 + slope (T - 25 °C)) [1/K]
    temperature_slope: float = 0.0
    # relative error of torque per position error; None: that of a data sheet, or zero in SI
    scale_std: float | None = None

    @property
    def has_loop(self) -> bool:
        """Whether its torque follows from commands and motion."""
        return self.kind != "torque"

    @property
    def conversion(self) -> Servo:
        """Register conversion."""
        return SERVOS[self.servo or ASSUMED_SERVO]

    @property
    def volt_torque(self) -> float | None:
        """κ [Nm/V]: as stated, else as in the data sheet."""
        return self.conversion.torque_per_volt if self.torque_per_volt is None else self.torque_per_volt

    @property
    def duty_limit(self) -> float:
        """Largest duty: as stated, else as the servo's firmware has it, 0 to 1."""
        return self.conversion.max_duty if self.max_duty is None else self.max_duty

    @property
    def stall_torque(self) -> float | None:
        """Torque at full duty and rest [Nm or N]; None for a loop in SI, and where voltage or κ is not known."""
        if self.unit != "register" or self.supply_voltage is None or self.volt_torque is None:
            return None
        return self.duty_limit * self.supply_voltage * self.volt_torque

    @property
    def relative_std(self) -> float:
        """Relative standard error of the scale of its torque."""
        if self.scale_std is not None:
            return self.scale_std
        return DATA_SHEET_STD if self.unit == "register" and self.torque_per_volt is None else 0.0

    @property
    def stiffness(self) -> float | None:
        """Torque per position error [Nm/rad or N/m], or per velocity error; None where voltage or κ is not known."""
        if self.unit == "Nm_per_rad":
            return self.kp
        if self.supply_voltage is None or self.volt_torque is None:
            return None
        return self.kp * self.conversion.duty_per_rad * self.supply_voltage * self.volt_torque

    @property
    def damping(self) -> float:
        """Torque per velocity of a position loop and its back-EMF [Nm s/rad or N s/m]."""
        own = self.kd if self.unit == "Nm_per_rad" else 0.0
        return own + self.back_emf * (self.volt_torque or 0.0)

    def torque(
        self,
        error: Values,
        velocity: Values,
        voltage: Values | None = None,
        kp: Values | None = None,
        temperature: Values | None = None,
    ) -> Values:
        """Torque at the joint, (N,) as its arguments, by `error`, command less position, or less velocity `velocity`.

        `voltage` [V] and gain `kp` are as stated where None, the motor's `temperature` [°C] 25 where None or NaN.
        """
        dead = self.conversion.dead_band if self.dead_band is None and self.unit == "register" else self.dead_band
        gain = self.kp if kp is None else kp
        if dead:
            error = np.where(np.abs(error) > dead, error, 0.0)
        if self.unit == "Nm_per_rad":
            return gain * error - self.damping * velocity
        supply = self.supply_voltage if voltage is None else voltage
        duty = np.clip(gain * self.conversion.duty_per_rad * error, -self.duty_limit, self.duty_limit)
        warmth = 0.0 if temperature is None else np.nan_to_num(np.asarray(temperature) - ROOM_C)
        volt_torque = (self.volt_torque or 0.0) / (1.0 + self.temperature_slope * warmth)
        return volt_torque * (0.0 if supply is None else supply) * duty - self.damping * velocity
