"""Why targets are missed."""

__all__ = ["CAUSES"]

CAUSES = {
    "batch score against": (
        "of 100 series, leaving out one or the other, the recursion takes 0.52 ns, which is all the multiplications that the "
        "processor can do (20 vector operations for 8 series, two in a cycle), and bringing eight series side by side 0.39 ns; "
        "of 10,000, recordings come from memory while those before them are filtered"
    ),
    "NumPy twin against dynamax": (
        "32 steps are one product of matrices, which takes 2.9 ns for 72 operations a step where the recursion has 20; to take "
        "readings less their path out of their rows takes 1.6 ns, to square and add 0.4 ns, and the rest is memory"
    ),
    "one series": (
        "of 5.3 µs, 2.1 µs are the kernel, of which 0.85 µs are its seven arrays (the same call of no series); the rest is "
        "Python: checks, shapes, and the array of the result"
    ),
    "smoother against dynamax": (
        "three states of each sample are written, to memory that is new at every call: "
        "`numpy.empty((10_000, 200, 1, 3)).fill(1.0)` alone takes 5.4 ns per series and step, the smoother 7.6 ns, and 5.5 ns "
        "into memory that is there already"
    ),
    "batch from memory": ("recordings are brought side by side before they are filtered"),
    "two threads": (
        "one thread takes 1.3 times as long as merely reading the recordings, and both cores read from one memory: see the two "
        "rows above"
    ),
    "online step, 7 degrees": (
        "the target is that of a kernel with everything in place; here it is the public `step()`, half of which is "
        "Python around the filter: the call, the tick, the result"
    ),
    "online step, 30 degrees of freedom, `joint`": (
        "990 unknowns are conditioned on 30 readings at each tick: half a million numbers of their covariance change by 30 "
        "products each, 15 million in all, and are read from and written to 8 MB"
    ),
    "online step, 30 degrees of freedom, `independent`": (
        "not profiled; it is near: in two other runs the median was 3.8 and 5.0 µs"
    ),
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
        "of one thread (`python benchmarks/fleet_scoring.py 60000 --profile`, on the machine above) 44 % are the windows of "
        "the trajectory, 21 % reading, 8 % the log-likelihood, 6 % when it was most surprising, 6 % the reasons of the 3 % "
        "that failed, the rest is in small parts; and the cores of this virtual machine differ by a factor of two from hour "
        "to hour, see how fast they were"
    ),
}
"""In words, by how the name of a row begins."""
