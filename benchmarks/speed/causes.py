"""Why targets are missed."""

__all__ = ["CAUSES"]

CAUSES = {
    "batch score against": (
        "not profiled; probably, recordings come from memory here, since others have taken their turn in between; "
        "bringing eight of "
        "them side by side then costs more than filtering them"
    ),
    "NumPy twin against dynamax": ("each step is ten passes over arrays of 2,048 recordings, every one of them a call"),
    "one series": ("not profiled in this run; probably, much of the call is Python: shapes, and the array of the result"),
    "smoother against dynamax": ("three states of each sample are written, to memory that is new at every call"),
    "batch from memory": ("recordings are brought side by side before they are filtered"),
    "two threads": ("not profiled; both cores read from one memory"),
    "online step, 7 degrees": (
        "the target is that of a kernel with everything in place; here it is the public `step()`, most of "
        "which is Python: the reading, the record, the result"
    ),
    "online step, 30 degrees of freedom, `joint`": (
        "989 unknowns are conditioned on 30 readings at each tick; the gains of a movement of so many ticks "
        "are more than are prepared (`LARGEST_SCHEDULE` in execution/joint_steps.py)"
    ),
    "online step, 30 degrees of freedom, `independent`": ("as with 7 degrees of freedom, most of it is Python"),
    "rollout 200 × 7, `independent`": (
        "most of it is not the recursion but the model, its checks, and the covariances of all states, which "
        "the others do not give"
    ),
    "rollout 200 × 7, `joint`": (
        "by profile, a third of it is the checks of what was asked; the path is one product of matrices, and covariances are "
        "kept from the first rollout of that duration"
    ),
    "fit, one demonstration": (
        "more is learned: a prior, the noise of sensors and of the forcing term by their likelihood, and how "
        "certain all of it is; movement_primitives solves for the weights. By profile, most of it with independent and joint "
        "weights are ten E steps, each of which solves for 224 unknowns of 7 degrees of freedom that vary together"
    ),
    "`from probdmp import": (
        "some fifty modules are loaded, and a third of the time makes their frozen dataclasses "
        "(`python -X importtime -c 'from probdmp import ProbabilisticDMP'`); where "
        "bytecode is not kept (PYTHONDONTWRITEBYTECODE) they are compiled at every start, too"
    ),
    "fleet": (
        "of one thread (`python benchmarks/fleet_scoring.py 60000 --profile`, on the machine above) 35 % are the windows of "
        "the trajectory, 16 % the log-likelihood, 15 % the reasons of the 3 % that failed, 11 % reading, the rest is in small "
        "parts; "
        "two threads take more of the processors' time than one"
    ),
}
"""In words, by how the name of a row begins."""
