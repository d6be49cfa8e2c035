"""Several movements by label, and the files that keep them."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

from probdmp.demonstrations import Recordings
from probdmp.detection import FailureDetector
from probdmp.errors import InputError, InputTypeError, ModelFileError, UnknownLabelError
from probdmp.estimator.probabilistic_dmp import ProbabilisticDMP
from probdmp.estimator.saving import write_learned
from probdmp.io import ModelContents, read_model

__all__ = ["PrimitiveLibrary", "load", "load_detector"]


class PrimitiveLibrary(Mapping[str, ProbabilisticDMP]):
    """Learned movements by label.

    Parameters
    ----------
    primitives : learned ProbabilisticDMPs by label.
    """

    def __init__(self, primitives: Mapping[str, ProbabilisticDMP]) -> None:
        if not isinstance(primitives, Mapping):
            raise InputTypeError("primitives by label", f"{primitives!r:.100}")
        if not primitives:
            raise InputError("at least one primitive", "an empty mapping")
        for label, primitive in primitives.items():
            if not all(isinstance(given, kind) for given, kind in ((label, str), (primitive, ProbabilisticDMP))):
                raise InputTypeError("ProbabilisticDMPs by label", f"{label!r:.50}: {primitive!r:.50}")
        self._primitives = dict(primitives)

    @classmethod
    def fit(cls, demonstrations: Mapping[str, Recordings], dt: float | None = None, **parameters: Any) -> Self:
        """Learn one primitive per label.

        Parameters
        ----------
        demonstrations : by label, as for `ProbabilisticDMP.fit`.
        parameters : constructor arguments of ProbabilisticDMP.
        """
        if not isinstance(demonstrations, Mapping):
            raise InputTypeError("demonstrations by label", f"{type(demonstrations).__name__}", "Put them into a dict.")
        return cls({label: ProbabilisticDMP(**parameters).fit(items, dt) for label, items in demonstrations.items()})

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read all primitives of a model file."""
        contents = read_model(path)
        return cls({label: _restored(contents, label) for label in contents.primitives})

    def save(self, path: str | Path, detector: FailureDetector | None = None, command: str = "") -> None:
        """Write one model file, atomically, with the detector if given.

        Parameters
        ----------
        command : what to type to make it again, kept in the file.
        """
        write_learned(path, {label: (p.primitive_, p.get_params()) for label, p in self.items()}, detector, command)

    def __getitem__(self, label: str) -> ProbabilisticDMP:
        if label not in self._primitives:
            raise UnknownLabelError(f"a label of the library, one of {sorted(self)}", repr(label))
        return self._primitives[label]

    def __iter__(self) -> Iterator[str]:
        return iter(self._primitives)

    def __len__(self) -> int:
        return len(self._primitives)

    def __repr__(self) -> str:
        return f"<PrimitiveLibrary: {', '.join(map(repr, self))}>"


def load(path: str | Path, label: str | None = None) -> ProbabilisticDMP:
    """Read a primitive from a model file.

    Parameters
    ----------
    label : which one, if the file holds several; `PrimitiveLibrary.load` reads them all.

    Raises
    ------
    ModelFileError
        If the file is missing, damaged, or not a model file.
    """
    contents = read_model(path)
    labels = list(contents.primitives)
    chosen = labels[0] if label is None and len(labels) == 1 else label
    if chosen not in contents.primitives:
        raise UnknownLabelError(f"a label of the file, one of {sorted(labels)}", repr(label))
    return _restored(contents, str(chosen))


def load_detector(path: str | Path) -> FailureDetector | None:
    """Read the detector of a model file; None if it was saved without one."""
    contents = read_model(path)
    if contents.detector is None:
        return None
    try:
        return FailureDetector.from_state(contents.detector, contents.primitives)
    except (InputError, InputTypeError) as error:
        raise ModelFileError(f"{error.expected} in {path}", error.got, "Fit the detector and save the model again.") from error


def _restored(contents: ModelContents, label: str) -> ProbabilisticDMP:
    """The estimator as it was after fitting, but for its fit report."""
    primitive = contents.primitives[label]
    try:
        learned = asdict(primitive.configuration) | {"channels": primitive.channel_names}
        estimator = ProbabilisticDMP(**{**contents.settings[label], **learned})
    except (KeyError, TypeError) as error:
        hint = "Learn and save the model again."
        raise ModelFileError(f"settings of {label!r} that ProbabilisticDMP takes", str(error), hint) from error
    estimator.primitive_, estimator.fit_report_ = primitive, None
    return estimator
