"""Sensor channels that are not as they should be while the movement is: contact lost, too firm, or that of another movement.

What is made up is still measured by the same sensor: its noise is drawn anew at the recording's own level. What was missing
stays missing. Sizes are fractions of the range, the extent of this channel in this recording.
"""

from collections.abc import Sequence

import numpy as np

from probdmp.checks import FloatArray
from probdmp.demonstrations.extent import largest_extent
from probdmp.demonstrations.smoothing import noise_stds, sampled_between, without_noise

__all__ = ["lift", "press", "wrong_channel"]

CHANGE = 0.05
"""Fraction of the movement in which a channel goes to where the fault leads it."""


def lift(channels: FloatArray, onset: int, rng: np.random.Generator) -> FloatArray:
    """Contact lost: from `onset` on the channels go to where they were before anything happened, and stay there.

    Parameters
    ----------
    channels : (T, F) array, units of each channel.

    Returns
    -------
    (T, F) array.
    """
    seen = [column[~np.isnan(column)] for column in channels.T]
    rest = np.array([column[0] if len(column) else np.nan for column in seen])
    share = _ramp(len(channels), onset)[:, None]
    noise = rng.standard_normal(channels.shape) * noise_stds(channels)
    lifted = np.where(share > 0, (1 - share) * without_noise(channels) + share * rest + noise, channels)
    return np.where(np.isnan(channels), np.nan, lifted)


def press(channels: FloatArray, onset: int, rng: np.random.Generator, size: float) -> FloatArray:
    """Too firm: from `onset` on the channels are higher by `size` times their range.

    Parameters
    ----------
    channels : (T, F) array, units of each channel.

    Returns
    -------
    (T, F) array.
    """
    extents = np.array([largest_extent(column[:, None]) for column in channels.T])
    return np.asarray(channels + size * extents * _ramp(len(channels), onset)[:, None])


def wrong_channel(channels: FloatArray, onset: int, rng: np.random.Generator, others: Sequence[FloatArray]) -> FloatArray:
    """The channels of another movement, from the first sample on, brought to the length of this one.

    Parameters
    ----------
    onset : without meaning; it is another one from its first sample.
    others : channels of executions of other movements, (T', F) arrays at the same rate; one is drawn.

    Returns
    -------
    (T, F) array.
    """
    other = others[int(rng.integers(len(others)))]
    stretched = sampled_between(without_noise(other), np.linspace(0.0, len(other) - 1, len(channels)))
    made_up = stretched + rng.standard_normal(channels.shape) * noise_stds(channels)
    return np.where(np.isnan(channels), np.nan, made_up)


def _ramp(n_samples: int, onset: int) -> FloatArray:
    """0 before the onset, rising to 1 within `CHANGE` of the movement; (T,) array."""
    return np.clip((np.arange(n_samples) - onset + 1) / max(CHANGE * n_samples, 1.0), 0.0, 1.0)
