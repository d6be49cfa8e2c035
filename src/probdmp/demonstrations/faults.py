"""What can go wrong with an execution, by name, and what a failure detector is expected to say of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from probdmp.checks import FloatArray, check_choice
from probdmp.demonstrations.channel_faults import lift, press, wrong_channel
from probdmp.demonstrations.movement_faults import drift, hold, hold_release, push, slow, wrong_class, wrong_goal
from probdmp.demonstrations.sensor_faults import dropout, jitter, spikes, stuck_sensor
from probdmp.errors import InputError, TooFewDemonstrationsError

__all__ = ["BENIGN", "CHANNEL_FAULTS", "FAILURE", "FAULTS", "SENSOR", "Fault", "fault_named"]

FAILURE = "failure"
"""To be called failed."""
BENIGN = "benign"
"""The movement is fine: an alarm about motion or timing is a false alarm."""
SENSOR = "sensor"
"""The sensor is broken and the movement is not: to be called just that."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A seeded pure function of an execution, with its name and nature."""

    name: str
    """As `--fault` has it: with the size where one was asked for, such as `"push:0.4"`."""
    inject: Callable[..., FloatArray]
    """(positions, onset, rng), then the size or the other executions where it takes them."""
    nature: str = FAILURE
    """`FAILURE`, `BENIGN` or `SENSOR`."""
    size: float | None = None
    """Fraction of the range; None for faults without a size."""
    takes_others: bool = False
    """Whether it needs executions of other movements. Such a fault is there from the first sample on."""
    of_channels: bool = False
    """Whether it is the sensor channels that it changes, and not the positions."""
    takes_channels_along: bool = False
    """Whether it does to the sensor channels what it does to the positions; otherwise they stay as they are."""

    @property
    def kind(self) -> str:
        """The name without a size: faults of one kind that differ in size draw the same numbers."""
        return self.name.partition(":")[0]

    def __call__(
        self, positions: FloatArray, onset: int, rng: np.random.Generator, others: Sequence[FloatArray] = ()
    ) -> FloatArray:
        """What would have been recorded.

        Parameters
        ----------
        positions : (T, D) array, data units; NaN where a sample is missing. Of a fault of channels, these: (T, F).
        onset : first sample with the fault, 1 to T - 1.
        others : executions of other movements, (T', D) arrays at the same rate.

        Returns
        -------
        (T', D) array, data units, new; before the onset as recorded. T' > T where the fault takes time.

        Raises
        ------
        TooFewDemonstrationsError
            If the fault needs executions of other movements and there are none.
        """
        if self.takes_others:
            if not others:
                raise TooFewDemonstrationsError(
                    f"executions of another class with the same rate and degrees of freedom for the fault {self.name!r}",
                    "one class alone",
                    f"Leave {self.name} out, or add demonstrations of another class.",
                )
            return self.inject(positions, onset, rng, others)
        return self.inject(positions, onset, rng) if self.size is None else self.inject(positions, onset, rng, self.size)


FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("hold", hold, takes_channels_along=True),
        Fault("hold_release", hold_release, takes_channels_along=True),
        Fault("slow", slow, takes_channels_along=True),
        Fault("push", push, size=0.25),
        Fault("drift", drift, size=0.3),
        Fault("wrong_goal", wrong_goal, size=0.3),
        Fault("wrong_class", wrong_class, takes_others=True, takes_channels_along=True),
        Fault("dropout", dropout, BENIGN),
        Fault("jitter", jitter, BENIGN, takes_channels_along=True),
        Fault("stuck_sensor", stuck_sensor, SENSOR),
        Fault("spikes", spikes, SENSOR),
    )
}
"""By name."""
CHANNEL_FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        Fault("lift", lift, of_channels=True),
        Fault("press", press, size=0.4, of_channels=True),
        Fault("wrong_channel", wrong_channel, takes_others=True, of_channels=True),
    )
}
"""By name: of executions with sensor channels."""


def fault_named(name: str) -> Fault:
    """A fault by its name, with another size than the usual one after a colon: `"push:0.4"` displaces by 40 % of the range.

    Raises
    ------
    InputError, InputTypeError
        If there is no such fault, it has no size, or the size is no number above 0.
    """
    kind, colon, text = str(name).partition(":")
    known = FAULTS | CHANNEL_FAULTS
    fault = known[check_choice(kind, "fault", known)]
    if not colon:
        return fault
    if fault.size is None:
        sized = ", ".join(other.name for other in known.values() if other.size is not None)
        raise InputError(f"fault {kind!r} without a size", repr(name), f"Only {sized} have one.")
    try:
        size = float(text)
    except ValueError:
        size = np.nan
    if not 0 < size < np.inf:
        raise InputError(f"the size of a fault as a fraction of the range above 0, such as {kind}:{fault.size}", repr(name))
    return replace(fault, name=name, size=size)
