"""Loads the scripts and style sheets of this folder, as HTML for the panel or as text.

Viser has no call for either, and <script> elements in the panel's HTML do not run; the error
handler of an image that cannot be loaded does, whenever the panel is shown.
"""
from __future__ import annotations

import html
import json
from pathlib import Path

FOLDER = Path(__file__).parent


def source(name: str) -> str:
    """Text of a file of this folder."""
    return (FOLDER / name).read_text('utf-8')


def script(*names: str, **constants: str) -> str:
    """HTML that runs scripts as one function, whose ``this`` is an <img> in the panel.

    ``constants``: names and values of the constants that the scripts use. A script runs each time
    the panel is shown and has to guard what may be done only once.
    """
    code = ''.join(f'const {key} = {json.dumps(value)};\n' for key, value in constants.items())
    code += '\n'.join(source(name) for name in names)
    return f'<img src="data:," style="display:none" onerror="{html.escape(code)}">'


def style(name: str, **properties: str) -> str:
    """HTML of a style sheet; ``properties``: texts of its custom properties --ragdoll-<name>."""
    custom = ''.join(f'--ragdoll-{key}: {json.dumps(value)};' for key, value in properties.items())
    return f'<style>:root {{{custom}}}\n{source(name)}</style>'
