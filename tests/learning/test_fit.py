"""Learning as a whole: symmetries, extremes, and recorded letters."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import make_primitive, seeds

from probdmp import read_demonstrations
from probdmp.demonstrations import Demonstration, synthetic_letters
from probdmp.dmp import PUBLISHED, Configuration, Primitive, linear_gaussian_model, task_for
from probdmp.errors import InputError
from probdmp.execution import roll_out, sample_trajectories
from probdmp.gaussian import filter_sequence
from probdmp.learning import LearningOptions, fit_primitive

SMALL = Configuration(n_basis=10)
POWERS = {
    "weight_means": 1, "weight_covariances": 2, "weight_precisions": -2, "forcing_precisions": -2,
    "observation_variances": 2, "goal_displacements": 1, "ranges": 1, "start": 1, "goal": 1, "start_velocities": 1,
    "start_covariances": 2,
}  # fmt: skip
"""How each array of a primitive depends on the unit of length."""


def learn(positions, dt=0.01, configuration=SMALL, smoothing=0.05):
    demos = [d if isinstance(d, Demonstration) else Demonstration(d, dt) for d in positions]
    return fit_primitive(demos, configuration, LearningOptions(smoothing=smoothing))[0]


def finite(primitive, duration=None):
    """The rollout of a primitive, which must be finite throughout."""
    task = task_for(primitive, duration=duration)
    rolled = roll_out(primitive, task, float(task.duration) / 40)
    assert np.isfinite(rolled.means).all()
    assert np.isfinite(rolled.covariances).all()
    assert np.all(primitive.observation_variances > 0)
    return rolled


def assert_alike(one, other, rtol, units=(1.0, 1.0), order=(0, 1)):
    """`one` in other units for each degree of freedom, and these in another order, is `other`."""
    units = np.asarray(units)[list(order)]
    for name, power in POWERS.items():
        wanted = getattr(one, name)[list(order)]
        got = getattr(other, name) / units.reshape(-1, *(1,) * (wanted.ndim - 1)) ** power
        for w, g in zip(wanted, got, strict=True):
            np.testing.assert_allclose(g, w, rtol=rtol, atol=rtol * np.abs(w).max(), err_msg=name)
    for name in ("duration", "dt", "phase_step", "n_demonstrations"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-12)


def test_all_arrays_have_a_known_unit():
    assert set(POWERS) == {f.name for f in fields(Primitive) if f.type == fields(Primitive)[1].type}


@pytest.fixture(scope="module")
def letters():
    """Three repetitions of one letter, each of its own length."""
    return synthetic_letters(3, letters="s", dt=0.02)


@pytest.fixture(scope="module", params=["exact", "semi_implicit_euler"])
def learned(request, letters):
    """The same in the defaults, and with the paper's scheme and scaling."""
    configuration = SMALL if request.param == "exact" else replace(PUBLISHED, n_basis=10)
    return configuration, learn(letters, configuration=configuration)


# --- symmetries -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_scale_the_primitive(letters, learned, unit):
    configuration, one = learned
    other = learn([replace(d, positions=d.positions * unit) for d in letters], configuration=configuration)
    assert_alike(one, other, 1e-5, (unit, unit))


@pytest.mark.parametrize("units", [(1e-6, 1.0), (1.0, 1e6), (1e-6, 1e6), (1e7, 1e-7)])
def test_every_degree_of_freedom_has_its_own_unit(letters, learned, units):
    configuration, one = learned
    other = learn([replace(d, positions=d.positions * units) for d in letters], configuration=configuration)
    assert_alike(one, other, 1e-5, units)


def test_permuted_degrees_of_freedom_permute_the_primitive(letters, learned):
    configuration, one = learned
    other = learn([replace(d, positions=d.positions[:, ::-1], names=("y", "x")) for d in letters], configuration=configuration)
    assert other.names == ("y", "x")
    assert_alike(one, other, 1e-9, order=(1, 0))


def test_the_order_of_the_demonstrations_does_not_matter(letters, learned):
    configuration, one = learned
    assert_alike(one, learn(letters[::-1], configuration=configuration), 1e-5)


@pytest.mark.parametrize("shift", [-50.0, 1000.0])
def test_another_origin_changes_start_and_goal_alone(letters, learned, shift):
    configuration, one = learned
    other = learn([replace(d, positions=d.positions + shift) for d in letters], configuration=configuration)
    np.testing.assert_allclose(other.start, one.start + shift)
    np.testing.assert_allclose(other.goal, one.goal + shift)
    assert_alike(one, replace(other, start=one.start, goal=one.goal), 1e-5)


def test_a_slower_clock_changes_the_duration_alone(letters, learned):
    configuration, one = learned
    other = learn([replace(d, dt=d.dt * 3) for d in letters], configuration=configuration)
    assert other.duration == pytest.approx(3 * one.duration)
    assert_alike(one, replace(other, duration=one.duration, dt=one.dt), 1e-5)


def test_copies_of_demonstrations_do_not_change_the_movement(letters, learned):
    configuration, one = learned
    other = learn(letters * 3, configuration=configuration)
    assert other.n_demonstrations == 9
    task = task_for(one)
    assert np.abs(roll_out(other, task, 0.02).positions - roll_out(one, task, 0.02).positions).max() < 0.02 * one.ranges.max()
    np.testing.assert_allclose(other.forcing_precisions, one.forcing_precisions, rtol=0.1)


def test_names_and_units_are_those_of_the_demonstrations(letters, learned):
    primitive = learned[1]
    assert (primitive.names, primitive.units, primitive.n_demonstrations) == (("x", "y"), "mm", 3)
    assert primitive.dt == 0.02
    assert primitive.phase_step == pytest.approx(np.mean([1 / (d.n_samples - 1) for d in letters]))
    assert primitive.duration == pytest.approx(np.mean([d.duration for d in letters]))
    np.testing.assert_allclose(primitive.start, np.mean([d.positions[0] for d in letters], axis=0))
    np.testing.assert_allclose(primitive.goal, np.mean([d.positions[-1] for d in letters], axis=0))


# --- what it must learn -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [4, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("configuration", [Configuration(), PUBLISHED], ids=["default", "published"])
def test_a_single_recorded_letter_is_reproduced(recordings, configuration, every):
    """Root mean square of demonstration minus rollout below 1 % of the range."""
    demos = read_demonstrations(recordings / "uci_letters" / "letters.npz")
    for label in sorted({d.label for d in demos})[::every]:
        _, report = fit_primitive([next(d for d in demos if d.label == label)], configuration, LearningOptions())
        assert report.reproduction_errors.shape == (1, 2)
        assert report.reproduction_errors.max() < 0.01, label


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
@pytest.mark.parametrize("scaling", ["none", "paper"])
def test_a_movement_of_the_model_is_recovered(scheme, scaling):
    """Demonstrations drawn from a primitive, to other goals, teach a primitive that moves alike."""
    rng = np.random.default_rng(0)
    true = make_primitive(
        rng, 2, 6, discretization=scheme, scaling=scaling, observation_variances=np.full(2, 1e-8), duration=1.0,
        forcing_precisions=np.full(2, 1e-2), weight_covariances=np.zeros((2, 6, 6)),
    )  # fmt: skip
    demos = []
    for _ in range(6):
        task = task_for(true, goal=true.goal + rng.uniform(-0.2, 0.2, 2))
        demos.append(Demonstration(sample_trajectories(true, task, 0.01, 1, rng, True)[0], 0.01))
    found = learn(demos, configuration=replace(true.configuration, n_basis=6), smoothing=0.0)
    for goal in (true.goal, true.goal + np.array([1.0, -0.5])):
        task = task_for(true, goal=goal, start_velocity=true.start_velocities)
        wanted, got = (roll_out(p, task, 0.01).positions for p in (true, found))
        assert np.abs(got - wanted).max() < 0.06 * np.ptp(wanted)


@pytest.mark.parametrize("scheme", ["exact", "semi_implicit_euler"])
def test_amplitudes_are_scaled_while_learning_too(scheme):
    """Movements of one shape and very different size: with the paper's scaling, one set of weights says all of them."""
    rng = np.random.default_rng(1)
    true = make_primitive(
        rng, 2, 6, discretization=scheme, scaling="paper", start_velocities=np.zeros(2), start_covariances=np.zeros((2, 2, 2)),
        goal_displacements=np.array([1.0, -1.0]), duration=1.0, weight_means=100 * rng.standard_normal((2, 6)),
    )  # fmt: skip
    demos = []
    for size, dt in ((0.3, 0.0025), (1.0, 0.01), (1.7, 0.01)):  # with as many samples each, scaling or not would be the same
        task = task_for(true, goal=true.start + size * true.goal_displacements)
        demos.append(Demonstration(roll_out(true, task, dt).positions, dt))
    found, report = fit_primitive(demos, true.configuration, LearningOptions(smoothing=0.0))
    assert found.scaled == (True, True)
    assert report.reproduction_errors.max() < 0.02


def test_the_report_is_the_distance_from_the_rollout(letters):
    primitive, report = fit_primitive(letters, SMALL, LearningOptions())
    for demo, errors in zip(letters, report.reproduction_errors, strict=True):
        task = task_for(primitive, demo.positions[0], demo.positions[-1], demo.duration)
        model = linear_gaussian_model(primitive, task, demo.dt, demo.n_samples)
        distance = filter_sequence(model).filtered.means[..., 2] - demo.positions
        np.testing.assert_allclose(errors, np.sqrt(np.mean(distance**2, axis=0)) / primitive.ranges, rtol=1e-9)
    assert np.all(np.diff(report.observation_noise.log_likelihoods) >= -1e-9 * 1e4)
    np.testing.assert_array_equal(report.observation_noise.variances, primitive.observation_variances)


def test_the_rate_of_the_demonstrations_hardly_matters():
    demos = synthetic_letters(3, letters="s", dt=0.005)
    halved = [replace(d, positions=d.positions[: 2 * (len(d.positions) // 2) + 1 : 2], dt=0.01) for d in demos]
    fine, coarse = learn(demos), learn(halved)
    task = task_for(fine)
    one, other = roll_out(fine, task, 0.01), roll_out(coarse, task, 0.01)
    assert np.abs(one.positions - other.positions).max() < 0.03 * fine.ranges.max()
    np.testing.assert_allclose(fine.phase_step, coarse.phase_step / 2, rtol=0.02)


def test_demonstrations_of_different_rates_and_lengths():
    a, b, c = synthetic_letters(3, letters="s", dt=0.01)
    mixed = [a, replace(b, positions=b.positions[::2], dt=0.02), replace(c, positions=c.positions[::3], dt=0.03)]
    primitive = learn(mixed)
    finite(primitive)
    assert primitive.dt == pytest.approx(0.02)
    assert primitive.duration == pytest.approx(np.mean([d.duration for d in mixed]))
    alike = learn([a, b, c])
    one, other = finite(primitive, 1.0), finite(alike, 1.0)
    assert np.abs(one.positions - other.positions).max() < 0.05 * alike.ranges.max()


def test_start_velocities_are_those_of_the_demonstrations():
    """Straight lines: the velocity times the duration is the displacement; its variance that between demonstrations."""
    t = np.linspace(0, 1, 50)[:, None]
    primitive = learn([t * v for v in ([1.0, 5.0], [2.0, 5.0], [3.0, 5.0])])
    np.testing.assert_allclose(primitive.start_velocities, [2, 5], rtol=1e-9)
    np.testing.assert_allclose(primitive.start_covariances[:, 0, 0], [1.0, 0.0], atol=1e-9)
    assert not primitive.start_covariances[:, 1].any()  # they all start at 0


def test_starts_vary_as_those_of_the_demonstrations():
    t = np.linspace(0, 1, 50)[:, None]
    primitive = learn([t + np.array(start) for start in ([1.0, 7.0], [3.0, 7.0], [8.0, 7.0])])
    np.testing.assert_allclose(primitive.start, [4, 7], rtol=1e-12)
    np.testing.assert_allclose(primitive.start_covariances[:, 1, 1], [13.0, 0.0], rtol=1e-12)
    assert not primitive.start_covariances[:, [0, 1], [1, 0]].any()
    known, unknown = (roll_out(primitive, task_for(primitive, start), 0.05) for start in (None, [np.nan, np.nan]))
    np.testing.assert_array_equal(known.position_stds[0], 0)
    np.testing.assert_allclose(unknown.position_stds[0], [np.sqrt(13.0), 0.0], rtol=1e-12)
    np.testing.assert_array_equal(unknown.means, known.means)


def test_missing_samples_inside_a_demonstration(letters):
    gaps = [np.array(d.positions) for d in letters]
    for positions in gaps:
        positions[5:8], positions[20, 0] = np.nan, np.nan
    one, other = learn(letters), learn([replace(d, positions=g) for d, g in zip(letters, gaps, strict=True)])
    assert np.abs(finite(one).positions - finite(other).positions).max() < 0.05 * one.ranges.max()


# --- extremes ---------------------------------------------------------------------------------------------------------


@settings(max_examples=15)
@given(seeds, st.integers(3, 12), st.sampled_from(["walk", "noise", "line", "quantised"]))
def test_twelve_samples_and_thirty_basis_functions(seed, n_samples, kind):
    rng, t = np.random.default_rng(seed), np.linspace(0, 1, n_samples)[:, None]
    positions = {
        "walk": rng.standard_normal((n_samples, 2)).cumsum(axis=0),
        "noise": rng.standard_normal((n_samples, 2)),
        "line": t * rng.standard_normal(2),
        "quantised": np.round(5 * np.sin(9 * t * rng.standard_normal(2))),
    }[kind]
    finite(learn([positions], configuration=Configuration()))


@pytest.mark.parametrize(
    "samples",
    [
        [0, -1, -1, -2, -2, -2, -3, -3, -4, -4, -4],
        [0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5],
        [0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3],
    ],
)
@pytest.mark.parametrize("n_basis", [30, 60])
def test_short_quantised_recordings(samples, n_basis):
    """More weights than samples and a perfect fit: no degrees of freedom are left for the noise."""
    finite(learn([np.array(samples, dtype=float)[:, None]], configuration=Configuration(n_basis=n_basis)))


def test_one_demonstration(letters):
    primitive = learn(letters[:1])
    assert primitive.n_demonstrations == 1
    np.testing.assert_array_equal(primitive.start_covariances, 0)
    np.testing.assert_allclose(finite(primitive).positions[[0, -1]], letters[0].positions[[0, -1]], atol=0.6)


def test_identical_demonstrations(letters):
    primitive = learn([letters[0]] * 4)
    np.testing.assert_array_equal(primitive.start_covariances, 0)
    finite(primitive)


@pytest.mark.parametrize("value", [0.0, 0.3, -1e6, 1e-20, 1e20])
@pytest.mark.parametrize("configuration", [SMALL, replace(PUBLISHED, n_basis=10)], ids=["default", "published"])
def test_a_constant_signal_is_a_movement_that_stays(value, configuration):
    primitive = learn([np.full((40, 2), value)], configuration=configuration)
    rolled = finite(primitive)
    np.testing.assert_allclose(rolled.positions, value, atol=1e-6 * (abs(value) or 1.0))
    assert np.all(rolled.position_stds <= 1e-3 * (abs(value) or 1.0))


@pytest.mark.parametrize("value", [0.0, 0.3])
def test_a_degree_of_freedom_that_never_moves(letters, value):
    """A joint that is not used: the others are learned as if it were not there."""
    with_still = [Demonstration(np.column_stack([d.positions, np.full(d.n_samples, value)]), d.dt) for d in letters]
    primitive, alone = learn(with_still), learn(letters)
    np.testing.assert_allclose(primitive.weight_means[:2], alone.weight_means, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(finite(primitive).positions[:, 2], value, atol=1e-6)


@pytest.mark.parametrize("scaling", ["none", "paper"])
def test_a_movement_that_ends_where_it_began(scaling):
    t = np.linspace(0, 1, 60)[:, None]
    loop = np.hstack([np.sin(np.pi * t) ** 2, np.sin(2 * np.pi * t)])
    loop[-1] = loop[0]
    primitive = learn([loop, loop * 1.1], configuration=Configuration(n_basis=20, scaling=scaling))
    assert primitive.scaled == (False, False)
    rolled = finite(primitive)
    assert np.abs(rolled.positions[:, 0] - np.sin(np.pi * np.linspace(0, 1, 41)) ** 2 * 1.05).max() < 0.1


@pytest.mark.parametrize("scaling", ["none", "paper"])
def test_more_basis_functions_than_anyone_needs(letters, scaling):
    finite(learn(letters, configuration=Configuration(n_basis=200, scaling=scaling)))


@pytest.mark.parametrize("magnitude", [1e-110, 1e-45, 1e45, 1e99])
def test_movements_of_absurd_size_are_refused_in_words(letters, magnitude):
    with pytest.raises(InputError, match=r"Expected .*movement over .* units, got .*Rescale|of magnitude at most 1e\+100"):
        learn([replace(d, positions=d.positions / 10 * magnitude) for d in letters])


@pytest.mark.parametrize("magnitude", [1e-30, 1e30])
def test_movements_of_unusual_size_are_learned(letters, magnitude):
    one, other = learn(letters), learn([replace(d, positions=d.positions * magnitude) for d in letters])
    assert_alike(one, other, 1e-5, (magnitude, magnitude))


@pytest.mark.parametrize("column", [0, 1])
def test_a_degree_of_freedom_that_was_never_measured_is_refused_by_name(letters, column):
    positions = np.array(letters[0].positions)
    positions[:, column] = np.nan
    with pytest.raises(InputError, match=f"a demonstration whose {'xy'[column]} is measured at the first and last sample"):
        learn([replace(letters[0], positions=positions)])


def test_too_coarse_for_semi_implicit_euler_is_said():
    with pytest.raises(InputError, match=r"alpha_z dt / duration <= 1\.657.*got 2\.27.*smaller dt, or .*exact"):
        learn([np.random.default_rng(0).standard_normal((12, 2))], configuration=PUBLISHED)


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"smoothing": -0.1}, "smoothing as a number from 0 to 0.5, got -0.1"),
        ({"smoothing": 0.6}, "smoothing as a number from 0 to 0.5, got 0.6"),
        ({"smoothing": np.nan}, "smoothing as a number from 0 to 0.5, got nan"),
        ({"weight_model": "mixture"}, "weight_model to be one of 'pooled', 'hierarchical', got 'mixture'"),
    ],
)
def test_options_that_cannot_be_used(options, match):
    with pytest.raises(InputError, match=f"Expected {match}"):
        LearningOptions(**options)


@pytest.mark.parametrize("n", [10, 12, 20])
def test_demonstrations_of_one_rate_teach_that_very_rate(n):
    """The mean of as many equal steps need not be that step: 0.010000000000000002."""
    demonstrations = synthetic_letters(n, letters="a")
    assert np.mean([d.dt for d in demonstrations]) != 0.01
    assert learn(demonstrations).dt == 0.01
