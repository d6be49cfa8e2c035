"""Weights that other libraries have learned move here as there."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from probdmp import ProbabilisticDMP, load, synthetic_letters
from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, task_for
from probdmp.errors import InputError, InputTypeError
from probdmp.execution import roll_out
from probdmp.learning import ForcingWeights, primitive_from_weights
from probdmp.learning.imported_weights import MOST_DEVIATION

DT = 0.001


@pytest.fixture(scope="module")
def letter():
    return synthetic_letters(1, letters="a", dt=0.01)[0]


def ours(n_basis=12, decay=4.605, overlap=0.2231):
    """Weights on basis functions that are placed as in movement_primitives."""
    centers = np.exp(-decay * np.linspace(0, 1, n_basis))
    widths = overlap / np.diff(centers) ** 2
    weights = np.random.default_rng(2).standard_normal((2, n_basis)) * 300
    return ForcingWeights(weights, centers, np.append(widths, widths[-1]), decay)


TASK = {"start": [1.0, 2.0], "goal": [3.0, -1.0], "duration": 2.0, "dt": 0.01}


def path_of(primitive: Primitive, dt: float, **task: object) -> FloatArray:
    return np.asarray(roll_out(primitive, task_for(primitive, **task), dt).positions)  # type: ignore[arg-type]


def later(forcing: ForcingWeights, step: float) -> ForcingWeights:
    """The same forcing term a time later, in units of the duration: exactly of the same form, at phases q times as large."""
    q = float(np.exp(-forcing.decay * step))
    return replace(forcing, weights=forcing.weights * q, centers=forcing.centers / q, widths=forcing.widths * q**2)


def largest(found: FloatArray, expected: FloatArray) -> float:
    """Difference as a fraction of the range of each degree of freedom."""
    return float(np.max(np.abs(found - expected) / np.ptp(expected, axis=0)))


# --- movement_primitives ----------------------------------------------------------------------------------------------


def learned_by_movement_primitives(letter, dt, **options):
    pytest.importorskip(
        "movement_primitives", reason="needs movement_primitives: pip install movement_primitives pytransform3d"
    )
    from movement_primitives.dmp import DMP

    dmp = DMP(2, execution_time=letter.duration, dt=dt, n_weights_per_dim=20, **options)
    dmp.imitate(letter.times, letter.positions)
    return dmp


def forcing_of(dmp, smooth_scaling=False):
    term = dmp.forcing_term
    extra = (dmp.alpha_y * dmp.beta_y * (dmp.goal_y - dmp.start_y))[:, None] if smooth_scaling else 0.0
    return ForcingWeights(term.weights_ - extra, term.centers, term.widths, term.alpha_z)


@pytest.mark.parametrize("smooth_scaling", [False, True])
@pytest.mark.parametrize("dt", [0.01, 0.001])
def test_a_movement_of_movement_primitives_is_the_same_here(letter, dt, smooth_scaling):
    """Its Runge-Kutta steps take the forcing term of the step that follows (0.9.1: `T = [t, t + dt / 2, t + dt]` for the step
    that ends at t), so its movement is that of the forcing term one step later."""
    dmp = learned_by_movement_primitives(letter, dt, smooth_scaling=smooth_scaling)
    expected = dmp.open_loop()[1]
    forcing = later(forcing_of(dmp, smooth_scaling), dt / letter.duration)
    primitive = primitive_from_weights(forcing, dmp.start_y, dmp.goal_y, letter.duration, dt)
    found = path_of(primitive, dt)
    n = min(len(found), len(expected))
    assert largest(found[:n], expected[:n]) < 1e-3


def test_what_differs_is_the_step_of_its_integration(letter):
    differences = []
    for dt in (0.004, 0.002, 0.001):
        dmp = learned_by_movement_primitives(letter, dt)
        primitive = primitive_from_weights(forcing_of(dmp), dmp.start_y, dmp.goal_y, letter.duration, dt)
        expected, found = dmp.open_loop()[1], path_of(primitive, dt)
        n = min(len(found), len(expected))
        differences.append(largest(found[:n], expected[:n]))
    ratios = np.array(differences[:-1]) / differences[1:]
    np.testing.assert_allclose(ratios, 2, atol=0.2)  # halved with the step: nothing else differs
    assert differences[-1] < 0.02


def test_another_goal_and_duration_do_the_same_to_both(letter):
    dmp = learned_by_movement_primitives(letter, DT)
    forcing = later(forcing_of(dmp), DT / (1.5 * letter.duration))
    primitive = primitive_from_weights(forcing, dmp.start_y, dmp.goal_y, letter.duration, DT)
    start, goal, duration = dmp.start_y + np.array([0.3, -0.2]), dmp.goal_y + np.array([1.0, 0.5]), 1.5 * letter.duration
    dmp.configure(start_y=start, goal_y=goal)
    dmp.execution_time_ = duration
    expected, found = dmp.open_loop()[1], path_of(primitive, DT, start=start, goal=goal, duration=duration)
    n = min(len(found), len(expected))
    assert largest(found[:n], expected[:n]) < 1e-3


# --- pydmps -----------------------------------------------------------------------------------------------------------


def learned_by_pydmps(letter, dt):
    pytest.importorskip("pydmps", reason="needs pydmps: pip install pydmps")
    from pydmps.dmp_discrete import DMPs_discrete

    dmp = DMPs_discrete(n_dmps=2, n_bfs=20, dt=dt)
    dmp.imitate_path(np.ascontiguousarray(letter.positions.T))
    return dmp


@pytest.mark.parametrize("tau", [1.0, 0.5])
def test_a_movement_of_pydmps_is_the_same_here(letter, tau):
    """It steps semi-implicitly, as the paper does, but its phase too, and takes the forcing term of the end of each step."""
    dmp = learned_by_pydmps(letter, dt := 0.002)
    start, goal = dmp.y0.copy(), dmp.goal.copy()
    decay = -np.log(1 - tau * dt * dmp.cs.ax) / (tau * dt)  # of (1 - tau dt)^k, which its phase is
    forcing = later(ForcingWeights(dmp.w, dmp.c, dmp.h, decay, is_scaled=True), tau * dt)
    primitive = primitive_from_weights(forcing, start, goal, 1.0, dt)
    primitive = replace(primitive, configuration=replace(primitive.configuration, discretization="semi_implicit_euler"))
    if tau == 1:
        dmp.goal = goal = start + 1.4 * (goal - start)  # the forcing term grows with it
    expected = np.concatenate([start[None], dmp.rollout(tau=tau)[0]])
    found = path_of(primitive, dt, goal=goal, duration=1 / tau)
    n = min(len(found), len(expected))
    assert n > 400
    assert largest(found[:n], expected[:n]) < 2e-3


def test_pydmps_comes_nearer_with_smaller_steps(letter):
    differences = []
    for dt in (0.002, 0.001, 0.0005):
        dmp = learned_by_pydmps(letter, 0.001)
        fine = learned_by_pydmps(letter, dt)
        fine.w = dmp.w
        primitive = primitive_from_weights(ForcingWeights(dmp.w, dmp.c, dmp.h, dmp.cs.ax, True), dmp.y0, dmp.goal, 1.0, dt)
        expected, found = np.concatenate([dmp.y0[None], fine.rollout()[0]]), path_of(primitive, dt)
        n = min(len(found), len(expected))
        differences.append(largest(found[:n], expected[:n]))
    assert differences[0] > 1.5 * differences[1] > 2.25 * differences[2]
    assert differences[-1] < 0.01


def test_the_page_that_tells_how_to_migrate_runs():
    """All its code, in its order; tests/test_docs.py runs only what needs no other library."""
    for name in ("movement_primitives", "pydmps"):
        pytest.importorskip(name, reason=f"needs {name}, of the benchmarks' environment")
    page = (Path(__file__).parents[2] / "docs/how-to/migrate.md").read_text()
    namespace: dict[str, object] = {}
    for block in re.findall(r"^```py(?:thon)?\n(.*?)^```$", page, flags=re.M | re.S):
        exec(compile(block, "migrate.md", "exec"), namespace)
    assert isinstance(namespace["p"], ProbabilisticDMP)


# --- by itself --------------------------------------------------------------------------------------------------------


def test_our_own_weights_come_back():
    """On the same basis functions the forcing term is fitted exactly."""
    learned = ProbabilisticDMP(15, weight_model="pooled").fit(synthetic_letters(2, letters="s", dt=0.02)).primitive_
    from probdmp.dmp.basis import basis_centers, basis_widths

    centers = basis_centers(15)
    forcing = ForcingWeights(learned.weight_means, centers, basis_widths(centers), np.log(100))
    given = (learned.start, learned.goal, learned.duration, learned.dt)
    found = primitive_from_weights(forcing, *given, n_basis=15)
    np.testing.assert_allclose(found.weight_means, learned.weight_means, rtol=1e-6)


def test_what_is_imported_has_no_spread_but_that_of_its_sensors(tmp_path):
    p = ProbabilisticDMP.of_weights(ours(), **TASK)
    planned = p.rollout()
    assert planned.position_stds.max() < 1e-9
    assert p.get_params()["weight_model"] == "pooled"
    np.testing.assert_allclose(planned.positions[0], TASK["start"])
    moved = p.rollout(goal=[4.0, -1.0])
    assert moved.positions[-1, 0] > planned.positions[-1, 0] + 0.9
    assert p.score_samples([planned.positions]).shape == (1,)
    p.save(tmp_path / "imported.probdmp")
    np.testing.assert_array_equal(load(tmp_path / "imported.probdmp").rollout().positions, planned.positions)


@pytest.mark.parametrize("decay", [1.0, 4.6, 8.0])
@pytest.mark.parametrize("n_basis", [2, 8, 40])
def test_the_movement_is_within_the_tolerance_or_refused(n_basis, decay):
    from scipy.integrate import solve_ivp

    forcing = ours(n_basis, decay)

    def rates(t, state):
        position, velocity = state[:2], state[2:]
        force = 25.0 * (6.25 * (np.array(TASK["goal"]) - position) - velocity) + forcing.values(np.array([t]))[0]
        return np.concatenate([velocity, force])

    try:
        primitive = primitive_from_weights(forcing, **TASK)
    except InputError as error:
        assert "basis functions" in str(error)  # noqa: PT017
        return
    grid = np.linspace(0, 1, 201)
    expected = solve_ivp(rates, (0, 1), [*TASK["start"], 0, 0], t_eval=grid, rtol=1e-9, atol=1e-9, max_step=0.005).y[:2].T
    assert largest(path_of(primitive, 0.01), expected) < 2 * MOST_DEVIATION


def test_too_few_basis_functions_are_refused():
    with pytest.raises(InputError, match=r"weights that 5 basis functions can follow .* Give it more basis functions"):
        primitive_from_weights(ours(30), **TASK, n_basis=5)


def test_weights_that_do_not_fit_are_refused():
    good = ours()
    with pytest.raises(InputError, match="centers of shape"):
        replace(good, centers=good.centers[:-1])
    with pytest.raises(InputError, match="widths > 0"):
        replace(good, widths=-good.widths)
    with pytest.raises(InputError, match="weights finite"):
        replace(good, weights=good.weights * np.nan)
    with pytest.raises(InputError, match="weights of shape"):
        replace(good, weights=good.weights[0])
    with pytest.raises((InputError, InputTypeError), match="decay"):
        replace(good, decay=0)
    with pytest.raises(InputError, match="start of shape"):
        primitive_from_weights(good, **TASK | {"start": [1.0]})
    still = ForcingWeights(np.zeros((1, 3)), np.array([1.0, 0.5, 0.1]), np.ones(3), 4.6)
    with pytest.raises(InputError, match="weights that move every degree of freedom"):
        primitive_from_weights(still, [0.0], [0.0], 1.0, 0.01)
    with pytest.raises(InputError, match=r"a goal at least 0\.2 of the range from the start"):
        primitive_from_weights(replace(good, weights=good.weights * 1e3, is_scaled=True), [0.0, 0.0], [0.1, 0.1], 1.0, 0.01)


# --- verbs ------------------------------------------------------------------------------------------------------------


def test_imitate_and_open_loop_are_fit_and_rollout(letter):
    by_verb = ProbabilisticDMP(10).imitate(letter.times, letter.positions)
    by_fit = ProbabilisticDMP(10).fit([letter.positions], dt=letter.dt)
    np.testing.assert_allclose(by_verb.rollout().positions, by_fit.rollout().positions, atol=1e-8)
    times, positions = by_verb.open_loop(duration=2.0)
    planned = by_verb.rollout(duration=2.0)
    np.testing.assert_array_equal(times, planned.times)
    np.testing.assert_array_equal(positions, planned.positions)
