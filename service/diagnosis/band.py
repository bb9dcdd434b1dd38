"""The band in which a diagnosis compares torque and model: the identification's, unless it explains next to nothing.

An identification keeps to where its model explains more than it leaves. Where what is left out is most of the torque,
that band says nothing, and the diagnosis looks beyond it, as far as the noise of the positions allows.
"""

from collections.abc import Sequence

import numpy as np

from service.identification import Identification
from service.recording.conditioning import Conditioner

WIDENING = 4.0
"""Width over the identification's band where its model explains too little."""

LITTLE = 0.5
"""Share of the torque's variance that a model explains at least for its band to mean anything."""

NOISE_MARGIN = 0.8
"""Share of the band at which the positions' noise would show in the accelerations."""

WIDEST_HZ = 40.0
"""Beyond, arms do not move, and rows cost time."""

OPEN_SHARE = 0.3
"""Share of the sampling rate that is never exceeded."""


def diagnosis_cutoff(conditioners: Sequence[Conditioner], identification: Identification) -> float:
    """Cut-off of the band that torque and columns share [Hz].

    Parameters
    ----------
    conditioners : sequence of Conditioner
        the training recordings
    identification : Identification
        of the nominal model
    """
    rate = min(conditioner.timing.rate_hz for conditioner in conditioners)
    widest = min(WIDEST_HZ, OPEN_SHARE * rate)
    limits = [c.noise.limit_hz for c in conditioners if c.noise.limit_hz is not None]
    quiet = min([widest, *(NOISE_MARGIN * limit for limit in limits)])
    identified = identification.cutoff_hz
    if identified is None:
        return quiet
    if explained_share(conditioners, identification) < LITTLE:
        return max(min(quiet, WIDENING * identified), min(identified, widest))
    return min(identified, widest)


def explained_share(conditioners: Sequence[Conditioner], identification: Identification) -> float:
    """Part of the torque's variance, over all joints, that a model explains.

    Parameters
    ----------
    conditioners : sequence of Conditioner
        the training recordings
    identification : Identification
        of the model
    """
    values = [c.recording.joint_torque(s.effort, c.robot) for c in conditioners for s in c.usable_samples()]
    torque = np.concatenate(values)
    variance = float(np.nansum(np.nanvar(torque, axis=0)))
    left = float(np.sum(identification.residuals.fit.rms**2))
    return 1.0 - left / variance if variance > 0.0 else 0.0
