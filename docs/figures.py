"""Draws every picture of the documentation: `make figures`."""

from pathlib import Path

from probdmp import synthetic_letters
from probdmp.evaluation import Experiment, illustrate
from probdmp.plotting.failure_detection import failure_detection_panels
from probdmp.plotting.panels import save_panels

IMAGES = Path(__file__).parent / "images"


def main() -> None:
    experiment = Experiment()
    letters = synthetic_letters(experiment.train + experiment.test, letters="a")
    save_panels(IMAGES / "failure_detection.png", failure_detection_panels(illustrate(letters, experiment)), 3)


if __name__ == "__main__":
    main()
