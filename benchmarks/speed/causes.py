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
        "990 unknowns are conditioned on 30 readings at each tick: half a million numbers of their covariance change by 30 "
        "products each, 15 million in all, and are read from and written to 8 MB"
    ),
    "online step, 30 degrees of freedom, `independent`": ("as with 7 degrees of freedom, most of it is Python"),
    "rollout": (
        "most of it is not the recursion but the model, its checks, and the covariances of all states, which "
        "the others do not give"
    ),
    "fit, one demonstration": (
        "more is learned: a prior, the noise of sensors and of the forcing term by their likelihood, and how "
        "certain all of it is; movement_primitives solves for the weights"
    ),
    "`from probdmp import": (
        "some two hundred modules of the library are loaded "
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
