"""The manners of scikit-learn: its own checks on rows, its searches and pipelines on lists of demonstrations."""

import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from probdmp import FailureDetector, ProbabilisticDMP, synthetic_letters
from probdmp.demonstrations import hold
from probdmp.errors import InputError, InputTypeError, MissingExtraError
from probdmp.estimator import FlatDMP, FlatFailureDetector

pytest.importorskip("sklearn", reason="needs scikit-learn: pip install 'probdmp[sklearn]'")

from sklearn.base import clone, is_outlier_detector
from sklearn.exceptions import NotFittedError, SkipTestWarning
from sklearn.model_selection import GridSearchCV, KFold, cross_val_score
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils import estimator_checks
from sklearn.utils.estimator_checks import check_estimator

TWO_COLUMNS = "its table has two columns, and a movement needs three samples"
GAPS = "it leaves a demonstration without its first or last sample, which `fit` refuses: it would not know where it ends"
EXPECTED_FAILURES = {
    "check_estimators_overwrite_params": TWO_COLUMNS,
    "check_estimators_fit_returns_self": TWO_COLUMNS,
    "check_readonly_memmap_input": TWO_COLUMNS,
    "check_fit_idempotent": TWO_COLUMNS,
    "check_fit_check_is_fitted": TWO_COLUMNS,
    "check_n_features_in": TWO_COLUMNS,
    "check_estimators_pickle": GAPS,
}
EXPECTED_FAILURES_OF_DETECTORS = EXPECTED_FAILURES | {
    "check_outliers_fit_predict": TWO_COLUMNS,
    "check_outliers_train": TWO_COLUMNS,
    "check_classifier_data_not_an_array": TWO_COLUMNS,
}
"""Every one of scikit-learn's checks that does not pass, and why; docs/how-to/conventions.md has the same table."""

PAPERS = ProbabilisticDMP(3, weight_model="pooled", weight_uncertainty="independent")


@pytest.fixture(scope="module")
def letters():
    return synthetic_letters(9, letters="s", dt=0.03)


@pytest.fixture(scope="module")
def rows():
    """Eight demonstrations with two degrees of freedom as a table."""
    random = np.random.default_rng(3)
    phases = np.linspace(0, 1, 25)[:, None]
    ends = np.array([1.0, -0.5]) + 0.1 * random.standard_normal((8, 1, 2))
    table = ends * (10 * phases**3 - 15 * phases**4 + 6 * phases**5) + 1e-3 * random.standard_normal((8, 25, 2))
    return table.reshape(8, 50)


def flat_dmp():
    return FlatDMP(ProbabilisticDMP(5), n_dof=2, dt=0.04)


def flat_detector(detector=None):
    return FlatFailureDetector(detector or FailureDetector(), ProbabilisticDMP(5), n_dof=2, dt=0.04)


# --- check_estimator ------------------------------------------------------------------------------------------------


def assert_checked(estimator, expected):
    """All checks pass but those that are expected to fail, and those do."""
    results = check_estimator(estimator, expected_failed_checks=expected, on_fail=None, on_skip=None)
    assert {r["check_name"]: r["exception"] for r in results if r["status"] == "failed"} == {}
    assert {r["check_name"] for r in results if r["status"] == "xfail"} == set(expected)
    assert {r["check_name"] for r in results if r["status"] == "skipped"} <= {"check_array_api_input"}
    assert len([r for r in results if r["status"] == "passed"]) >= 30


@pytest.mark.filterwarnings("ignore:Estimator Flat.* does not inherit from `sklearn.base.BaseEstimator`")
@pytest.mark.parametrize(
    ("estimator", "expected"),
    [
        pytest.param(FlatDMP(ProbabilisticDMP(5), n_dof=1, dt=0.01), EXPECTED_FAILURES, id="movement"),
        pytest.param(
            FlatFailureDetector(FailureDetector(rule="paper"), PAPERS, n_dof=1, dt=0.01),
            EXPECTED_FAILURES_OF_DETECTORS,
            id="paper's detector",
        ),
        pytest.param(
            FlatFailureDetector(FailureDetector(), ProbabilisticDMP(3), n_dof=1, dt=0.01),
            EXPECTED_FAILURES_OF_DETECTORS,
            id="calibrated detector",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_scikit_learns_checks_pass_on_rows(estimator, expected):
    assert_checked(estimator, expected)


@pytest.mark.parametrize("estimator", [ProbabilisticDMP(5), FailureDetector()], ids=repr)
def test_scikit_learn_is_told_that_a_table_is_not_for_estimators_of_lists(estimator):
    with pytest.warns(SkipTestWarning, match="two_d_array=False, three_d_array=True"):
        check_estimator(estimator)


NO_DATA = (
    *("check_estimator_cloneable", "check_estimator_tags_renamed", "check_valid_tag_types", "check_estimator_repr"),
    *("check_no_attributes_set_in_init", "check_do_not_raise_errors_in_init_or_set_params", "check_mixin_order"),
    *("check_parameters_default_constructible", "check_get_params_invariance", "check_set_params"),
)
"""Those of its checks that need no table."""


@pytest.mark.filterwarnings("ignore:Estimator .* does not inherit from `sklearn.base.BaseEstimator`")
@pytest.mark.parametrize("check", NO_DATA)
@pytest.mark.parametrize("estimator", [ProbabilisticDMP(5), FailureDetector()], ids=lambda e: type(e).__name__)
def test_estimators_of_lists_pass_every_check_that_needs_no_table(estimator, check):
    getattr(estimator_checks, check)(type(estimator).__name__, estimator)


def test_the_table_in_the_documentation_is_the_one_tested():
    page = (Path(__file__).parents[2] / "docs/how-to/conventions.md").read_text()
    listed = dict(re.findall(r"^\| `(check_\w+)` \| [^|]+ \| ([^|]+) \|$", page, flags=re.M))
    assert listed == EXPECTED_FAILURES_OF_DETECTORS


# --- what the checks with two columns would have tried ----------------------------------------------------------------


def test_fit_returns_self_changes_no_parameter_and_is_repeatable(rows):
    for estimator in (flat_dmp(), flat_detector()):
        before = repr(estimator)
        read_only = rows.copy()
        read_only.setflags(write=False)
        assert estimator.fit(read_only) is estimator
        assert repr(estimator) == before
        first = estimator.score_samples(rows)
        np.testing.assert_array_equal(estimator.fit(rows).score_samples(rows), first)
        assert estimator.n_features_in_ == 50
        with pytest.raises(ValueError, match=r"X has 48 features, but .* is expecting 50 features as input"):
            estimator.score_samples(rows[:, :48])


def test_rows_may_be_lists_and_a_detector_agrees_with_itself(rows):
    flat = flat_dmp().fit(rows)
    np.testing.assert_array_equal(flat_dmp().fit(rows.tolist()).score_samples(rows.tolist()), flat.score_samples(rows))
    detector, fresh = flat_detector(), flat_detector()
    np.testing.assert_array_equal(detector.fit_predict(rows), fresh.fit(rows).predict(rows))
    decision = detector.decision_function(rows)
    assert decision.shape == (8,)
    np.testing.assert_array_equal(decision, detector.score_samples(rows) - detector.offset_)
    np.testing.assert_array_equal(decision >= 0, detector.predict(rows) == 1)


def test_rows_need_a_fit_first(rows):
    for estimator in (flat_dmp(), flat_detector()):
        with pytest.raises(NotFittedError):
            estimator.score_samples(rows)


def test_flat_estimators_are_pickled_and_cloned(rows):
    for estimator in (flat_dmp().fit(rows), flat_detector().fit(rows)):
        copy = pickle.loads(pickle.dumps(estimator))
        np.testing.assert_array_equal(copy.score_samples(rows), estimator.score_samples(rows))
        assert not hasattr(clone(estimator), "dmp_")


# --- the view ---------------------------------------------------------------------------------------------------------


def test_a_row_is_a_demonstration_time_first(rows):
    listed = ProbabilisticDMP(5).fit(rows.reshape(8, 25, 2), dt=0.04)
    flat = flat_dmp().fit(rows)
    assert flat.dmp_.primitive_.identity == listed.primitive_.identity
    np.testing.assert_array_equal(flat.score_samples(rows), listed.score_samples(rows.reshape(8, 25, 2)))
    assert flat.score(rows) == pytest.approx(np.mean(flat.score_samples(rows)))
    assert not hasattr(flat.dmp, "primitive_"), "it learns on a copy"


def test_nan_in_a_row_is_what_was_not_measured(rows):
    flat, gappy = flat_dmp().fit(rows), rows.copy()
    gappy[:, 20:24] = np.nan
    expected = flat.dmp_.score_samples(list(gappy.reshape(8, 25, 2)))
    np.testing.assert_allclose(flat.score_samples(gappy), expected, rtol=1e-9)
    gappy[0, 3] = np.inf
    with pytest.raises(ValueError, match="infinity"):
        flat.score_samples(gappy)


def test_rows_are_drawn_as_they_are_given(rows):
    flat = flat_dmp().fit(rows)
    drawn = flat.sample(40, random_state=0)
    assert drawn.shape == (40, 50)
    assert np.abs(drawn.mean(axis=0) - rows.mean(axis=0)).max() < 0.1
    np.testing.assert_array_equal(drawn, flat.sample(40, random_state=0))


def test_a_row_that_does_not_fit_is_refused(rows):
    with pytest.raises(InputError, match=r"rows of a multiple of n_dof = 3 numbers, got 50\. A row is x0, y0"):
        FlatDMP(ProbabilisticDMP(), n_dof=3, dt=0.04).fit(rows)
    with pytest.raises(InputTypeError, match="dmp as a ProbabilisticDMP"):
        FlatDMP("dmp", n_dof=2, dt=0.04).fit(rows)
    with pytest.raises(InputTypeError, match="detector as a FailureDetector"):
        flat_detector("strict").fit(rows)
    with pytest.raises(ValueError, match="1 sample"):
        flat_detector().fit(rows[:1])


def test_a_flat_detector_finds_the_row_that_went_elsewhere(rows):
    detector, strange = flat_detector().fit(rows), rows.copy()
    strange[2, 24:] = strange[2, 22:24].repeat(13)
    assert is_outlier_detector(detector)
    assert detector.predict(strange).tolist() == [1, 1, -1, 1, 1, 1, 1, 1]
    assert detector.fit_predict(rows).tolist() == [1] * 8


def test_without_scikit_learn_a_table_says_what_to_type(rows, monkeypatch):
    monkeypatch.setattr("probdmp.estimator.flat.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install 'probdmp\[sklearn\]'"):
        flat_dmp().fit(rows)


# --- lists of demonstrations ------------------------------------------------------------------------------------------


def test_a_clone_has_the_parameters_and_nothing_learned(letters):
    learned = ProbabilisticDMP(7, alpha_z=20.0, channels=["force"])
    copy = clone(learned)
    assert copy.get_params() == learned.get_params()
    assert not hasattr(clone(ProbabilisticDMP(7).fit(letters)), "primitive_")
    assert clone(FailureDetector(0.05, persistence=2)).get_params() == FailureDetector(0.05, persistence=2).get_params()


def test_n_basis_is_chosen_by_demonstrations_that_were_left_out(letters):
    search = GridSearchCV(ProbabilisticDMP(), {"n_basis": [2, 8]}, cv=3).fit(letters)
    assert search.best_params_ == {"n_basis": 8}
    by_hand = []
    for train, test in KFold(3).split(letters):
        learned = ProbabilisticDMP(8).fit([letters[k] for k in train])
        by_hand.append(np.mean(learned.score_samples([letters[k] for k in test])))
    assert search.best_score_ == pytest.approx(np.mean(by_hand))
    assert search.best_estimator_.primitive_.identity == ProbabilisticDMP(8).fit(letters).primitive_.identity


def test_cross_validation_takes_lists_and_arrays(letters):
    scores = cross_val_score(ProbabilisticDMP(5), letters, cv=3)
    assert scores.shape == (3,)
    assert np.isfinite(scores).all()
    array = np.stack([d.positions[:20] for d in letters])
    by_array = cross_val_score(ProbabilisticDMP(5), array, cv=3, params={"dt": 0.03})
    expected = cross_val_score(ProbabilisticDMP(5), list(array), cv=3, params={"dt": 0.03})
    np.testing.assert_allclose(by_array, expected, rtol=1e-9)


def test_a_pipeline_ends_in_a_movement(letters):
    def every_other(demonstrations):
        return [type(d)(d.positions[::2], 2 * d.dt, d.label) for d in demonstrations]

    pipeline = make_pipeline(FunctionTransformer(every_other), ProbabilisticDMP(5)).fit(letters)
    alone = ProbabilisticDMP(5).fit(every_other(letters))
    np.testing.assert_array_equal(pipeline.score_samples(letters), alone.score_samples(every_other(letters)))
    assert pipeline.score(letters) == alone.score(every_other(letters))
    search = GridSearchCV(Pipeline([("dmp", ProbabilisticDMP())]), {"dmp__n_basis": [2, 8]}, cv=2).fit(letters)
    assert search.best_params_ == {"dmp__n_basis": 8}


def test_what_is_inside_is_searched_by_two_underscores(rows):
    search = GridSearchCV(flat_dmp(), {"dmp__n_basis": [2, 6]}, cv=2).fit(rows)
    assert search.best_estimator_.dmp_.primitive_.configuration.n_basis == search.best_params_["dmp__n_basis"]
    detector = flat_detector()
    assert set(detector.get_params(deep=False)) == {"detector", "dmp", "n_dof", "dt"}
    detector.set_params(detector__false_alarm_rate=0.2, dmp__n_basis=4)
    assert (detector.detector.false_alarm_rate, detector.dmp.n_basis) == (0.2, 4)
    detector.set_params(dmp__n_basis=6, dmp=ProbabilisticDMP(alpha_z=20.0))
    assert (detector.dmp.n_basis, detector.dmp.alpha_z) == (6, 20.0)
    with pytest.raises(InputError, match="the name of a parameter"):
        detector.set_params(dmp__basis=4)


def test_a_label_for_each_is_refused_not_taken_for_a_time(letters):
    """A primitive is one movement: `fit` has no y, and where scikit-learn would put it is dt."""
    with pytest.raises(InputTypeError, match="dt > 0 in seconds"):
        make_pipeline(ProbabilisticDMP(5)).fit([d.positions for d in letters], np.zeros(9))


# --- the detector's scores --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"persistence": 4}, {"rule": "paper"}, {"statistic": "nis"}], ids=str)
def test_the_sign_of_the_decision_is_the_prediction(letters, options):
    learned = ProbabilisticDMP(8).fit(letters)
    detector = FailureDetector(0.1, **options).fit(learned, letters)
    blocked = [replace(d, positions=hold(d.positions, 14, np.random.default_rng(1))) for d in letters[:3]]
    executions = [*letters, *blocked]
    decision, scores = detector.decision_function(executions), detector.score_samples(executions)
    np.testing.assert_array_equal(np.where(decision < 0, -1, 1), detector.predict(executions))
    np.testing.assert_array_equal(decision, scores - detector.offset_)
    ratios = np.array([v.test_ratio for v in detector.verdicts(executions)])
    failed = decision < 0
    np.testing.assert_array_equal(-scores[failed], ratios[failed])
    assert failed[-3:].all()


# --- without scikit-learn ---------------------------------------------------------------------------------------------

USE = """
import sys
{first}
from probdmp import FailureDetector, ProbabilisticDMP, synthetic_letters
letters = synthetic_letters(4, letters="s", dt=0.04)
learned = ProbabilisticDMP(4).fit(letters)
learned.get_params(), learned.set_params(n_basis=5), learned.score(letters)
FailureDetector(rule="paper").fit(learned, letters).decision_function(letters)
print(sorted(name for name in sys.modules if name.startswith("sklearn.")))
"""


@pytest.mark.parametrize("first", ["", "sys.modules['sklearn'] = None"], ids=["installed", "absent"])
def test_nothing_but_a_table_needs_scikit_learn(first):
    done = subprocess.run([sys.executable, "-c", USE.format(first=first)], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
