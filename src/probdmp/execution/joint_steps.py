"""Executions with parameters that stay, tick by tick: what is known of the parameters is conditioned on each observation."""

import numpy as np

from probdmp.checks import FloatArray
from probdmp.dmp import Primitive, Task, stack_tasks
from probdmp.dmp.joint_model import JointExecutions, JointModel, joint_executions, state_rows
from probdmp.dmp.responses import continue_responses
from probdmp.execution.sensed_ticks import Tick
from probdmp.execution.sensor_array import SensorArray
from probdmp.gaussian import (
    AugmentedTick,
    Belief,
    Look,
    Moves,
    augmented_tick,
    block_diagonal,
    no_observations,
    states_now,
)

__all__ = ["LATER_CHUNK", "JointFilter", "JointSystem"]

LATER_CHUNK = 64
"""Ticks that are prepared at a time once the movement is over."""
LONGEST_CHUNK = 4096
"""Ticks that are prepared before the movement begins, at most."""


class JointSystem:
    """The first of a batch of executions as groups of states that an array of sensors looks at, one signal or all in each."""

    def __init__(self, executions: JointExecutions, array: SensorArray) -> None:
        (means, factors, belief), rows, system = executions
        self.model = JointModel(means[0], factors[0], Belief(belief.mean[0], belief.covariance[0]))
        self.rows = rows[:, 0]
        """(T, 3, N + 3) array, see `probdmp.dmp.joint_model.state_rows`."""
        self.blocks = self.model.blocks
        """F of each signal, (S, N + 3, W) array."""
        self.moves = Moves(*(np.ascontiguousarray(part[0]) for part in system.grouped(array.is_coupled)))
        if not array.is_coupled:
            transition = np.broadcast_to(self.moves.transition, self.moves.driven.shape)
            self.moves = self.moves._replace(transition=np.ascontiguousarray(transition))
        self._is_coupled = array.is_coupled

    def look(self, row: FloatArray) -> Look:
        """The states of one time, given its row (3, N + 3)."""
        path, designs = self.model.means @ row.T, row @ self.blocks
        return Look(path.reshape(1, -1), block_diagonal(designs)[None]) if self._is_coupled else Look(path, designs)


class JointFilter:
    """Conditioning of parameters that stay and of what deviates from them.

    Parameters
    ----------
    chunk : for how many ticks it is prepared; the movement need not end then.
    """

    def __init__(self, primitive: Primitive, task: Task, dt: float, chunk: int, array: SensorArray) -> None:
        self._configuration, self._array = primitive.configuration, array
        self._duration, self._phase_step = task.duration, float(dt / task.duration)
        executions = joint_executions(primitive, stack_tasks([task]), np.array([dt]), min(chunk, LONGEST_CHUNK) + 1)
        self._system = JointSystem(executions, array)
        self._rows, self._first, self._tick = self._system.rows, 0, 0
        self._now = self._system.look(self._rows[0])
        self._state = no_observations(self._system.model.belief, self._now)

    def step(self, observation: FloatArray) -> Tick:
        """Condition on what was measured; the parameters stay, what deviates from them goes on."""
        array, ahead = self._array, self._look_ahead()
        observed = array.look(observation, lambda: states_now(self._state, self._now))
        self._state, seen = augmented_tick(self._state, self._now, ahead, self._system.moves, observed)
        self._now, self._tick = ahead, self._tick + 1
        return _tick(seen, array)

    def _look_ahead(self) -> Look:
        """At the next tick; rows are there for some of them at a time."""
        if self._tick + 1 - self._first == len(self._rows):
            # Responses are in phase units, rows in seconds; both go on from the last.
            scale = self._duration ** np.array([2.0, 1.0, 0.0])
            last = self._rows[-1, :, 1:] * scale[:, None]
            later = continue_responses(self._configuration, self._phase_step, LATER_CHUNK, self._tick, last)
            self._rows, self._first = state_rows(later, self._duration), self._tick + 1
        return self._system.look(self._rows[self._tick + 1 - self._first])


def _tick(seen: AugmentedTick, array: SensorArray) -> Tick:
    return Tick(
        seen.n_fused,
        seen.states.reshape(-1, 3),
        seen.state_covariances,
        array.flat(seen.log_likelihoods),
        array.flat(seen.innovations),
        array.flat_covariances(seen.innovation_covariance),
        array.flat(seen.fused) != 0,
    )
