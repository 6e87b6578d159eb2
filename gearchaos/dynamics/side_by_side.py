"""Searches that advance side by side: all their requests are answered at the same time.

A search is a generator. It yields a list of requests, is sent the list of their answers, and
returns what it found. A search may consist of others, one after the other (``yield from``) or
`together`.
"""

from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeAlias, TypeVar

from gearchaos.interrupts import check

Asked = TypeVar("Asked")
Answered = TypeVar("Answered")
Found = TypeVar("Found")

Search: TypeAlias = Generator[Sequence[Asked], Sequence[Answered], Found]


def together(
    searches: Sequence[Search[Asked, Answered, Found]],
) -> Search[Asked, Answered, list[Found]]:
    """Advance searches side by side, as one search; return what each of them finds."""
    found: dict[int, Found] = {}
    answers: dict[int, Any] = dict.fromkeys(range(len(searches)))
    while True:
        asked: dict[int, Sequence[Asked]] = {}
        for number, answer in answers.items():
            try:
                asked[number] = searches[number].send(answer)
            except StopIteration as ended:
                found[number] = ended.value
        if not asked:
            break
        answered = yield [request for some in asked.values() for request in some]
        left = iter(answered)
        answers = {number: [next(left) for _ in some] for number, some in asked.items()}
    return [found[number] for number in range(len(searches))]


def counting(
    answers_to: Callable[[Sequence[Asked]], Sequence[Answered]], count: Callable[[int], object]
) -> Callable[[Sequence[Asked]], Sequence[Answered]]:
    """Return a function that answers requests and counts them."""

    def counted(requests: Sequence[Asked]) -> Sequence[Answered]:
        answers = answers_to(requests)
        count(len(requests))
        return answers

    return counted


def run(
    search: Search[Asked, Answered, Found],
    answers_to: Callable[[Sequence[Asked]], Sequence[Answered]],
) -> Found:
    """Run a search to its end; ``answers_to`` returns the answers to some requests."""
    answers: Any = None
    while True:
        try:
            requests = search.send(answers)
        except StopIteration as ended:
            found: Found = ended.value
            return found
        check()
        answers = answers_to(requests) if requests else []
