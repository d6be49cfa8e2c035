"""From the messages of a topic to one demonstration."""

import warnings
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from probdmp.demonstrations import Demonstration
from probdmp.demonstrations.demonstration import LONGEST_RECORDING, SHORTEST_RECORDING
from probdmp.errors import DataFileError, RecordingWarning
from probdmp.io.mcap_about import About
from probdmp.io.recordings import demonstrations_of, listing
from probdmp.io.ros_messages import Sample
from probdmp.io.selection import Selection
from probdmp.io.timed_recordings import Table, recordings_of

__all__ = ["demonstration_of_messages"]


def demonstration_of_messages(
    messages: Iterable[tuple[int, Sample]], selection: Selection, place: str, name: str, about: About | None = None
) -> list[Demonstration]:
    """The one demonstration of a topic, as a list.

    Times are those of the headers of messages; of the log where no header tells one. Messages that lack columns that others
    have (a gripper's among those of an arm) are left out, as are repeated times, with a warning.

    Parameters
    ----------
    messages : when each was logged, nanoseconds, and what is in it.
    place : "on /joint_states in f.bag", for messages.
    about : what the file says of the demonstration besides.

    Raises
    ------
    DataFileError
        If there are too few or too many.
    """
    logged, samples = _bounded(messages, place)
    times = [sample.stamp for sample in samples] if any(sample.stamp for sample in samples) else logged
    chosen = _alike(samples, selection.columns, place)
    order = sorted(chosen, key=times.__getitem__)
    stamps = np.array([times[i] for i in order], dtype=np.int64)
    new = np.concatenate([[True], np.diff(stamps) > 0])
    if not new.all():
        _warn(f"{name}: {int((~new).sum())} messages {place} have the time of another one: left out.")
    kept = [samples[i] for i, is_new in zip(order, new.tolist(), strict=True) if is_new]
    if len(kept) < SHORTEST_RECORDING:
        raise DataFileError(f"at least {SHORTEST_RECORDING} messages {place}", str(len(kept)))
    first = kept[0]
    columns = {column: np.array([sample.columns[column] for sample in kept]) for column in first.columns}
    stamps = stamps[new]
    clock = (stamps - stamps[0]) / 1e9  # of whole numbers: clocks count from 1970, in nanoseconds
    label = "" if about is None else about.label
    table = Table(columns, clock if about is None else about.clock(clock), label, place, first.units)
    return demonstrations_of(recordings_of([table], first.positions, {}, selection.dt, name), selection, name)


def _bounded(messages: Iterable[tuple[int, Sample]], place: str) -> tuple[list[int], list[Sample]]:
    logged, samples = [], []
    for time, sample in messages:
        logged.append(time)
        samples.append(sample)
        if len(samples) > LONGEST_RECORDING:
            raise DataFileError(f"at most {LONGEST_RECORDING} messages {place}", "more", "Cut it into pieces.")
    if not samples or not any(sample.columns for sample in samples):
        raise DataFileError(f"messages with numbers {place}", "none")
    return logged, samples


def _alike(samples: Sequence[Sample], columns: Sequence[str] | None, place: str) -> list[int]:
    """Which messages have the same columns: those that were asked for, or else what most have."""
    counts = Counter(frozenset(sample.columns) for sample in samples if sample.columns)
    fitting = [key for key in counts if columns is not None and key >= set(columns)]
    key = max(fitting or counts, key=counts.__getitem__)
    chosen = [i for i, sample in enumerate(samples) if sample.columns.keys() == key]
    if len(chosen) < len(samples):
        text = f"{len(samples) - len(chosen)} of {len(samples)} messages {place} have other columns than"
        _warn(f"{text} {listing(sorted(map(repr, key)), 8)}: left out.")
    return chosen


def _warn(text: str) -> None:
    warnings.warn(text, RecordingWarning, stacklevel=3)
