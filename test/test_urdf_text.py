"""URDF files as they are found: what surrounds the XML, or encodes it otherwise, is read over."""
import pytest

from ragdoll_ros.files.robots.xml_text import decode_xml
from ragdoll_ros.fit.robots.robot import read_urdf
from ragdoll_ros.model import errors

BODY = ('<robot name="r"><link name="Fuß"><inertial><mass value="1"/></inertial><collision>'
        '<geometry><box size="0.1, 0.2, 0.3"/></geometry></collision></link></robot>')
DECLARED = '<?xml version="1.0" encoding="{}"?>\n'


@pytest.mark.parametrize('data', [
    BODY.encode(), BODY.encode('latin-1'), BODY.encode('utf-8-sig'), BODY.encode('utf-16'),
    BODY.encode() + b'\n\0', (DECLARED.format('utf-8') + BODY).encode('latin-1'),
    (DECLARED.format('ISO-8859-1') + BODY).encode('latin-1'),
    (DECLARED.format('utf-16') + BODY).encode(),
    ('\n\n' + DECLARED.format('utf-8') + BODY).encode(),
    ('made by hand\n<!-- a note -->\n' + DECLARED.format('utf-8') + BODY).encode()])
def test_what_other_tools_read_is_read(tmp_path, data):
    path = tmp_path / 'robot.urdf'
    path.write_bytes(data)
    doll, notes = read_urdf(path)
    assert (doll.root.name, doll.root.shape.size, notes) == ('Fuß', (0.1, 0.2, 0.3), ())


def test_errors_name_the_line_of_the_file(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text('\n\n' + DECLARED.format('utf-8') + '<robot>\n<link\n</robot>')
    with pytest.raises(errors.ModelErrors, match='line 6'):
        read_urdf(path)


def test_a_declaration_within_the_robot_stays_an_error():
    text = decode_xml(('<robot>' + DECLARED + '</robot>').encode())
    assert '<?xml' in text
