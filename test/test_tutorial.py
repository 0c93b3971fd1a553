"""docs/tutorial.ipynb, run in a kernel of its own as Jupyter does."""
from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

import fit_rigs
import pytest
from conftest import ROOT

nbformat = pytest.importorskip('nbformat')
nbclient = pytest.importorskip('nbclient')
for needed in ('ipykernel', 'viser', 'mcap', 'matplotlib'):
    pytest.importorskip(needed)

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


def test_the_tutorial_runs_as_it_stands(tmp_path, monkeypatch):
    """In a folder that holds nothing but it and its character: two plots, two pages, four files."""
    for file in (TUTORIAL, CHARACTER):
        shutil.copy(file, tmp_path)
    monkeypatch.setenv('PYTHONPATH', os.pathsep.join(
        filter(None, [str(ROOT), os.environ.get('PYTHONPATH', '')])))
    notebook = nbformat.read(tmp_path / TUTORIAL.name, 4)
    begin = time.monotonic()
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name='python3',
                                     resources={'metadata': {'path': str(tmp_path)}})
    client.execute()
    took = time.monotonic() - begin
    assert len(outputs(notebook, 'image/png')) == 2
    pages = [page for page in outputs(notebook, 'text/html') if '__VISER_EMBED_DATA__' in page]
    assert len(pages) == 2
    said = text(notebook)
    assert 'verdict: good' in said and 'the head ends at' in said
    made = {path.name for path in tmp_path.iterdir()} - {TUTORIAL.name, CHARACTER.name}
    assert made == {'doll.yaml', 'fall.glb', 'fall.bvh', 'fall.csv', 'fall.mcap'}
    assert took < LONGEST


def test_the_tutorial_is_kept_without_what_it_shows():
    """Pages of a megabyte, and plots, are made anew where it is run."""
    notebook = nbformat.read(TUTORIAL, 4)
    nbformat.validate(notebook)
    assert all(not cell.get('outputs') and not cell.get('execution_count')
               for cell in notebook.cells)


def test_its_character_is_the_tests_own(tmp_path):
    """Made by code of this project, so that it has no other licence."""
    made = fit_rigs.write(fit_rigs.RIGS['vrm'], tmp_path)
    assert Path(made).read_bytes() == CHARACTER.read_bytes()
