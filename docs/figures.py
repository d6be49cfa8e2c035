"""Draws every picture of the documentation: `make figures`."""

from pathlib import Path

from probdmp import synthetic_letters
from probdmp.evaluation import Experiment, illustrate
from probdmp.plotting.failure_detection import draw_failure_detection
from probdmp.plotting.style import figure_style

IMAGES = Path(__file__).parent / "images"


def main() -> None:
    experiment = Experiment()
    letters = synthetic_letters(experiment.train + experiment.test, letters="a")
    with figure_style():
        figure = draw_failure_detection(illustrate(letters, experiment))
        figure.savefig(IMAGES / "failure_detection.png", dpi=150)


if __name__ == "__main__":
    main()
