"""What stands about every page of a study, whatever it found: next steps, command, versions, words, sources."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from layoutopt import registry
from layoutopt.citation import Work, works_named
from layoutopt.journal import FROZEN_SPEC
from layoutopt.machine import versions_text
from layoutopt.protocols import StudyCard
from studies.cited import Cited, methods_told
from studies.page_words import words_in

NOT_FOUND: Final = (
    "What was asked for was not found: relax a demand, allow more money or widen [space] in the spec, or run more "
    "drives, and run this again."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """The parts of a page that are the same for all studies.

    Attributes
    ----------
    card
        Question, what answers rest on, and what to do next.
    command
        What makes the page again, in the folder of the study.
    versions
        Of layoutopt, Python and the packages that numbers depend on.
    words
        Terms that the page uses, with what they mean.
    methods
        The study, its solvers and the estimators that the page names, with their sources.
    works
        What these sources and the page cite.
    """

    card: StudyCard
    command: str
    versions: str
    words: Mapping[str, str]
    methods: tuple[Cited, ...]
    works: tuple[Work, ...]


def frame_of(study: str, text: str, *, quick: bool) -> Frame:
    """Return the frame of a page with these words; ``study`` is the name of its study.

    Raises
    ------
    UnknownName
        If there is no such study.
    """
    methods = methods_told(study, text)
    return Frame(
        card=card_of(study),
        command=f"layoutopt study {study} {FROZEN_SPEC}{' --quick' if quick else ''} --out again",
        versions=versions_text(),
        words=words_in(text),
        methods=methods,
        works=works_named((*(item.reference for item in methods), text)),
    )


def card_of(study: str) -> StudyCard:
    """Return the card of a study.

    Raises
    ------
    UnknownName
        If there is no such study.
    """
    card = registry.card("studies", study)
    assert isinstance(card, StudyCard)
    return card


def closing_lines(study: str, *, found: bool = True) -> list[str]:
    """Return what the command line says below an answer: how sure it is, and what to do next.

    ``found`` tells whether what was asked for was found.
    """
    card = card_of(study)
    return [f"How sure: {card.rests_on}", f"Next: {card.next_step if found else NOT_FOUND}"]
