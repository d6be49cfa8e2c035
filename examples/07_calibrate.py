"""Choose a rate of false alarms, and see what the calibration can vouch for and what comes about.

Four letters, ten demonstrations each: n = 40 calibration executions vouch for no rate below 1 / 41. The rate is kept on
average over the library and over calibrations; the shaded limits say what chance makes of it in a single one. Below the
attainable rate the threshold comes from a fitted tail, which nothing vouches for.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import betabinom

from probdmp import FailureDetector, PrimitiveLibrary, Task, synthetic_letters
from probdmp.plotting.style import RECORDED, figure_style

RATES = (0.01, 0.02, 0.05, 0.1)
LETTERS = "acdn"


def main(figure_path: Path) -> None:
    demonstrations = {label: synthetic_letters(35, letters=label) for label in LETTERS}
    taught = {label: members[:10] for label, members in demonstrations.items()}
    executions = [execution for members in demonstrations.values() for execution in members[10:]]
    # Each execution is told its goal and duration, so it is held to them.
    tasks = [Task(d.positions[0], d.positions[-1], d.duration) for d in executions]
    library = PrimitiveLibrary.fit(taught)

    detector = FailureDetector(false_alarm_rate=RATES[0]).fit(library, taught)
    facts = next(facts for facts in detector.calibrations_ if facts.task == "known")
    print(f"n = {facts.n}: attainable from {facts.attainable_rate:.3f} up; at {RATES[0]}: {facts.guarantee}")
    ratios = np.array([verdict.test_ratio for verdict in detector.verdicts(executions, tasks=tasks)])
    # One calibration knows the thresholds of other rates too, relative to the one in force, at test ratio 1.
    levels = {rate: np.array([facts.relative_level(rate, d.label) for d in executions]) for rate in RATES}
    realized = [float(np.mean(ratios > np.minimum(level, 1))) for level in levels.values()]
    for rate, share in zip(RATES, realized, strict=True):
        print(f"alpha {rate:.2f}: {share * len(executions):.0f} of {len(executions)} executions called failed")

    # How many of N new executions exceed the k-th largest of n exchangeable ones (beta-binomial).
    n, many = facts.n, len(executions)
    fine = np.linspace(facts.attainable_rate, RATES[-1], 60)
    exceed = [max(round(rate * (n + 1)), 1) for rate in fine]
    low, high = (100 / many * betabinom.ppf(q, many, exceed, [n + 1 - k for k in exceed]) for q in (0.025, 0.975))
    with figure_style():
        figure, ax = plt.subplots(figsize=(8, 3.4), layout="constrained")
        ax.fill_between(100 * fine, low, high, color="0.88", linewidth=0, label="limits of chance, one calibration")
        ax.plot([0, 100 * RATES[-1]], [0, 100 * RATES[-1]], color="0.5", linestyle=":", label="as asked for")
        ax.axvline(100 * facts.attainable_rate, color="0.6", linewidth=1, label="attainable")
        ax.plot(100 * np.array(RATES), 100 * np.array(realized), "o", color=RECORDED, label="came about")
        ax.set(xlabel="α, asked for [% of executions]", ylabel="False alarms [%]", title=f"{n} calibration executions")
        ax.legend(loc="upper left", bbox_to_anchor=(1, 1))
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
