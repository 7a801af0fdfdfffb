"""The numbers that Python and GLSL share, and the sentences."""

import re

from addon.core.compose import read
from addon.core.status import ADVICE, FAILURES, MEANINGS, Status, advice


def test_numbers_are_those_of_the_shaders():
    in_glsl = {
        name: float(value) for name, value in re.findall(r"const float (\w+) = ([\d.]+);", read("common/status"))
    }
    assert in_glsl == {status.name: float(status) for status in Status}


def test_every_status_has_its_words():
    assert set(MEANINGS) == set(Status)
    assert set(ADVICE) == set(FAILURES)
    assert all(text.endswith(".") for text in ADVICE.values())


def test_advice_counts_names_and_ends_with_what_to_do():
    counts = {Status.HIT: 2073288, Status.STEP_LIMIT: 312}
    (sentence,) = advice(counts, limit=256)
    assert sentence.startswith("312 of 2073600 rays reached the step limit (256). ")
    assert sentence.endswith(ADVICE[Status.STEP_LIMIT])


def test_the_limit_belongs_to_its_sentence_only():
    sentences = advice({Status.NOT_FINITE: 1, Status.STEP_TOO_SMALL: 2, Status.STEP_LIMIT: 3}, limit=9)
    assert len(sentences) == 3
    assert sum("(9)" in sentence for sentence in sentences) == 1


def test_no_failure_no_advice():
    assert advice({Status.HIT: 5, Status.ESCAPED: 5, Status.ABSORBED: 1}) == []
    assert advice({}) == []
