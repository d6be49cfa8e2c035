"""What is done about letters that are too many to be calibrated together."""

import asyncio

from probdmp.demonstrations import synthetic_letters
from probdmp.studio.learner import Learner
from probdmp.studio.session import Session
from probdmp.studio.views import calibration_view
from probdmp.studio.workers import TooLongError


class AtMostTwo:
    """Works at once; with more than two letters at a time it takes too long."""

    def __init__(self):
        self.calibrated = []

    async def run(self, work, *arguments):
        return work(*arguments)

    async def run_long(self, work, library, *arguments):
        self.calibrated.append(sorted(library))
        if len(library) > 2:
            raise TooLongError("work of at most 10 s", "more than 10 s")
        return work(library, *arguments)


def test_too_many_letters_are_calibrated_each_by_itself_and_only_those_that_change():
    letters = {label: synthetic_letters(3, letters=label, dt=0.02) for label in "ace"}
    session, workers = Session("x"), AtMostTwo()

    async def nothing(label):
        pass

    async def teach():
        learner = Learner(session, workers, nothing)
        for label in "ac":
            session.add_strokes(label, letters[label][:2])
        learner.learn("a", "c")
        await learner.settled()
        assert workers.calibrated == [["c"], ["a", "c"]]  # the selected one is soon done
        assert calibration_view(session)["note"] == ""
        session.add_strokes("e", letters["e"][:2])
        learner.learn("e")
        await learner.settled()
        assert workers.calibrated[2:] == [["e"], ["a", "c", "e"], ["a"], ["c"]]
        session.add_strokes("a", letters["a"][2:])
        learner.learn("a")
        await learner.settled()
        assert workers.calibrated[6:] == [["a"]]
        for label, movement in session.movements.items():
            (primitive,) = session.detectors[label].primitives_.values()
            assert primitive.identity == movement.learned.primitive_.identity
        assert "each letter is watched by itself" in calibration_view(session)["note"]
        session.delete("e")
        learner.calibrate()
        await learner.settled()
        assert workers.calibrated[-1] == ["a", "c"]
        assert calibration_view(session)["note"] == ""

    asyncio.run(teach())
