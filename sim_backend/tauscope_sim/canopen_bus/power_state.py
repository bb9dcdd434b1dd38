"""Power state machine of an emulated drive (CiA 402, transitions by number), fed by the controlword and by events."""

from enum import Enum


class PowerState(Enum):
    """State, with the statusword's bits that show it."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


_SWITCH_ON, _VOLTAGE, _NO_QUICK_STOP, _ENABLE, _RESET = 0x01, 0x02, 0x04, 0x08, 0x80


class PowerStateMachine:
    """Where the drive stands; the drive looks at `state` to know whether it may drive."""

    def __init__(self) -> None:
        """Power-up: transitions 0 and 1 happen by themselves."""
        self.state = PowerState.SWITCH_ON_DISABLED
        self.quick_stop_stays = True
        self._last_word = 0

    def command(self, word: int) -> None:
        """Follow a controlword by one transition."""
        rising_reset = bool(word & _RESET and not self._last_word & _RESET)
        self._last_word = word
        if self.state is PowerState.FAULT:
            if rising_reset:
                self.state = PowerState.SWITCH_ON_DISABLED  # 15
            return
        if not word & _VOLTAGE:
            self.state = PowerState.SWITCH_ON_DISABLED  # 7, 9, 10, 12
        elif not word & _NO_QUICK_STOP:
            self.quick_stop()
        else:
            self.state = self._step(bool(word & _SWITCH_ON), bool(word & _ENABLE))

    def quick_stop(self) -> None:
        """Stop quickly: transition 11 from operation, 7 and 10 from below it."""
        if self.state is PowerState.OPERATION_ENABLED:
            self.state = PowerState.QUICK_STOP_ACTIVE
        elif self.state is not PowerState.QUICK_STOP_ACTIVE:
            self.state = PowerState.SWITCH_ON_DISABLED

    def end_quick_stop(self) -> None:
        """The arm stands: transition 12 where the option code does not say to stay."""
        if self.state is PowerState.QUICK_STOP_ACTIVE and not self.quick_stop_stays:
            self.state = PowerState.SWITCH_ON_DISABLED

    def fail(self) -> None:
        """A fault: transitions 13 and 14 in one."""
        self.state = PowerState.FAULT

    def disable(self) -> None:
        """Voltage off from any state but fault."""
        if self.state is not PowerState.FAULT:
            self.state = PowerState.SWITCH_ON_DISABLED

    def _step(self, switch_on: bool, enable: bool) -> PowerState:
        match self.state, switch_on, enable:
            case PowerState.SWITCH_ON_DISABLED, False, _:
                return PowerState.READY  # 2
            case PowerState.READY, True, _:
                return PowerState.SWITCHED_ON  # 3
            case PowerState.SWITCHED_ON, True, True:
                return PowerState.OPERATION_ENABLED  # 4
            case PowerState.OPERATION_ENABLED, True, False:
                return PowerState.SWITCHED_ON  # 5
            case ((PowerState.SWITCHED_ON | PowerState.OPERATION_ENABLED), False, _):
                return PowerState.READY  # 6, 8
            case PowerState.QUICK_STOP_ACTIVE, True, True:
                return PowerState.OPERATION_ENABLED if self.quick_stop_stays else self.state  # 16
        return self.state
