"""A movement that remembers how it should feel: the force of a wipe, learned with its path.

The positions of an execution say which force to expect. Faults that no position shows, contact lost or too firm, are given away
by the force: learned with `channels=["force"]`, it is watched with the positions, and named.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from probdmp import Demonstration, FailureDetector, ProbabilisticDMP
from probdmp.demonstrations import fault_generator, fault_named, perturb_executions, synthetic_contacts
from probdmp.plotting.style import ALARM, FAULTY, MEAN, RECORDED, band, figure_style, mark_onset

TAUGHT, NEW = 20, 12


def main(figure_path: Path) -> None:
    contacts = synthetic_contacts(TAUGHT + NEW)
    demos, new = [c.demonstration for c in contacts[:TAUGHT]], contacts[TAUGHT:]
    dmp = ProbabilisticDMP(channels=["force"]).fit(demos)

    off = {"by the phase alone": [], "given the positions": []}
    for contact in new:
        d = contact.demonstration
        told = {"start": d.positions[0], "goal": d.positions[-1], "duration": d.duration, "dt": d.dt}
        unfelt = Demonstration(d.positions, d.dt, names=d.names, units=d.units)
        for name, guess in zip(off, (dmp.rollout(**told), dmp.smooth(unfelt, goal=told["goal"])), strict=True):
            off[name].append(np.mean((guess.channels["force"].means - contact.force) ** 2))
    for name, squares in off.items():
        print(f"force expected {name}: {np.mean(squares) ** 0.5:.2f} N off, of {NEW} executions")

    detector = FailureDetector(false_alarm_rate=0.1).fit(dmp, demos)
    blind = FailureDetector(false_alarm_rate=0.1).fit(ProbabilisticDMP().fit(demos), demos)  # the same without the force
    executions = [contact.demonstration for contact in new]
    for fault in map(fault_named, ("lift", "press:0.25")):
        faulty, onsets = perturb_executions(fault, executions, [], fault_generator(0, "wipe", fault))
        felt, unseen = (sum(v.failed for v in d.verdicts(faulty)) for d in (detector, blind))
        print(f"{fault.name}: {felt} of {NEW} called failed, {unseen} by positions alone")
    print(f"undisturbed: {sum(v.failed for v in detector.verdicts(executions))} of {NEW} called failed")
    verdict = detector.verdicts(faulty)[0]
    print(verdict)

    with figure_style():
        figure, (feel, given, alarm) = plt.subplots(1, 3, figsize=(11, 3), layout="constrained")
        plan = dmp.rollout()
        band(feel, plan.times, plan.channels["force"].means, plan.channels["force"].stds)
        for d in demos[:6]:
            feel.plot(d.times, d.channels["force"], color=RECORDED, linewidth=0.8)
        feel.set(xlabel="Time [s]", ylabel="Force [N]", title="Learned with the movement")
        band(given, guess.times, guess.channels["force"].means, guess.channels["force"].stds)
        given.plot(guess.times, contact.force, color=RECORDED, linestyle="--", label="truth")
        given.plot([], [], color=MEAN, label="expected")
        given.set(xlabel="Time [s]", ylabel="Force [N]", title="Given the positions, not the force")
        given.legend(loc="lower center")
        first = faulty[0]
        alarm.plot(first.times, executions[0].channels["force"], color=RECORDED, label="as recorded")
        alarm.plot(first.times, first.channels["force"], color=FAULTY, linestyle="--", label="pressed too firmly")
        alarm.axvline(verdict.time, color=ALARM, linestyle=":", label=f"alarm: {verdict.cause}")
        mark_onset(alarm, onsets[0] * first.dt)
        alarm.set(xlabel="Time [s]", ylabel="Force [N]", title="Invisible in the positions", ylim=(-1, 24))
        alarm.legend(loc="upper left")
        figure.savefig(figure_path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
