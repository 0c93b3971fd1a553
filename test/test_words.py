"""The code speaks the field's language: fields have names, a name has one meaning."""
import ast
import functools
import io
import re
import tokenize
from collections import Counter
from pathlib import Path

import pytest
from test_sizes import definitions, parameters

PACKAGE = Path(__file__).resolve().parent.parent / 'ragdoll_ros'
FILES = sorted(PACKAGE.rglob('*.py'))
CORE = [path for path in FILES if path.relative_to(PACKAGE).parts[:2] in (
    ('physics', 'kernels'), ('physics', 'engine'))]

MATRICES = {
    'r', 'm', 'A', 'B', 'out', 'matrix', 'inertia', 'own', 'axes', 'block',
    'self._model.geom_solref', 'self._model.jnt_solref',  # entries of small matrices and vectors
    'k', 'dense', 'rates', 'end_rates', 'cluster.end_rates',  # stages of a Runge-Kutta method
    'OCTAGON', 'centers',  # pairs, triples
    'found', 'geom_pairs', 'bones', 'pairs', 'table',
    "contacts['impulse']", "found['impulse']",  # along the rows of a contact, the normal first
    'self.rows'}  # of DollTotals, which names them
"""Arrays whose columns have numbers in the literature, or that are pairs and triples."""

MOST_PARAMETERS = {'core': 12, 'elsewhere': 8}

OLD_NAMES = {
    'physics/kernels physics/engine/rigid':
        'Course Room up last heft flies Given borne meets along begun Tally handed pushed lifted '
        'lasted stalls Record Work turns moves drifts pulls times turned look way part_pairs '
        'within narrow bent between step_or_touch give_back pay settle move_freely free meet '
        'take_over respond ask thrown deep follow_curve rest_locked hold_energy give take_out '
        'lag stiffen pull weaken shift',
    'physics': 'Courses Neighbours couples _spread_out _meet _go _look _departure _designed acting '
        'hush Hold Holds AppliedHold RecordedSimulation worn',
    'ros': 'Glance told worn written namesakes followed glance tally rescue run_log session heard '
        'stand be_clock packed layouts marker_list handles',
    'viewer': 'lost opening docking on_top own_uploads Look Cut Moment told',
    'fit': 'carried apart kept dials trial',
    'falls accuracy': 'fineness pieces faints contents Order creased worn'}
"""Names of our own in rooms, for which the field has a word."""

TERMS = {
    'broad phase': 'physics/engine/rigid/broad_phase.py',
    'narrow phase': 'physics/kernels/collision/narrow_phase.py',
    'manifold': 'physics/kernels/collision/convex_manifold.py',
    'time of impact': 'physics/kernels/stepping/time_of_impact.py',
    'position correction': 'physics/kernels/stepping/position_correction.py',
    'warm start': 'physics/kernels/stepping/warm_start.py',
    'penetration': 'physics/kernels/stepping/position_correction.py',
    'complementarity': 'physics/kernels/impulses/solver.py',
    'kinematic tree': 'physics/kernels/dynamics/kinematics.py'}
"""Terms of the field, and where what they name is done."""


@functools.cache
def trees():
    """Syntax tree of each file."""
    return {path: ast.parse(path.read_text()) for path in FILES}


def numbered_slots(tree):
    """Accesses like name[k, 7], by the name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple) and any(
                isinstance(part, ast.Constant) and isinstance(part.value, int)
                for part in node.slice.elts):
            yield ast.unparse(node.value)


def identifiers(text):
    """Identifiers of a source; words in strings and comments are none."""
    return {token.string for token in tokenize.generate_tokens(io.StringIO(text).readline)
            if token.type == tokenize.NAME}


def test_records_of_the_core_have_names_for_fields():
    found = {(str(path.relative_to(PACKAGE)), name) for path in CORE
             for name in numbered_slots(trees()[path])
             if name not in MATRICES and not name.startswith('np.')}
    assert found == set()


def test_a_numbered_slot_is_found():
    assert list(numbered_slots(ast.parse('springs[k, 18] = 1.0'))) == ['springs']


def test_functions_take_few_parameters():
    found = [(str(path.relative_to(PACKAGE)), name, parameters(node))
             for path, tree in trees().items() for name, node in definitions(tree)
             if not isinstance(node, ast.ClassDef)
             and parameters(node) > MOST_PARAMETERS['core' if path in CORE else 'elsewhere']]
    assert found == []


def test_no_class_has_the_name_of_another():
    names = Counter(node.name for tree in trees().values() for node in ast.walk(tree)
                    if isinstance(node, ast.ClassDef))
    assert {name for name, count in names.items() if count > 1} == set()


def test_no_identifier_is_a_word_of_our_own():
    found = {(str(path.relative_to(PACKAGE)), name)
             for rooms, names in OLD_NAMES.items() for room in rooms.split()
             for path in sorted((PACKAGE / room).rglob('*.py'))
             for name in identifiers(path.read_text()) & set(names.split())}
    assert found == set()


@pytest.mark.parametrize('term', TERMS)
def test_a_term_of_the_field_stands_where_what_it_names_is_done(term):
    text = re.sub(r'\s+', ' ', (PACKAGE / TERMS[term]).read_text().lower())
    assert term in text
