"""Learning and calibration, through the public interface."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

from probdmp import Demonstration, FailureDetector, PrimitiveLibrary, ProbabilisticDMP, read_demonstrations, synthetic_letters
from probdmp.demonstrations import LETTERS
from speed.agreement import imported
from speed.interleaving import Clocked, clocked, interleaved
from speed.rows import Row, Settings, at_least, at_most, duration_text, raced
from speed.workload import SIMPLE, learned

__all__ = ["calibration_rows", "learning_rows"]

N_BASIS = 30
PEER = "movement_primitives"
N_LETTERS = 20
N_EACH = 10


def learning_rows(settings: Settings) -> Iterator[Row]:
    """From one demonstration and from ten."""
    _, demonstrations = learned("arm")
    one, dt = demonstrations[0], demonstrations[0].dt
    peer = imported(PEER)
    contestants: dict[str, Clocked | None] = {
        "default": clocked(lambda: ProbabilisticDMP().fit([one])),
        "simple": clocked(lambda: ProbabilisticDMP(**SIMPLE).fit([one])),  # type: ignore[arg-type]
        "published": clocked(lambda: ProbabilisticDMP.as_published(N_BASIS).fit([one])),
        PEER: None if peer is None else clocked(peer.fit_call(one.positions, dt, N_BASIS)),
    }
    times = raced(contestants, max(3, settings.rounds // 2))
    for name, whose in (
        ("published", "`as_published()`"),
        ("simple", "`independent` weights"),
        ("default", "`joint` weights (the default)"),
    ):
        yield at_least(f"fit, one demonstration 200 × 7, {whose}, against {PEER}", times, PEER, name, 4)
    several = interleaved({"fit": clocked(lambda: ProbabilisticDMP().fit(demonstrations))}, max(3, settings.rounds // 3))
    took = several.typical("fit")
    yield at_most("fit, hierarchical with EM, 10 demonstrations 200 × 7", took, 0.5, duration_text(took), "0.5 s")


def calibration_rows(settings: Settings) -> Iterator[Row]:
    """Leave one out, 20 letters with 10 demonstrations each; once, since it takes long."""
    letters, source = _letters()
    library = PrimitiveLibrary.fit(letters)
    began = time.perf_counter()
    FailureDetector().fit(library, letters)
    took = time.perf_counter() - began
    title = f"calibration, leave one out, {len(letters)} letters × {N_EACH} demonstrations"
    yield at_most(title, took, 20, duration_text(took), "20 s", f"once; {source}")


def _letters() -> tuple[dict[str, list[Demonstration]], str]:
    """Recordings if PROBDMP_RECORDINGS says where they are, else the built-in letters."""
    file = Path(os.environ.get("PROBDMP_RECORDINGS", "")) / "uci_letters" / "letters.npz"
    if os.environ.get("PROBDMP_RECORDINGS") and file.exists():
        everything, source = read_demonstrations(file), "recorded letters of UCI"
    else:
        everything, source = synthetic_letters(N_EACH, letters=LETTERS[:N_LETTERS]), "built-in letters"
    by_label: dict[str, list[Demonstration]] = {}
    for demonstration in everything:
        by_label.setdefault(str(demonstration.label), []).append(demonstration)
    chosen = sorted(by_label)[:N_LETTERS]
    return {label: by_label[label][:N_EACH] for label in chosen}, source
