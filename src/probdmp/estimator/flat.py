"""Demonstrations as the rows of a table: what scikit-learn's own estimators take, and its `check_estimator` tries.

A row is one demonstration, sample after sample: T D numbers, x0, y0, x1, y1, … with D = 2. All are of the same length, and
NaN marks what was not measured.

These are classes of their own because such a table looks like one recording (T, D): were `ProbabilisticDMP` to take both, a
mistaken shape would be learned from in silence. They keep scikit-learn's promises where those of the library differ: `fit`
takes a `y` that nobody looks at, in the place of `dt`, and errors are scikit-learn's. Lists of `Demonstration` need none of
this: `ProbabilisticDMP` itself goes into a `Pipeline` and a `GridSearchCV`.
"""

from importlib.util import find_spec
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probdmp.checks import FloatArray, check_count, check_seconds
from probdmp.demonstrations.demonstration import SHORTEST_RECORDING
from probdmp.detection import FailureDetector
from probdmp.errors import InputError, InputTypeError, MissingExtraError
from probdmp.estimator.probabilistic_dmp import ProbabilisticDMP
from probdmp.parameters import HasParameters

__all__ = ["FlatDMP", "FlatFailureDetector", "require_sklearn"]


def require_sklearn() -> None:
    """Refuse, with the command to type, where scikit-learn is not installed."""
    if find_spec("sklearn") is None:
        raise MissingExtraError("scikit-learn for tables of rows", "none installed", "Type: pip install 'probdmp[sklearn]'")


class _Flat(HasParameters):
    """What both have: a row is unfolded into a (T, D) recording."""

    _takes_tables = True

    dmp: ProbabilisticDMP
    n_dof: int
    dt: float
    n_features_in_: int

    def _fitted_dmp(self, rows: FloatArray) -> ProbabilisticDMP:
        from sklearn.base import clone

        if not isinstance(self.dmp, ProbabilisticDMP):
            raise InputTypeError("dmp as a ProbabilisticDMP", f"{self.dmp!r:.100}")
        learned: ProbabilisticDMP = clone(self.dmp)
        return learned.fit(self._unfolded(rows), self.dt)

    def _known_rows(self, X: ArrayLike) -> FloatArray:
        require_sklearn()
        from sklearn.utils.validation import check_is_fitted

        check_is_fitted(self)
        return self._rows(X, reset=False)

    def _rows(self, X: ArrayLike, *, reset: bool, fewest: int = 1) -> FloatArray:
        """A checked (K, T D) array of at least so many rows; scikit-learn's errors."""
        require_sklearn()
        from sklearn.utils.validation import validate_data

        least = SHORTEST_RECORDING * check_count(self.n_dof, "n_dof") if reset else 1
        options = {"ensure_all_finite": "allow-nan", "ensure_min_features": least, "ensure_min_samples": fewest}
        rows: FloatArray = validate_data(self, X, reset=reset, dtype=np.float64, **options)
        check_seconds(self.dt, "dt")
        if rows.shape[1] % self.n_dof:
            hint = "A row is x0, y0, x1, y1, …: as many numbers as samples times degrees of freedom."
            raise InputError(f"rows of a multiple of n_dof = {self.n_dof} numbers", f"{rows.shape[1]}", hint)
        return rows

    def _unfolded(self, rows: FloatArray) -> FloatArray:
        """(K, T, D)."""
        return rows.reshape(len(rows), -1, self.n_dof)


class FlatDMP(_Flat):
    """A density over rows, each a demonstration of the same length: `ProbabilisticDMP` as scikit-learn's `KernelDensity`.

    Parameters
    ----------
    dmp : ProbabilisticDMP, copied before it learns. Its own parameters are `dmp__n_basis` and so on.
    n_dof : D, degrees of freedom; a row has T D numbers, sample after sample.
    dt : seconds between samples.

    Attributes
    ----------
    dmp_ : the learned ProbabilisticDMP.
    n_features_in_ : T D.
    """

    _kind_of_estimator = "density_estimator"

    def __init__(self, dmp: ProbabilisticDMP, *, n_dof: int, dt: float) -> None:
        self.dmp = dmp
        self.n_dof = n_dof
        self.dt = dt

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn from rows.

        Parameters
        ----------
        X : (K, T D) array, data units; NaN where nothing was measured.
        y : not looked at.
        """
        self.dmp_ = self._fitted_dmp(self._rows(X, reset=True))
        return self

    def score_samples(self, X: ArrayLike) -> FloatArray:
        """Log-likelihood of each row, (K,) array, nats."""
        rows = self._known_rows(X)
        return self.dmp_.score_samples(self._unfolded(rows), self.dt)

    def score(self, X: ArrayLike, y: object = None) -> float:
        """Mean log-likelihood of a row, nats."""
        return float(np.mean(self.score_samples(X)))

    def sample(self, n_samples: int = 1, random_state: int | np.random.Generator | None = None) -> FloatArray:
        """Rows drawn from the model, (n_samples, T D) array."""
        from sklearn.utils.validation import check_is_fitted

        check_is_fitted(self)
        duration = (self.n_features_in_ // self.n_dof - 1) * self.dt
        drawn = self.dmp_.sample(n_samples, duration=duration, dt=self.dt, random_state=random_state)
        return np.stack(drawn).reshape(n_samples, -1)


class FlatFailureDetector(_Flat):
    """An outlier detector over rows, each an execution of the same length: learns the movement, then what is normal for it.

    Parameters
    ----------
    detector : FailureDetector, copied before it is fitted. Its own parameters are `detector__false_alarm_rate` and so on. It is
        calibrated with the rows that teach the movement, so `calibration="held_out"` is none for it.
    dmp : ProbabilisticDMP, copied before it learns.
    n_dof : D, degrees of freedom; a row has T D numbers, sample after sample.
    dt : seconds between samples.

    Attributes
    ----------
    dmp_, detector_ : both as fitted.
    offset_ : -1, what `score_samples` has to fall below.
    n_features_in_ : T D.
    """

    _kind_of_estimator = "outlier_detector"
    offset_ = FailureDetector.offset_

    def __init__(self, detector: FailureDetector, dmp: ProbabilisticDMP, *, n_dof: int, dt: float) -> None:
        self.detector = detector
        self.dmp = dmp
        self.n_dof = n_dof
        self.dt = dt

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn the movement and what is normal for it from rows, (K, T D) array; y is not looked at."""
        rows = self._rows(X, reset=True, fewest=2)  # one is left out
        from sklearn.base import clone

        if not isinstance(self.detector, FailureDetector):
            raise InputTypeError("detector as a FailureDetector", f"{self.detector!r:.100}")
        dmp = self._fitted_dmp(rows)
        self.detector_ = clone(self.detector).fit(dmp, self._unfolded(rows), self.dt)
        self.dmp_ = dmp
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.int64]:
        """(K,) array: +1 for a fine row, -1 for a failed one."""
        rows = self._known_rows(X)
        return self.detector_.predict(self._unfolded(rows), self.dt)

    def fit_predict(self, X: ArrayLike, y: object = None) -> NDArray[np.int64]:
        """`fit`, then `predict` of the same rows."""
        return self.fit(X).predict(X)

    def score_samples(self, X: ArrayLike) -> FloatArray:
        """(K,) array: minus the test ratio, so that higher is more normal."""
        rows = self._known_rows(X)
        return self.detector_.score_samples(self._unfolded(rows), self.dt)

    def decision_function(self, X: ArrayLike) -> FloatArray:
        """(K,) array: `score_samples` less `offset_`, negative for a failed row."""
        return self.score_samples(X) - self.offset_
