"""Characters in formats that are not read: what it is and how to convert it, in one sentence."""
import fit_rigs
import pytest
from test_fit_broken import changed, set_in

from ragdoll_ros.fit.command import main
from ragdoll_ros.fit.reading.character import read_character

FBX = b'Kaydara FBX Binary  \0\x1a\0\xe8\x1c\0\0'


@pytest.mark.parametrize(('name', 'content', 'said'), [
    ('a.fbx', FBX, "'an FBX file'; expected glTF: convert it in Blender: File > Import > FBX "
     '(.fbx), File > Export > glTF 2.0 (.glb)'),
    ('a.FBX', b'; FBX 7.4.0 project file\n', "'an FBX file'"),
    ('misnamed.glb', FBX, "'an FBX file'"),
    ('a.pmx', b'PMX \0\0\0\x40\x08', "'an MMD model'; expected glTF: convert it in Blender: with "
     'the add-on MMD Tools File > Import > MikuMikuDance Model (.pmd, .pmx), File > Export'),
    ('a.pmd', b'Pmd\0\0\x80\x3f', "'an MMD model'"),
    ('a.blend', b'BLENDER-v405', "'a Blender file'; expected glTF: convert it in Blender: File > "
     'Open, File > Export')])
def test_a_format_that_is_not_read_is_named_with_the_steps(tmp_path, capsys, name, content, said):
    path = tmp_path / name
    path.write_bytes(content)
    assert main([str(path)]) == 2
    told = capsys.readouterr().err
    assert str(path) in told and said in told and len(told.splitlines()) == 1


def test_meshopt_compression_is_named_with_the_command_that_undoes_it(tmp_path, capsys):
    path = tmp_path / 'a.glb'
    path.write_bytes(changed(set_in('extensionsRequired', ['EXT_meshopt_compression'])))
    assert main([str(path)]) == 2
    told = capsys.readouterr().err
    assert str(path) in told and 'npx @gltf-transform/cli copy IN.glb OUT.glb' in told


def test_a_name_alone_refuses_no_gltf(tmp_path):
    path = tmp_path / 'a.fbx'
    fit_rigs.write(fit_rigs.RIGS['two_bones'], tmp_path).rename(path)
    assert len(read_character(path).bone_names) == 2
