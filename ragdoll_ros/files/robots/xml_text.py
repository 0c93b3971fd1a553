"""XML of robots and worlds as it is found: encodings, limits of size, errors with their place."""
import codecs
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...model import errors

LARGEST_TEXT = 32_000_000
"""Bytes of a file, and characters of a text."""

PREFIX = re.compile(r'<([A-Za-z_][\w.-]*):[A-Za-z_]|\s([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*\s*=')
"""The prefix of the name of an element, or of an attribute."""

DEFAULT_NAMESPACE = re.compile(r'\bxmlns\s*=\s*("[^"]*"|\'[^\']*\')')

COMMENT = re.compile(r'<!--.*?-->', re.DOTALL)

FIRST_TAG = re.compile(r'(<(?:robot|sdf)\b)')

NAMES = {'robot': 'URDF', 'sdf': 'SDF'}
"""Format of each root element."""


def read_xml(path: Path, tag: str) -> str:
    """Text of a file whose root element is to be ``tag``. Raises Unreadable; OSError."""
    if not path.is_file():
        there = 'not a regular file' if path.exists() else 'no such file'
        raise errors.Unreadable('', there, f'a {NAMES[tag]} file')
    if path.stat().st_size > LARGEST_TEXT:
        raise errors.Unreadable('', path.stat().st_size, f'at most {LARGEST_TEXT} bytes')
    return decode_xml(path.read_bytes())


def parse_root(text: str, tag: str) -> ElementTree.Element:
    """Root element ``tag`` of a text. Raises Unreadable, WrongForm."""
    if len(text) > LARGEST_TEXT:
        raise errors.Unreadable('', f'{len(text)} characters', f'at most {LARGEST_TEXT}')
    # Gazebo's worlds have -- in comments, which XML forbids and its parser allows.
    text = COMMENT.sub(lambda comment: '\n' * comment[0].count('\n'), text)
    if '<!DOCTYPE' in text or '<!ENTITY' in text:
        raise errors.Unreadable('', 'a DOCTYPE', f'{NAMES[tag]} without entities')
    # Here it would be part of all names; other tools do not look at it.
    text = DEFAULT_NAMESPACE.sub('', text)
    try:
        root = ElementTree.fromstring(_declare_prefixes(text))
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise errors.Unreadable('', str(error),
                                f'XML: a <{tag}> (expand a xacro first)') from None
    if root.tag != tag:
        raise errors.WrongForm('', f'<{root.tag}>', f'a <{tag}>')
    return root


def _declare_prefixes(text: str) -> str:
    """Return the text with declarations, in its first <robot> or <sdf>, of all prefixes that it
    uses but does not declare, such as those of sensors in old files: other tools ignore prefixes.
    The prefix xacro is not declared, as a xacro has to be expanded first.
    """
    prefixes = {prefix for found in PREFIX.finditer(text) for prefix in found.groups() if prefix}
    missing = [prefix for prefix in sorted(prefixes)
               if prefix not in ('xml', 'xmlns', 'xacro') and f'xmlns:{prefix}' not in text]
    declared = ''.join(f' xmlns:{prefix}="{prefix}"' for prefix in missing)
    return FIRST_TAG.sub(rf'\1{declared}', text, count=1)


def parse_numbers(text: str, length: int, where: str) -> np.ndarray:
    """``length`` finite numbers (length,) of a text. Raises WrongForm at ``where``."""
    try:
        # A separating comma is accepted; a decimal comma gives too many numbers.
        numbers = np.array([float(word) for word in text.replace(',', ' ').split()])
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != length or not np.isfinite(numbers).all():
        what = f'{length} finite numbers' if length > 1 else 'a finite number'
        if '$' in text:
            what += ' (expand a xacro first)'
        raise errors.WrongForm(where, text, what)
    return numbers


def decode_xml(data: bytes) -> str:
    """Text of a URDF or SDF file without its XML declaration; line numbers are kept.

    Accepts a byte order mark, Latin-1, lines before the XML declaration, NULs at the end.
    """
    text = _decoded(data).rstrip('\0 \t\r\n')
    head, found, rest = text.partition('<?xml')
    # XML allows nothing before a declaration; the text is decoded already.
    if found and '<robot' not in head and '<sdf' not in head:
        declaration, _, text = rest.partition('?>')
        text = '\n' * (head + declaration).count('\n') + text
    return text


def _decoded(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode('utf-16', errors='replace')
    try:
        return data.decode('utf-8-sig')
    except UnicodeDecodeError:
        # Every byte is a character of Latin-1; only names and comments can be wrong.
        return data.decode('latin-1')
