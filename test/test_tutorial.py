"""docs/tutorial.ipynb, run in a kernel of its own as Jupyter does."""
from __future__ import annotations

import json
import os
import shutil
import struct
import time
from importlib.util import find_spec
from pathlib import Path

import fit_rigs
import pytest
from conftest import ROOT

if any(find_spec(needed) is None for needed in (
        'nbformat', 'nbclient', 'ipykernel', 'viser', 'mcap', 'matplotlib')):
    pytest.skip('what the tutorial needs is not installed', allow_module_level=True)

TUTORIAL, CHARACTER = ROOT / 'docs/tutorial.ipynb', ROOT / 'docs/character.glb'

LONGEST = 90.0
"""s that it may take where machine code has been compiled."""


def outputs(notebook, kind):
    """What cells have shown of a MIME type."""
    return [each['data'][kind] for cell in notebook.cells for each in cell.get('outputs', ())
            if kind in each.get('data', ())]


def text(notebook):
    """All that cells have printed."""
    return ''.join(each['text'] for cell in notebook.cells for each in cell.get('outputs', ())
                   if each['output_type'] == 'stream')


def executed(folder, monkeypatch):
    """The notebook as run in a folder that holds nothing but it and its character; and seconds."""
    for file in (TUTORIAL, CHARACTER):
        shutil.copy(file, folder)
    import nbclient
    import nbformat
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(
        filter(None, [str(ROOT), os.environ.get('PYTHONPATH', '')])))
    notebook = nbformat.read(folder / TUTORIAL.name, 4)
    begin = time.monotonic()
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name='python3',
                                     resources={'metadata': {'path': str(folder)}})
    client.execute()
    return notebook, time.monotonic() - begin


def test_the_tutorial_runs_as_it_stands(tmp_path, monkeypatch):
    """Two plots, two pages, four files."""
    notebook, _ = executed(tmp_path, monkeypatch)
    assert len(outputs(notebook, 'image/png')) == 2
    pages = [page for page in outputs(notebook, 'text/html') if '__VISER_EMBED_DATA__' in page]
    assert len(pages) == 2
    said = text(notebook)
    assert 'verdict: good' in said and 'the head ends at' in said
    made = {path.name for path in tmp_path.iterdir()} - {TUTORIAL.name, CHARACTER.name}
    assert made == {'doll.yaml', 'fall.glb', 'fall.bvh', 'fall.csv', 'fall.mcap'}


@pytest.mark.slow
def test_the_tutorial_takes_no_longer_than_it_says(tmp_path, monkeypatch):
    assert executed(tmp_path, monkeypatch)[1] < LONGEST


def test_the_tutorial_is_kept_without_what_it_shows():
    """Pages of a megabyte, and plots, are made anew where it is run."""
    import nbformat
    notebook = nbformat.read(TUTORIAL, 4)
    nbformat.validate(notebook)
    assert all(not cell.get('outputs') and not cell.get('execution_count')
               for cell in notebook.cells)


def chunks(path):
    """The JSON of a .glb, its numbers in an order of their own, and the rest of the file."""
    content = path.read_bytes()
    end = 20 + struct.unpack_from('<I', content, 12)[0]
    numbers = []

    def take(text):
        numbers.append(float(text))
        return 'number'
    return json.loads(content[20:end], parse_float=take), numbers, content[end:]


def test_its_character_is_the_tests_own(tmp_path):
    """Made by code of this project, so that it has no other licence: what is drawn to the bit. How
    products of matrices are rounded is up to the processor, so that matrices of nodes, which are
    written in full, differ in their last digits: 4 roundings of numbers near 1.
    """
    words, numbers, drawn = chunks(Path(fit_rigs.write(fit_rigs.RIGS['vrm'], tmp_path)))
    kept_words, kept_numbers, kept_drawn = chunks(CHARACTER)
    assert words == kept_words and drawn == kept_drawn
    assert numbers == pytest.approx(kept_numbers, rel=0, abs=1e-15)
