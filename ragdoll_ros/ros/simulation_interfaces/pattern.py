"""POSIX extended regular expressions, matched in bounded time.

Python's module re tries alternatives one after the other, for which a short expression can take
years. Here each part of an expression maps the set of places in the text where it may begin to the
set of those where it may end. Collating symbols, equivalence classes and back-references are not
supported. https://pubs.opengroup.org/onlinepubs/9799919799/basedefs/V1_chap09.html#tag_09_04
"""
from __future__ import annotations

import string
from collections.abc import Callable

from .codes import Code, Refusal

MAX_LENGTH = 200
"""Characters of an expression."""

MAX_DEPTH = 40
"""Brackets within each other."""

MAX_REPEATS = 255
"""RE_DUP_MAX of POSIX: largest number in braces."""

MAX_WORK = 1_000_000
"""Characters that the matches of one expression may look at."""

CLASSES = {
    'alpha': str.isalpha, 'digit': str.isdecimal, 'alnum': str.isalnum, 'upper': str.isupper,
    'lower': str.islower, 'space': str.isspace, 'blank': ' \t'.__contains__,
    'punct': string.punctuation.__contains__, 'print': str.isprintable,
    'graph': lambda char: char.isprintable() and char != ' ',
    'cntrl': lambda char: not char.isprintable(),
    'xdigit': string.hexdigits.__contains__}

Places = frozenset[int]
Part = Callable[['Text', Places], Places]


class Text:
    """A text that is matched; ``spend(count)`` counts the work."""

    def __init__(self, text: str, spend: Callable[[int], None]) -> None:
        self.text, self.spend = text, spend

    def after(self, accepts: Callable[[str], bool], places: Places) -> Places:
        """Places after one accepted character."""
        self.spend(len(places))
        return frozenset(place + 1 for place in places
                         if place < len(self.text) and accepts(self.text[place]))


class Pattern:
    """An expression. Raises Refusal if it is not valid."""

    def __init__(self, expression: str) -> None:
        if len(expression) > MAX_LENGTH:
            raise Refusal(Code.OPERATION_FAILED, f'filter: {len(expression)} characters; '
                          f'expected at most {MAX_LENGTH}')
        self._part, self._left = _Parser(expression).parse(), MAX_WORK

    def is_in(self, text: str) -> bool:
        """Whether some part of the text matches, as with grep -E. Raises Refusal if all matches
        with this pattern so far have taken more than MAX_WORK.
        """
        return bool(self._part(Text(text, self._spend), frozenset(range(len(text) + 1))))

    def _spend(self, count: int) -> None:
        self._left -= count
        if self._left < 0:
            raise Refusal(Code.OPERATION_FAILED, 'filter: the expression takes too long')


class _Parser:
    """Recursive descent: alternatives of sequences of repeated atoms."""

    def __init__(self, expression: str) -> None:
        self._rest, self._depth = expression, 0

    def parse(self) -> Part:
        part = self._alternatives()
        if self._rest:
            raise self._wrong('no ) without (')
        return part

    def _alternatives(self) -> Part:
        choices = [self._sequence()]
        while self._skip('|'):
            choices.append(self._sequence())
        return choices[0] if len(choices) == 1 else (
            lambda text, places: frozenset().union(*(part(text, places) for part in choices)))

    def _sequence(self) -> Part:
        parts = []
        while self._rest and self._rest[0] not in '|)':
            parts.append(self._repeated())

        def match(text: Text, places: Places) -> Places:
            for part in parts:
                text.spend(1)
                places = part(text, places)
                if not places:
                    break
            return places
        return match

    def _repeated(self) -> Part:
        part = self._atom()
        while self._rest and self._rest[0] in '*+?{':
            char = self._take()
            least, most = self._braces() if char == '{' else {
                '*': (0, None), '+': (1, None), '?': (0, 1)}[char]
            part = _repeat(part, least, most)
        return part

    def _braces(self) -> tuple[int, int | None]:
        inside, closed, self._rest = self._rest.partition('}')
        least, comma, most = inside.partition(',')
        numbers = [number for number in (least, most) if number]
        if not (closed and least and all(number.isdecimal() and int(number) <= MAX_REPEATS
                                         for number in numbers)):
            raise self._wrong(f'{{m}}, {{m,}} or {{m,n}} of at most {MAX_REPEATS}')
        if most and int(most) < int(least):
            raise self._wrong('{m,n} with m <= n')
        return int(least), (int(most) if most else None) if comma else int(least)

    def _atom(self) -> Part:
        char = self._take()
        if char == '(':
            return self._group()
        if char in '*+?{':
            raise self._wrong(f'something before {char}')
        if char == '^':
            return lambda text, places: places & {0}
        if char == '$':
            return lambda text, places: places & {len(text.text)}
        accepts = (self._bracket() if char == '[' else (lambda _: True) if char == '.' else
                   (self._take() if char == '\\' else char).__eq__)
        return lambda text, places: text.after(accepts, places)

    def _group(self) -> Part:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._wrong(f'at most {MAX_DEPTH} groups within each other')
        part = self._alternatives()
        if not self._skip(')'):
            raise self._wrong(') at the end of a group')
        self._depth -= 1
        return part

    def _bracket(self) -> Callable[[str], bool]:
        """A bracket expression, such as [^a-z[:digit:]_]; a ] that comes first is a character."""
        excluded, accepted = self._skip('^'), []
        while not accepted or not self._skip(']'):
            if self._skip('[:'):
                name, closed, self._rest = self._rest.partition(':]')
                if not closed or name not in CLASSES:
                    raise self._wrong('one of ' + ', '.join(f'[:{each}:]' for each in CLASSES))
                accepted.append(CLASSES[name])
                continue
            first = last = self._take()
            if len(self._rest) > 1 and self._rest[0] == '-' and self._rest[1] != ']':
                self._take()
                last = self._take()
            accepted.append(lambda char, first=first, last=last: first <= char <= last)
        return lambda char: any(accepts(char) for accepts in accepted) != excluded

    def _take(self) -> str:
        if not self._rest:
            raise self._wrong('more at the end')
        char, self._rest = self._rest[0], self._rest[1:]
        return char

    def _skip(self, token: str) -> bool:
        found = self._rest.startswith(token)
        if found:
            self._rest = self._rest[len(token):]
        return found

    @staticmethod
    def _wrong(expected: str) -> Refusal:
        return Refusal(Code.OPERATION_FAILED,
                       f'filter: not a POSIX extended regular expression; expected {expected}')


def _repeat(part: Part, least: int, most: int | None) -> Part:
    """Repeat ``part`` from ``least`` to ``most`` times; None: any number."""
    def match(text: Text, places: Places) -> Places:
        for _ in range(least):
            after = part(text, places)
            if after == places:
                break
            places = after
        found, new, times = places, places, least
        while new and (most is None or times < most):
            new = part(text, new) - found
            found |= new
            times += 1
        return found
    return match
