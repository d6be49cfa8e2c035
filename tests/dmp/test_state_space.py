"""The primitive as a linear-Gaussian system, against the classical integration of a movement primitive."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import integrate_dmp
from strategies import make_primitive, seeds

from probdmp import read_demonstrations
from probdmp.demonstrations import synthetic_letters
from probdmp.dmp import Configuration, Task, linear_gaussian_model, step_count, task_for
from probdmp.dmp.basis import basis_features
from probdmp.errors import InputError
from probdmp.gaussian import filter_sequence
from probdmp.learning import LearningOptions, fit_primitive

SCHEMES = ("exact", "semi_implicit_euler")


def rolled(primitive, task, dt, n_steps=None):
    """Means (T, D, 3) and covariances (T, D, 3, 3) of a rollout."""
    n_steps = n_steps or step_count(float(task.duration), dt)
    return filter_sequence(linear_gaussian_model(primitive, task, dt, n_steps)).filtered


def classical(primitive, task, dt, amplitudes):
    """Means (T, D, 3) by the scalar equations."""
    n_steps = step_count(float(task.duration), dt)
    velocities = primitive.start_velocities / task.duration if task.start_velocity is None else task.start_velocity
    paths = [
        integrate_dmp(
            primitive.weight_means[d], task.start[d], primitive.goals(task)[d], float(task.duration), dt, n_steps,
            primitive.configuration.alpha_z, velocities[d], amplitudes[d],
        )
        for d in range(primitive.n_dof)
    ]  # fmt: skip
    return np.stack([np.stack(path[::-1], axis=-1) for path in paths], axis=1)


def assert_same_motion(means, wanted, task, atol):
    """In units of the phase, where position, velocity and acceleration are of comparable size."""
    duration = float(task.duration)
    scale = np.array([duration**2, duration, 1.0])
    error = np.abs(means - wanted) * scale
    size = np.maximum(np.abs(wanted * scale).max(axis=(0, 1)), 1.0)
    assert (error / size).max() <= atol


@settings(max_examples=30)
@given(
    seeds,
    st.sampled_from([0.25, 1.0, 4.0]),
    st.sampled_from(["none", "paper"]),
    st.booleans(),
    st.sampled_from([1, 2, 5, 12]),
)
def test_semi_implicit_rollout_is_the_classical_integration(seed, slower, scaling, given_velocity, n_basis):
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, 2, n_basis, discretization="semi_implicit_euler", scaling=scaling)
    start, goal = rng.uniform(-3, 3, (2, 2))
    velocity = rng.standard_normal(2) if given_velocity else None
    task = task_for(primitive, start, goal, primitive.duration * slower, velocity)
    amplitudes = (goal - start) / primitive.goal_displacements if scaling == "paper" else np.ones(2)
    dt = float(task.duration) / 150
    assert_same_motion(rolled(primitive, task, dt).means, classical(primitive, task, dt, amplitudes), task, 1e-10)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_inputs_that_are_shifted_by_one_step_are_noticed(scheme):
    """u[t-1] drives s[t-1] to s[t]; one step earlier or later is another movement, by far more than rounding."""
    primitive = make_primitive(np.random.default_rng(0), discretization=scheme)
    task, dt = task_for(primitive), primitive.duration / 100
    model = linear_gaussian_model(primitive, task, dt, 101)
    right = filter_sequence(model).filtered.means
    for shift in (-1, 1):
        shifted = replace(model, inputs=np.roll(model.inputs, shift, axis=0))
        assert np.abs(filter_sequence(shifted).filtered.means - right)[..., 2].max() > 1e-3
    if scheme == "semi_implicit_euler":
        np.testing.assert_allclose(right, classical(primitive, task, dt, np.ones(2)), rtol=1e-10, atol=1e-10)


@settings(max_examples=20)
@given(seeds, st.sampled_from([0.25, 1.0, 4.0]))
def test_exact_rollout_is_the_solution_with_the_forcing_held_over_each_step(seed, slower):
    """Against twenty times finer classical integration of the same held inputs: the gap shrinks as its step."""
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng)
    task = task_for(primitive, *rng.uniform(-2, 2, (2, 2)), primitive.duration * slower)
    dt = float(task.duration) / 40
    model = linear_gaussian_model(primitive, task, dt, 41)
    rate, k = 1 / float(task.duration), primitive.configuration.alpha_z
    gaps = []
    for fine in (50, 100):
        h, p, v = dt / fine, np.array(task.start), primitive.start_velocities / float(task.duration)
        path = [p]
        for u in model.inputs[..., 0]:
            for _ in range(fine):
                v = v + h * (-k * rate * v - k**2 / 4 * rate**2 * p + rate**2 * u)
                p = p + h * v
            path.append(p)
        gaps.append(np.abs(filter_sequence(model).filtered.means[..., 2] - path).max())
    assert gaps[1] < 0.02
    assert gaps[1] < 0.6 * gaps[0]


@pytest.fixture(scope="module")
def letters():
    """Primitives of three letters."""
    demos = synthetic_letters(3, letters="asw", dt=0.01)
    return [
        fit_primitive([d for d in demos if d.label == letter], Configuration(n_basis=20), LearningOptions())[0]
        for letter in "asw"
    ]


def test_exact_path_does_not_depend_on_the_control_rate(letters):
    for primitive in letters:
        task = task_for(primitive, duration=round(primitive.duration, 2))
        slow, fast = rolled(primitive, task, 0.01).means, rolled(primitive, task, 0.001).means[::10]
        assert (np.abs(slow - fast)[..., 2] / primitive.ranges).max() < 1e-3


def test_exact_path_is_of_second_order_in_the_step_at_least(letters):
    """Half the step, less than a quarter of the error; with forcing held from the step's start it would be half."""
    for primitive in letters:
        task = task_for(primitive, duration=round(primitive.duration, 2))
        best = rolled(primitive, task, 0.000625).means[..., 2]
        coarse, fine = (
            np.abs(rolled(primitive, task, dt).means[..., 2] - best[:: round(dt / 0.000625)]).max() for dt in (0.01, 0.005)
        )
        assert coarse / fine > 4


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_exact_path_of_recorded_letters_hardly_depends_on_the_control_rate(recordings, every):
    """These letters are short, 100 Hz is coarse for them; measured: up to 2.5e-4 of the range; 2 % of bands."""
    demos = read_demonstrations(recordings / "uci_letters" / "letters.npz")
    paths, bands = [], []
    for label in sorted({d.label for d in demos})[::every]:
        primitive, _ = fit_primitive([d for d in demos if d.label == label][:10], Configuration(), LearningOptions())
        task = task_for(primitive)
        n_steps = min(step_count(primitive.duration, 0.01), (step_count(primitive.duration, 0.001) - 1) // 10 + 1)
        slow, fast = rolled(primitive, task, 0.01, n_steps), rolled(primitive, task, 0.001, 10 * n_steps - 9)
        paths.append((np.abs(slow.means - fast.means[::10])[..., 2] / primitive.ranges).max())
        coarse, fine = (np.sqrt(np.diagonal(r.covariances, axis1=-2, axis2=-1))[..., 1:] for r in (slow, fast))
        bands.append((np.abs(coarse - fine[::10]).max(axis=0) / coarse.max(axis=0)).max())
    assert len(paths) == 20 // every
    assert max(paths) < 5e-4
    assert max(bands) < 0.02


@pytest.mark.parametrize("noise", ["posterior", "predictive"])
def test_bands_do_not_depend_on_the_control_rate(letters, noise):
    """Position and velocity bands; white forcing makes white acceleration, whose band grows as 1 / sqrt(dt)."""
    for learned in letters:
        primitive = replace(learned, configuration=replace(learned.configuration, forcing_noise=noise))
        task = task_for(primitive, duration=round(primitive.duration, 2))
        slow, fast = (np.sqrt(np.diagonal(rolled(primitive, task, dt).covariances, axis1=-2, axis2=-1)) for dt in (0.01, 0.001))
        for row in (1, 2):
            assert (np.abs(slow - fast[::10])[..., row].max(axis=0) / slow[..., row].max(axis=0)).max() < 0.02
        ratios = fast[10::10, :, 0] / slow[1:, :, 0]
        np.testing.assert_allclose(np.median(ratios), np.sqrt(10), rtol=0.1)


@settings(max_examples=20)
@given(seeds, st.floats(0.3, 3), st.sampled_from(SCHEMES), st.sampled_from([0.002, 0.01, 0.03]))
def test_what_is_held_over_a_step_and_how_it_is_uncertain(seed, slower, scheme, phase_step):
    """Euler: the forcing term at the start of the step; exact (-f(start) + 8 f(middle) - f(end)) / 6, first f' dt / 12 less."""
    primitive = make_primitive(
        np.random.default_rng(seed), discretization=scheme, phase_step=phase_step, forcing_noise="predictive"
    )
    task = task_for(primitive, duration=primitive.duration * slower)
    duration, n_basis, alpha_z = float(task.duration), primitive.configuration.n_basis, primitive.configuration.alpha_z
    dt, times = phase_step * duration, np.arange(60)  # at the phase step of the demonstrations nothing is to be corrected

    def features(places):
        return basis_features(0.01 ** (places * phase_step), n_basis)

    held, at = features(times), features(times)
    if scheme == "exact":
        at = features(times + 0.5)
        held = (-features(times) + 8 * at - features(times + 1.0)) / 6
        held[0] -= (features(times + 1.0)[0] - features(times)[0]) / 12
    model = linear_gaussian_model(primitive, task, dt, 61)
    wanted = alpha_z**2 / 4 * primitive.goals(task) + held @ primitive.weight_means.T
    np.testing.assert_allclose(model.inputs[..., 0], wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    spread = np.einsum("tn,dnm,tm->td", at, primitive.weight_covariances, at) + 1 / primitive.forcing_precisions
    np.testing.assert_allclose(model.input_covariances[..., 0, 0], spread, rtol=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_noise_moves_the_velocity_alike_at_any_step(scheme):
    """Redrawn k times as often, the forcing term needs k times the variance, here of constant sigma_f^2 over a whole second."""
    constant = {"weight_covariances": np.zeros((2, 8, 8)), "start_covariances": np.zeros((2, 2, 2)), "duration": 1.0}
    primitive = make_primitive(np.random.default_rng(0), discretization=scheme, **constant)
    task = task_for(primitive)
    as_learned, fine = linear_gaussian_model(primitive, task, 0.01, 101), linear_gaussian_model(primitive, task, 0.001, 1001)
    ratio = (fine.input_covariances[0] / as_learned.input_covariances[0]).ravel()
    np.testing.assert_allclose(ratio, 10, rtol=1e-12 if scheme == "semi_implicit_euler" else 0.01)
    slow, fast = (filter_sequence(model).filtered.covariances[-1, :, 1, 1] for model in (as_learned, fine))
    np.testing.assert_allclose(slow, fast, rtol=0.02 if scheme == "exact" else 0.3)


@settings(max_examples=20)
@given(seeds, st.sampled_from(SCHEMES), st.integers(1, 130), st.sampled_from(["none", "paper"]))
def test_a_later_part_of_the_movement_has_the_inputs_of_the_whole(seed, scheme, first, scaling):
    """`first_step` continues where the first part ended, also beyond the end of the movement."""
    primitive = make_primitive(np.random.default_rng(seed), discretization=scheme, scaling=scaling)
    task, dt = task_for(primitive), primitive.duration / 100
    whole = linear_gaussian_model(primitive, task, dt, 201)
    later = linear_gaussian_model(primitive, task, dt, 201 - first, first)
    for name in ("inputs", "input_covariances"):
        np.testing.assert_allclose(getattr(later, name), getattr(whole, name)[first:], rtol=1e-12)
    np.testing.assert_array_equal(later.transition, whole.transition)


@settings(max_examples=20)
@given(seeds, st.sampled_from(SCHEMES), st.sampled_from(["none", "paper"]), st.booleans(), st.booleans())
def test_a_batch_of_tasks_is_its_members(seed, scheme, scaling, given_velocities, common_dt):
    rng = np.random.default_rng(seed)
    primitive = make_primitive(rng, discretization=scheme, scaling=scaling)
    durations, dts = rng.uniform(0.5, 3, 4), rng.uniform(0.005, 0.02, 4)
    if common_dt:
        dts = np.array(0.01)
    starts, goals, velocities = rng.uniform(-2, 2, (3, 4, 2))
    tasks = Task(starts, goals, durations, velocities if given_velocities else None)
    batch = filter_sequence(linear_gaussian_model(primitive, tasks, dts, 30)).filtered
    assert batch.means.shape == (30, 4, 2, 3)
    for k in range(4):
        own = task_for(primitive, starts[k], goals[k], durations[k], velocities[k] if given_velocities else None)
        single = rolled(primitive, own, float(np.broadcast_to(dts, 4)[k]), 30)
        for all_of_them, one in zip(batch, single, strict=True):
            np.testing.assert_allclose(all_of_them[:, k], one, rtol=1e-12, atol=1e-12 * np.abs(one).max())


def test_degrees_of_freedom_are_independent():
    primitive = make_primitive(np.random.default_rng(3), 3)
    task = task_for(primitive)
    moved = task_for(primitive, goal=primitive.goals(task) + np.array([0.0, 5.0, 0.0]))
    one, other = rolled(primitive, task, 0.01), rolled(primitive, moved, 0.01)
    np.testing.assert_array_equal(one.means[:, [0, 2]], other.means[:, [0, 2]])
    assert np.abs(one.means[-1, 1, 2] - other.means[-1, 1, 2]) > 4


@pytest.mark.parametrize("scheme", SCHEMES)
def test_it_ends_at_the_goal_once_the_forcing_has_faded(scheme):
    primitive = make_primitive(np.random.default_rng(1), discretization=scheme)
    task = task_for(primitive, goal=[3.0, -2.0])
    means = rolled(primitive, task, 0.01, step_count(float(task.duration) * 4, 0.01)).means
    np.testing.assert_allclose(means[-1], [[0, 0, 3], [0, 0, -2]], atol=1e-4)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_translation_moves_the_movement(scheme):
    primitive = make_primitive(np.random.default_rng(2), discretization=scheme, scaling="paper")
    here = task_for(primitive)
    there = task_for(primitive, here.start + 7, primitive.goal + 7)
    one, other = rolled(primitive, here, 0.01), rolled(primitive, there, 0.01)
    np.testing.assert_allclose(other.means - one.means, np.broadcast_to([0, 0, 7.0], one.means.shape), atol=1e-8)
    np.testing.assert_allclose(other.covariances, one.covariances, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("slower", [0.25, 4.0])
def test_another_duration_is_the_same_path_in_phase(scheme, slower):
    primitive = make_primitive(np.random.default_rng(4), discretization=scheme)
    own = task_for(primitive, duration=1.0)
    scaled = task_for(primitive, duration=slower)
    one, other = rolled(primitive, own, 0.01), rolled(primitive, scaled, 0.01 * slower)
    units = np.array([slower**2, slower, 1.0])
    np.testing.assert_allclose(other.means * units, one.means, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(other.covariances * units[:, None] * units, one.covariances, rtol=1e-9, atol=1e-12)


def test_amplitude_scales_the_forcing_and_its_uncertainty():
    primitive = make_primitive(np.random.default_rng(5), scaling="paper")
    task = task_for(primitive, goal=primitive.start + 3 * primitive.goal_displacements)
    as_learned = linear_gaussian_model(primitive, task_for(primitive), 0.01, 50)
    larger = linear_gaussian_model(primitive, task, 0.01, 50)
    spring = primitive.configuration.alpha_z**2 / 4
    forcing = as_learned.inputs[..., 0] - spring * primitive.goal
    np.testing.assert_allclose(larger.inputs[..., 0], spring * primitive.goals(task) + 3 * forcing, rtol=1e-9)
    np.testing.assert_allclose(larger.input_covariances, 9 * as_learned.input_covariances, rtol=1e-9)


def test_an_unknown_first_state_is_as_learned_in_units_of_the_phase():
    primitive, unknown = make_primitive(np.random.default_rng(6)), [np.nan, np.nan]
    for duration in (0.5, 1.0, 4.0):
        model = linear_gaussian_model(primitive, task_for(primitive, unknown, duration=duration), 0.01, 3)
        np.testing.assert_allclose(model.initial_mean[:, 1], primitive.start_velocities / duration, rtol=1e-14)
        np.testing.assert_allclose(model.initial_mean[:, 2], primitive.start, rtol=1e-14)
        np.testing.assert_allclose(
            model.initial_covariance[:, 1:, 1:],
            primitive.start_covariances * np.outer([1 / duration, 1], [1 / duration, 1]),
            rtol=1e-12,
        )


def test_a_given_start_velocity_is_known_exactly():
    primitive, unknown = make_primitive(np.random.default_rng(6)), [np.nan, np.nan]
    model = linear_gaussian_model(primitive, task_for(primitive, unknown, start_velocity=[1.0, -2.0]), 0.01, 3)
    np.testing.assert_array_equal(model.initial_mean[:, 1], [1.0, -2.0])
    np.testing.assert_array_equal(model.initial_covariance[:, 1], 0)
    np.testing.assert_allclose(model.initial_covariance[:, 2, 2], primitive.start_covariances[:, 1, 1])


@pytest.mark.parametrize("start", [None, [3.0, -4.0]], ids=["learned", "given"])
def test_a_given_start_is_known_exactly(start):
    """Also the mean start, where none is given."""
    primitive = make_primitive(np.random.default_rng(6))
    model = linear_gaussian_model(primitive, task_for(primitive, start, duration=2.0), 0.01, 3)
    np.testing.assert_array_equal(model.initial_mean[:, 2], primitive.start if start is None else start)
    np.testing.assert_array_equal(model.initial_covariance[:, 2], 0)
    np.testing.assert_allclose(model.initial_covariance[:, 1, 1], primitive.start_covariances[:, 0, 0] / 4)


def test_each_degree_of_freedom_is_known_or_not_by_itself():
    primitive = make_primitive(np.random.default_rng(6))
    nan, learned = np.nan, primitive.start_covariances
    task = task_for(primitive, [nan, 5.0], duration=1.0, start_velocity=[2.0, nan])
    model = linear_gaussian_model(primitive, task, 0.01, 3)
    np.testing.assert_array_equal(model.initial_mean[:, 1:], [[2.0, primitive.start[0]], [primitive.start_velocities[1], 5.0]])
    wanted = np.zeros((2, 2, 2))
    wanted[0, 1, 1], wanted[1, 0, 0] = learned[0, 1, 1], learned[1, 0, 0]
    np.testing.assert_array_equal(model.initial_covariance[:, 1:, 1:], wanted)
    for name in ("inputs", "input_covariances"):
        known = linear_gaussian_model(primitive, task_for(primitive, duration=1.0), 0.01, 3)
        np.testing.assert_array_equal(getattr(model, name), getattr(known, name))


@settings(max_examples=20)
@given(seeds, st.floats(0.3, 4))
def test_the_first_acceleration_obeys_the_differential_equation(seed, duration):
    primitive = make_primitive(np.random.default_rng(seed))
    k, task = primitive.configuration.alpha_z, task_for(primitive, duration=duration)
    model = linear_gaussian_model(primitive, task, 0.01, 3)
    _, velocity, position = model.initial_mean.T
    wanted = (k * (k / 4 * (primitive.goals(task) - position) - duration * velocity)) / duration**2
    unforced = model.initial_mean[:, 0] - wanted
    forcing = primitive.weight_means @ basis_features(np.array(1.0), primitive.configuration.n_basis)
    np.testing.assert_allclose(unforced, forcing / duration**2, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())
    assert np.all(np.linalg.eigvalsh(model.initial_covariance) > -1e-9 * model.initial_covariance.max())


@given(st.floats(0.6, 5000), st.floats(1e-4, 10))
def test_number_of_states(steps, dt):
    assert step_count(steps * dt, dt) == round(steps * dt / dt) + 1


def test_number_of_states_examples():
    assert step_count(1.0, 0.01) == 101
    assert step_count(1.004, 0.01) == 101
    assert step_count(1.006, 0.01) == 102


@pytest.mark.parametrize(("duration", "dt"), [(1.0, 2.0), (1.0, 1e-6), (1.0, 1e-320), (1e-300, 1.0), (1e100, 1e-100)])
def test_too_few_and_too_many_states_are_refused(duration, dt):
    with pytest.raises(InputError, match=r"a duration of 1 to 100000 steps of dt, got duration .* s and dt .* milliseconds"):
        step_count(duration, dt)


def test_units_scale_the_system():
    primitive = make_primitive(np.random.default_rng(8))
    for unit in (1e-6, 1e6):
        scaled = replace(
            primitive,
            weight_means=primitive.weight_means * unit,
            weight_covariances=primitive.weight_covariances * unit**2,
            weight_precisions=primitive.weight_precisions / unit**2,
            forcing_precisions=primitive.forcing_precisions / unit**2,
            observation_variances=primitive.observation_variances * unit**2,
            start=primitive.start * unit,
            goal=primitive.goal * unit,
            goal_displacements=primitive.goal_displacements * unit,
            ranges=primitive.ranges * unit,
            start_velocities=primitive.start_velocities * unit,
            start_covariances=primitive.start_covariances * unit**2,
        )
        one, other = rolled(primitive, task_for(primitive), 0.01), rolled(scaled, task_for(scaled), 0.01)
        np.testing.assert_allclose(other.means, one.means * unit, rtol=1e-10, atol=1e-10 * unit)
        np.testing.assert_allclose(other.covariances, one.covariances * unit**2, rtol=1e-9, atol=1e-12 * unit**2)
