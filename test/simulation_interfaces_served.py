"""The standard's services over DDS, with the messages that are installed.

python -m pytest test/simulation_interfaces_served.py

Run by test_ros_simulation_interfaces.py, which builds the messages where they are missing.
"""
from __future__ import annotations

import math
import random
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import ROOT
from geometry_msgs.msg import PoseArray, Vector3
from peer import start
from rclpy.action import ActionClient
from rclpy.parameter import Parameter
from samples import FLAIL_SDF, TWO_FLAILS_SDF
from simulation_interfaces import action, msg, srv
from std_srvs.srv import SetBool, Trigger

from ragdoll_ros.files.doll import load_doll
from ragdoll_ros.files.urdf import to_urdf
from ragdoll_ros.model import rotation
from ragdoll_ros.ros.simulation_interfaces import (
    bounds,
    codes,
    entities,
    filters,
    run_state,
    spawning,
)
from ragdoll_ros.ros.simulation_interfaces.resources import dolls, worlds
from ragdoll_ros.ros.simulation_interfaces.servers import snake_case

HALF = math.sqrt(0.5)


@pytest.fixture
def node(make_node, peer):
    node = make_node(scene='stairs', start_paused=True)
    peer.executor_.add_node(node)
    return node


@pytest.fixture
def call(node, peer):
    """Call a service of the node; fields may be nested mappings."""
    def called(name, /, **fields):
        kind = getattr(srv, name)
        request = kind.Request()
        fill(request, fields)
        return peer.call(kind, f'/ragdoll/{snake_case(name)}', request)
    return called


def fill(message, fields):
    """Set the fields of a message that a mapping names, as ros2cli does."""
    for name, value in fields.items():
        kind = message.get_fields_and_field_types()[name]
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            make = Vector3 if 'Vector3' in kind else getattr(msg, kind[:-1].rpartition('/')[2])
            made = [make() for _ in value]
            for each, inner in zip(made, value, strict=True):
                fill(each, inner)
            setattr(message, name, made)
        else:
            setattr(message, name, value)


def code(response):
    return response.result.result


def state(call):
    return call('GetSimulationState').state.state


def row(entity_state):
    """Pose and twist (13,) of an EntityState."""
    p, q, t = entity_state.pose.position, entity_state.pose.orientation, entity_state.twist
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w, t.linear.x, t.linear.y, t.linear.z,
            t.angular.x, t.angular.y, t.angular.z]


def resource(uri, text=''):
    """Fields of a LoadWorld, by the version."""
    fields = {'uri': uri, 'resource_string': text}
    is_new = 'world_resource' in srv.LoadWorld.Request.get_fields_and_field_types()
    return {'world_resource': fields} if is_new else fields


def spawned(uri, text=''):
    """Fields of a SpawnEntity, by the version."""
    fields = {'uri': uri, 'resource_string': text}
    is_new = 'entity_resource' in srv.SpawnEntity.Request.get_fields_and_field_types()
    return {'entity_resource': fields} if is_new else fields


FLAGS = {name: True for name in ('set_pose', 'set_twist')
         if name in srv.SetEntityState.Request.get_fields_and_field_types()}


@pytest.mark.parametrize(('ours', 'theirs', 'prefix'), [
    (codes.Code, msg.Result, 'RESULT_'), (codes.Feature, msg.SimulatorFeatures, ''),
    (entities.Category, msg.EntityCategory, 'CATEGORY_'), (bounds.Kind, msg.Bounds, 'TYPE_'),
    (filters.TagsMode, msg.TagsFilter, 'FILTER_MODE_'),
    (run_state.RunningState, msg.SimulationState, 'STATE_')])
def test_numbers_are_those_of_the_messages(ours, theirs, prefix):
    for each in ours:
        assert each == getattr(theirs, prefix + each.name), each


def test_numbers_of_single_services_are_those_of_the_messages():
    for module, response, names in (
            (run_state, srv.SetSimulationState.Response, ('ALREADY_IN_TARGET_STATE',
                                                          'INCORRECT_TRANSITION')),
            (worlds, srv.LoadWorld.Response, ('UNSUPPORTED_FORMAT', 'NO_RESOURCE',
                                              'RESOURCE_PARSE_ERROR')),
            (worlds, srv.UnloadWorld.Response, ('NO_WORLD_LOADED',)),
            (worlds, srv.GetCurrentWorld.Response, ('NO_WORLD_LOADED',)),
            (entities, srv.SetEntityState.Response, ('INVALID_POSE',)),
            (spawning, srv.SpawnEntity.Response, (
                'NAME_NOT_UNIQUE', 'NAME_INVALID', 'NAMESPACE_INVALID', 'INVALID_POSE')),
            (dolls, srv.SpawnEntity.Response, (
                'UNSUPPORTED_FORMAT', 'NO_RESOURCE', 'RESOURCE_PARSE_ERROR',
                'UNSUPPORTED_ASSETS')),
            (spawning, srv.SpawnEntities.Response, ('ENTITIES_SPAWN_FAILED',))):
        for name in names:
            assert getattr(module, name) == getattr(response, name)
    scope = srv.ResetSimulation.Request
    assert (run_state.TIME, run_state.STATE, run_state.SPAWNED, run_state.ALL) == (
        scope.SCOPE_TIME, scope.SCOPE_STATE, scope.SCOPE_SPAWNED, scope.SCOPE_ALL)


def test_features_are_those_of_the_services_that_there_are(node, call):
    """Each service that is there is named with its features in the standard's comments."""
    by_service = {
        'get_entities': {'ENTITY_TAGS', 'ENTITY_BOUNDS_BOX', 'ENTITY_CATEGORIES'},
        'get_entity_bounds': {'ENTITY_BOUNDS'}, 'get_entity_state': {'ENTITY_STATE_GETTING'},
        'get_entities_states': {'ENTITY_STATE_GETTING'},
        'set_entity_state': {'ENTITY_STATE_SETTING'}, 'get_entity_info': {'ENTITY_INFO_GETTING'},
        'set_entity_info': {'ENTITY_INFO_SETTING'},
        'reset_simulation': {'SIMULATION_RESET', 'SIMULATION_RESET_STATE',
                             'SIMULATION_RESET_SPAWNED'},
        'spawn_entity': {'SPAWNING', 'SPAWNING_RESOURCE_STRING'}, 'delete_entity': {'DELETING'},
        'spawn_entities': {'SPAWNING_ENTITIES'},
        'get_spawnables': {'SPAWNABLES'},
        'get_simulation_state': {'SIMULATION_STATE_GETTING'},
        'set_simulation_state': {'SIMULATION_STATE_SETTING', 'SIMULATION_STATE_PAUSE'},
        'step_simulation': {'STEP_SIMULATION_SINGLE', 'STEP_SIMULATION_MULTIPLE'},
        'load_world': {'WORLD_LOADING'}, 'unload_world': {'WORLD_UNLOADING'},
        'get_current_world': {'WORLD_INFO_GETTING'},
        'get_available_worlds': {'AVAILABLE_WORLDS'}, 'get_simulator_features': set(),
        'simulate_steps/_action/send_goal': {'STEP_SIMULATION_ACTION'}}
    told = call('GetSimulatorFeatures').features
    served = {name for name, (kind,) in node.get_service_names_and_types_by_node(
        'ragdoll', '/') if kind.startswith('simulation_interfaces/')}
    served -= {name for name in served if '_action/' in name and 'send_goal' not in name}
    assert served == {f'/ragdoll/{name}' for name in by_service}
    assert set(told.features) == {getattr(msg.SimulatorFeatures, name)
                                  for names in by_service.values() for name in names}
    assert node.simulation_interfaces.status == '20 services, 1 action'


def test_states_follow_each_other_and_the_node_s_own_services(node, peer, call):
    def set_to(target):
        return code(call('SetSimulationState', state={'state': target}))

    assert state(call) == 0 and set_to(0) == 101
    assert set_to(2) == 1 and state(call) == 2
    assert set_to(1) == 1 and state(call) == 1 and not node.paused
    peer.wait(lambda: node.simulation.time > 0)
    assert set_to(2) == 1 and state(call) == 2
    assert set_to(0) == 1 and (state(call), node.simulation.time) == (0, 0)
    assert [set_to(each) for each in (4, 5, 9)] == [103, 103, 103]
    assert peer.call(Trigger, '/ragdoll/step', Trigger.Request()).success and state(call) == 2
    peer.call(SetBool, '/ragdoll/pause', SetBool.Request(data=False))
    assert state(call) == 1
    assert node.input_counts.refused['~/set_simulation_state'] == 4


def test_steps_are_made_while_paused_alone(node, call):
    assert code(call('StepSimulation')) == 1 and node.simulation.time == node.simulation.tick
    assert code(call('StepSimulation', steps=30)) == 1
    assert node.simulation.time == 31 * node.simulation.tick and node.paused and state(call) == 2
    assert code(call('StepSimulation', steps=0)) == 1
    call('SetSimulationState', state={'state': 1})
    response = call('StepSimulation', steps=5)
    assert code(response) == 4 and 'not paused' in response.result.error_message


def test_others_are_served_during_steps_and_may_end_them(node, peer, call):
    client = peer.create_client(srv.StepSimulation, '/ragdoll/step_simulation')
    peer.wait(client.service_is_ready)
    for name, fields, words in (
            ('SetSimulationState', {'state': {'state': 1}}, 'resumed after'),
            ('ResetSimulation', {'scope': 0}, 'reset, or another scene or none, after'),
            ('LoadWorld', resource('drop'), 'reset, or another scene or none, after'),
            ('UnloadWorld', {}, 'reset, or another scene or none, after')):
        if not node.paused:
            call('SetSimulationState', state={'state': 2})
        before = node.simulation.time
        waiting = client.call_async(srv.StepSimulation.Request(steps=2 ** 64 - 1))
        peer.wait(lambda before=before: node.simulation.time > before)
        assert code(call('StepSimulation', steps=1)) == 3 and not waiting.done()
        assert code(call(name, **fields)) == 1
        peer.wait(waiting.done)
        assert code(waiting.result()) == 4 and words in waiting.result().result.error_message


def test_the_action_gives_feedback_after_each_step_and_is_cancelled(node, peer, call):
    client = ActionClient(peer, action.SimulateSteps, '/ragdoll/simulate_steps')
    peer.wait(client.server_is_ready)
    told = []

    def send(steps):
        told.clear()
        sent = client.send_goal_async(action.SimulateSteps.Goal(steps=steps), lambda message: told
                                      .append((message.feedback.completed_steps,
                                               message.feedback.remaining_steps)))
        peer.wait(sent.done)
        result = sent.result().get_result_async()
        return sent.result(), result

    goal, result = send(8)
    peer.wait(lambda: result.done() and len(told) == 8)
    assert told == [(made, 8 - made) for made in range(1, 9)]
    assert (result.result().status, code(result.result().result)) == (4, 1)
    assert node.simulation.time == 8 * node.simulation.tick and node.paused
    goal, result = send(10 ** 9)
    peer.wait(lambda: told)
    cancelled = goal.cancel_goal_async()
    peer.wait(lambda: cancelled.done() and result.done())
    assert (result.result().status, code(result.result().result)) == (5, 4)
    assert 'cancelled after' in result.result().result.result.error_message
    time = node.simulation.time
    assert code(call('StepSimulation')) == 1 and node.simulation.time == time + node.simulation.tick
    call('SetSimulationState', state={'state': 1})
    goal, result = send(3)
    peer.wait(result.done)
    assert (result.result().status, code(result.result().result)) == (6, 4)
    client.destroy()


def test_a_reset_is_of_the_state_with_time_or_without(node, call):
    start, tick = node.simulation.state.rows.tobytes(), node.simulation.tick
    for scope, kept in ((0, 0), (255, 0), (3, 0), (7, 0), (2, 3), (6, 3)):
        call('ResetSimulation')
        call('StepSimulation', steps=3)
        assert code(call('ResetSimulation', scope=scope)) == 1
        assert node.simulation.time == kept * tick
        assert node.simulation.state.rows.tobytes() == start
    call('StepSimulation')
    before = node.simulation.state.rows.tobytes()
    assert code(call('ResetSimulation', scope=4)) == 1
    for scope in (1, 5, 8, 10, 128):
        assert code(call('ResetSimulation', scope=scope)) == 0
    assert node.simulation.state.rows.tobytes() == before != start


def test_entities_are_the_dolls_and_bodies_that_pass_all_filters(node, call):
    def found(**wanted):
        response = call('GetEntities', filters=wanted)
        assert code(response) == 1, response.result.error_message
        return list(response.entities)

    names = [each.name for each in node.simulation.scene.bodies]
    assert found() == ['man', *names] and len(names) == 11
    assert found(filter='^m[[:alpha:]]*n$') == ['man'] == found(categories=[{'category': 2}])
    assert found(categories=[{'category': 5}, {'category': 1}]) == names
    assert found(filter='man', categories=[{'category': 5}]) == []
    x, y, z = node.simulation.state.positions[0]
    sphere = {'type': 3, 'points': [{'x': x, 'y': y, 'z': z}, {'x': 0.01}]}
    assert found(bounds=sphere) == ['man']
    box = {'type': 1, 'points': [{'x': 99.0, 'y': 99.0, 'z': 99.0}, {'x': 98.0, 'y': -99.0}]}
    assert found(bounds=box) == []
    assert code(call('GetEntities', filters={'bounds': {'type': 2}})) == 0
    assert code(call('GetEntities', filters={'filter': '(('})) == 4
    tagged = {'category': {'category': 4}, 'description': 'a dummy', 'tags': ['a', 'b']}
    assert code(call('SetEntityInfo', entity='man', info=tagged)) == 1
    info = call('GetEntityInfo', entity='man').info
    assert (info.category.category, info.description, list(info.tags)) == (4, 'a dummy', ['a', 'b'])
    assert found(categories=[{'category': 4}], tags={'tags': ['b', 'c']}) == ['man']
    assert found(tags={'tags': ['b', 'c'], 'filter_mode': 1}) == []


def test_states_are_what_the_node_publishes_and_set_in_the_world_frame(node, peer, call):
    """A quarter turn about z: x of the doll is y of the world, in which the twist is."""
    put = {'pose': {'position': {'x': 1.0, 'y': 2.0, 'z': 3.0},
                    'orientation': {'z': HALF, 'w': HALF}},
           'twist': {'linear': {'x': 4.0, 'z': 1.0}, 'angular': {'y': 0.5}}}
    assert code(call('SetEntityState', entity='man', state=put, **FLAGS)) == 1
    got = call('GetEntityState', entity='man').state
    expected = [1, 2, 3, 0, 0, HALF, HALF, 4, 0, 1, 0, 0.5, 0]
    np.testing.assert_allclose(row(got), expected, atol=1e-12)
    assert got.header.frame_id == 'world'
    poses = peer.collect(PoseArray, '/ragdoll/poses')
    peer.wait_heard(node, '/ragdoll/poses')
    call('StepSimulation', steps=20)
    peer.wait(lambda: len(poses) >= 20)
    names = node.simulation.scene.bone_names
    published = poses[-1][1]
    for bone, pose in zip(names, published.poses, strict=True):
        got = call('GetEntityState', entity=f'man/{bone}').state
        assert got.pose == pose and got.header.stamp == published.header.stamp
    # What moves, by the poses: a difference quotient of two ticks, to first order in the tick.
    before, after = poses[-2][1].poses[0].position, published.poses[0].position
    moved = np.array([getattr(after, axis) - getattr(before, axis) for axis in 'xyz'])
    velocity = row(call('GetEntityState', entity='man').state)[7:10]
    np.testing.assert_allclose(velocity, moved / node.simulation.step, atol=0.2)
    both = call('GetEntitiesStates', filters={'filter': 'man|step_1'})
    assert len(both.states) == len(both.entities) >= 1
    assert row(both.states[0]) == row(call('GetEntityState', entity='man').state)


def test_a_pose_or_a_twist_alone_is_set_with_version_2(node, call):
    if not FLAGS:
        pytest.skip('version 1 sets both')
    before = row(call('GetEntityState', entity='man').state)
    state = {'pose': {'position': {'z': 5.0}}, 'twist': {'linear': {'x': 2.0}}}
    response = call('SetEntityState', entity='man', state=state)
    assert code(response) == 1 and 'nothing is set' in response.result.error_message
    call('SetEntityState', entity='man', state=state, set_twist=True)
    after = row(call('GetEntityState', entity='man').state)
    assert after[:3] == pytest.approx(before[:3]) and after[7] == 2
    call('SetEntityState', entity='man', state={'pose': {'position': {'z': 5.0}}}, set_pose=True)
    after = row(call('GetEntityState', entity='man').state)
    assert after[2] == 5 and after[7] == pytest.approx(2)


@pytest.mark.parametrize(('entity', 'state', 'wrong'), [
    ('nobody', {}, 2), ('man/tail', {}, 2), ('man/head', {}, 0), ('step_1', {}, 0),
    ('step_1', {'twist': {'linear': {'x': 1.0}}}, 4),
    ('man', {'header': {'frame_id': 'map'}}, 4),
    ('man', {'pose': {'orientation': {'w': 0.0}}}, 101),
    ('man', {'pose': {'position': {'x': math.nan}}}, 101),
    ('man', {'pose': {'position': {'x': 1e7}}}, 101),
    ('man', {'twist': {'angular': {'x': math.inf}}}, 4)])
def test_a_state_that_cannot_be_set_is_refused_with_the_standard_s_code(node, call, entity, state,
                                                                        wrong):
    entity = node.simulation.scene.bodies[0].name if entity == 'step_1' else entity
    before = node.simulation.state.rows.tobytes()
    response = call('SetEntityState', entity=entity, state=state, **FLAGS)
    assert code(response) == wrong and response.result.error_message
    assert node.simulation.state.rows.tobytes() == before
    assert node.input_counts.refused == {'~/set_entity_state': 1}


def test_bounds_hold_each_bone_s_mesh(node, call):
    call('StepSimulation', steps=40)
    upper, lower = (np.array([p.x, p.y, p.z])
                    for p in call('GetEntityBounds', entity='man').bounds.points)
    scene, now = node.simulation.scene, node.simulation.state
    root = now.poses(0)
    points = np.concatenate([root.apply_inverse(now.poses(index).apply(bone.shape.mesh()[0]))
                             for index, bone in enumerate(scene.bones)])
    assert (points <= upper + 1e-9).all() and (points >= lower - 1e-9).all()
    # Meshes of round shapes lie within them, by less than 3 % of a radius.
    np.testing.assert_allclose([points.min(0), points.max(0)], [lower, upper], atol=0.01)
    assert code(call('GetEntityBounds', entity=scene.bodies[0].name)) == 1
    assert code(call('GetEntityBounds', entity='nothing')) == 2


def test_worlds_are_the_scenes(node, peer, call, tmp_path):
    listed = call('GetAvailableWorlds')
    by_name = {world.name: world for world in listed.worlds}
    assert code(listed) == 1 and by_name['drop'].description.startswith('The default doll falls')
    peer.call(SetBool, '/ragdoll/pause', SetBool.Request(data=False))
    assert code(call('LoadWorld', **resource(by_name['crowd'].world_resource.uri))) == 1
    assert (node.simulation.scene.name, state(call)) == ('crowd', 0)
    current = call('GetCurrentWorld')
    assert (code(current), current.world.name) == (1, 'crowd')
    assert current.world.world_resource.uri == 'crowd'
    assert len(call('GetEntities').entities) == 10
    own = tmp_path / 'my scene.yaml'
    own.write_text((ROOT / 'config/drop.yaml').read_text())
    assert code(call('LoadWorld', **resource(own.as_uri()))) == 1
    secret = tmp_path / 'secret'
    secret.write_text('password: hunter2\n')
    for given, wrong in ((('',), 102), (('', 'name: x'), 0), (('nowhere',), 2),
                         (('world.sdf',), 101), ((str(secret),), 103), (('http://a/b',), 2)):
        response = call('LoadWorld', **resource(*given))
        assert code(response) == wrong, given
        assert response.result.error_message and 'hunter2' not in response.result.error_message
    assert node.simulation.scene.name == 'drop'
    assert code(call('GetAvailableWorlds', additional_sources=['/'])) == 4
    assert code(call('GetAvailableWorlds', additional_sources=['/'], continue_on_error=True)) == 1
    assert code(call('GetAvailableWorlds', filter={'tags': ['indoor']})) == 0


def test_after_unloading_there_is_no_world_until_one_is_loaded(node, peer, call):
    """Each service that needs one says so, with the standard's code for a wrong state."""
    poses = peer.collect(PoseArray, '/ragdoll/poses')
    peer.wait_heard(node, '/ragdoll/poses')
    call('SetSimulationState', state={'state': 1})
    peer.wait(lambda: poses)
    features = list(call('GetSimulatorFeatures').features.features)
    assert code(call('UnloadWorld')) == 1 and state(call) == 4
    count, counted = len(poses), node.input_counts.refused.total()
    needy = {'ResetSimulation', 'StepSimulation', 'GetEntities', 'GetEntitiesStates',
             'GetEntityState', 'SetEntityState', 'GetEntityInfo', 'SetEntityInfo',
             'GetEntityBounds', 'SpawnEntity', 'SpawnEntities', 'DeleteEntity'}
    for name in sorted(needy):
        response = call(name)
        assert code(response) == 3 and 'no world is loaded' in response.result.error_message
        assert not getattr(response, 'entities', ())
    for target, wrong in ((0, 103), (1, 103), (2, 103), (4, 101), (5, 103)):
        assert code(call('SetSimulationState', state={'state': target})) == wrong
    assert code(call('GetCurrentWorld')) == 101 == code(call('UnloadWorld'))
    assert node.input_counts.refused.total() == counted + len(needy) + 7
    assert list(call('GetSimulatorFeatures').features.features) == features
    assert code(call('GetSpawnables')) == 1 == code(call('GetAvailableWorlds'))
    assert code(call('LoadWorld', **resource('nowhere'))) == 2 and state(call) == 4
    assert len(poses) == count
    assert code(call('LoadWorld', **resource('drop'))) == 1 and state(call) == 0
    assert list(call('GetEntities').entities) == ['doll']
    call('SetSimulationState', state={'state': 1})
    peer.wait(lambda: len(poses) > count)
    assert len(poses[-1][1].poses) == 10


def large(folder):
    """A scene that takes seconds to load, as a path."""
    path = folder / 'large.yaml'
    path.write_text('name: large\nground: {}\ndolls:\n' + ''.join(
        f'  - {{doll: doll, name: doll{k}, position: [{3 * (k % 30)}, {3 * (k // 30)}, 2]}}\n'
        for k in range(900)))
    return str(path)


def test_a_load_goes_on_beside_all_else_until_it_is_cancelled(node, peer, call, tmp_path):
    """The present world goes on; what comes while one loads is served, or ends the load."""
    client = peer.create_client(srv.LoadWorld, '/ragdoll/load_world')
    peer.wait(client.service_is_ready)
    request = srv.LoadWorld.Request()
    fill(request, resource(large(tmp_path)))
    for name, fields, after, scene in (
            ('LoadWorld', resource('drop'), 0, 'drop'),
            ('SetSimulationState', {'state': {'state': 0}}, 0, 'drop'),
            ('UnloadWorld', {}, 4, None), ('UnloadWorld', {}, 4, None)):
        if node.has_world:
            call('SetSimulationState', state={'state': 1})
        waiting = client.call_async(request)
        peer.wait(lambda: state(call) == 5)
        if node.has_world:
            before = node.simulation.time
            peer.wait(lambda before=before: node.simulation.time > before)
            assert code(call('GetEntities')) == 1
        for target in (1, 2):
            assert code(call('SetSimulationState', state={'state': target})) == 103
        assert not waiting.done()
        assert code(call(name, **fields)) == 1
        peer.wait(waiting.done)
        assert code(waiting.result()) == 4
        assert 'cancelled: ' in waiting.result().result.error_message
        assert state(call) == after and node.has_world == bool(scene)
        assert not scene or node.simulation.scene.name == scene
    waiting = client.call_async(request)
    peer.wait(waiting.done)
    assert code(waiting.result()) == 1 and len(call('GetEntities').entities) == 900


def test_dolls_are_spawned_and_deleted_while_time_goes_on(node, call):
    call('StepSimulation', steps=5)
    time, before = node.simulation.time, node.simulation.state.rows.tobytes()
    pose = {'pose': {'position': {'x': -3.0, 'z': 2.0}, 'orientation': {'z': HALF, 'w': HALF}}}
    response = call('SpawnEntity', name='anna', initial_pose=pose, **spawned('woman'))
    assert (code(response), response.entity_name) == (1, 'anna')
    assert row(call('GetEntityState', entity='anna').state)[:7] == pytest.approx(
        [-3, 0, 2, 0, 0, HALF, HALF], abs=1e-12)
    assert node.simulation.state.rows.tobytes().startswith(before)
    assert code(call('SpawnEntity', name='anna', **spawned('woman'))) == 101
    text = (ROOT / 'config/doll.yaml').read_text()
    names = [call('SpawnEntity', name=name, allow_renaming=True, initial_pose={
        'pose': {'position': {'x': -4.0 - index}}}, **spawned('', text)).entity_name
        for index, name in enumerate(('anna', 'anna', '', ''))]
    assert names == ['anna_2', 'anna_3', 'doll', 'doll_2']
    found = call('GetEntities', filters={'filter': '^(man|anna|doll)'}).entities
    assert list(found) == ['man', 'anna', *names]
    # At the origin by default, the root: it is lifted onto the ground.
    assert row(call('GetEntityState', entity='doll').state)[2] > 0.3
    call('SetEntityInfo', entity='man', info={'description': 'stays'})
    for name in names:
        assert code(call('DeleteEntity', entity=name)) == 1
    assert code(call('DeleteEntity', entity='doll')) == 2
    assert call('GetEntityInfo', entity='man').info.description == 'stays'
    assert node.simulation.time == time and node.paused
    assert code(call('DeleteEntity', entity='man')) == 1
    assert code(call('DeleteEntity', entity='anna')) == 4
    for entity, wrong in (('anna/head', 0), (node.simulation.scene.bodies[0].name, 0)):
        assert code(call('DeleteEntity', entity=entity)) == wrong


def test_a_reset_takes_away_what_was_spawned(node, call):
    call('SpawnEntity', **spawned('woman'), initial_pose={'pose': {'position': {'x': -3.0}}})
    call('StepSimulation', steps=3)
    assert code(call('ResetSimulation', scope=4)) == 1
    assert [each.name for each in node.simulation.scene.dolls] == ['man']
    assert node.simulation.time == 3 * node.simulation.tick
    start = node.simulation.reset().rows.tobytes()
    call('SpawnEntity', **spawned('woman'), initial_pose={'pose': {'position': {'x': -3.0}}})
    assert code(call('DeleteEntity', entity='man')) == 1
    call('StepSimulation', steps=3)
    assert code(call('ResetSimulation')) == 1
    assert [each.name for each in node.simulation.scene.dolls] == ['man']
    assert node.simulation.time == 0 and node.simulation.state.rows.tobytes() == start
    assert node.settings.pushed_bone == 'pelvis' and node.paused


@pytest.mark.parametrize(('fields', 'wrong'), [
    ({'name': 'a/b'}, 102), ({'name': 'step_1'}, 101), ({'entity_namespace': 'ns'}, 105),
    ({**spawned('')}, 104), ({**spawned('scene.mjcf')}, 103), ({**spawned('nowhere')}, 2),
    ({**spawned('', 'dolls: []')}, 106), ({**spawned('crowd')}, 108),
    ({'initial_pose': {'header': {'frame_id': 'map'}}}, 109),
    ({'initial_pose': {'pose': {'position': {'x': math.nan}}}}, 109),
    ({'initial_pose': {'pose': {'orientation': {'w': 0.0}}}}, 109)])
def test_what_cannot_be_spawned_is_refused_with_the_standard_s_code(node, call, fields, wrong):
    if fields.get('name') == 'step_1':
        fields = {'name': node.simulation.scene.bodies[0].name}
    before = node.simulation.state.rows.tobytes()
    response = call('SpawnEntity', **{**spawned('woman'), **fields})
    assert code(response) == wrong and response.result.error_message
    assert node.simulation.state.rows.tobytes() == before
    assert node.input_counts.refused == {'~/spawn_entity': 1}


def test_spawnables_are_the_dolls_and_can_be_spawned(node, call):
    listed = call('GetSpawnables')
    uris = [getattr(each, 'entity_resource', each).uri for each in listed.spawnables]
    assert code(listed) == 1 and uris == [
        'article_doll', 'character', 'doll', 'man', 'walker', 'woman']
    for index, (uri, each) in enumerate(zip(uris, listed.spawnables, strict=True)):
        response = call('SpawnEntity', allow_renaming=True, **spawned(uri), initial_pose={
            'pose': {'position': {'x': -3.0 - index, 'z': 2.0}}})
        bounds = call('GetEntityBounds', entity=response.entity_name).bounds
        np.testing.assert_allclose([[p.x, p.y, p.z] for p in bounds.points],
                                   [[p.x, p.y, p.z] for p in each.spawn_bounds.points], atol=1e-9)
    robots = call('GetSpawnables', sources=[(ROOT / 'config').as_uri(), 'model://nothing'])
    assert code(robots) == 1 and 'model://nothing' in robots.result.error_message
    uris = [getattr(each, 'entity_resource', each).uri for each in robots.spawnables[6:]]
    assert uris == [(ROOT / 'config' / name).as_uri()
                    for name in ('character.glb', 'robot.urdf', 'walker.glb')]
    for uri in uris:
        response = call('SpawnEntity', allow_renaming=True, **spawned(uri), initial_pose={
            'pose': {'position': {'x': -20.0, 'y': len(uri) / 2, 'z': 2.0}}})
        assert code(response) == 1, response
        state = call('GetEntityState', entity=response.entity_name).state
        assert row(state)[:3] == pytest.approx([-20, len(uri) / 2, 2])


def test_a_robot_in_sdf_is_spawned_and_falls(node, call, tmp_path):
    path = tmp_path / 'flail.sdf'
    path.write_text(FLAIL_SDF)
    assert 'sdf' in call('GetSimulatorFeatures').features.spawn_formats
    listed = call('GetSpawnables', sources=[tmp_path.as_uri()]).spawnables[-1]
    assert getattr(listed, 'entity_resource', listed).uri == path.as_uri()
    for y, name, given in ((-5.0, 'by_uri', spawned(path.as_uri())),
                           (5.0, 'by_text', spawned('', FLAIL_SDF))):
        response = call('SpawnEntity', name=name, **given, initial_pose={
            'pose': {'position': {'x': -20.0, 'y': y, 'z': 3.0}}})
        assert code(response) == 1 and response.entity_name == name, response
        assert 'ground_plane' in response.result.error_message
        assert row(call('GetEntityState', entity=name).state)[:3] == pytest.approx([-20, y, 3])
        assert node.simulation.scene.dolls[-1].doll.mass == pytest.approx(5)
    call('StepSimulation', steps=20)
    scene, fallen = node.simulation.scene, 9.8 / 2 * (20 * node.simulation.step) ** 2
    for name in ('by_uri', 'by_text'):
        bones = [scene.bone_index(f'{name}/{bone}') for bone in ('handle', 'head')]
        # In the air both fall as a stone does, whatever holds them together.
        np.testing.assert_allclose(node.simulation.state.positions[bones, 2],
                                   [3 - fallen, 3.8 - fallen], atol=1e-6)
    assert code(call('SpawnEntity', name='two', **spawned('', TWO_FLAILS_SDF))) == 108


def test_several_are_spawned_and_those_that_cannot_be_are_named(node, call):
    time, before = node.simulation.time, node.simulation.state.rows.tobytes()
    text = to_urdf(load_doll('doll'))

    def request(name, uri='', text='', **fields):
        return {'name': name, 'entity_resource': {'uri': uri, 'resource_string': text}, **fields}

    response = call('SpawnEntities', spawn_requests=[
        request('anna', 'woman', initial_pose={'pose': {'position': {'x': -3.0, 'z': 2.0}}}),
        request('anna', 'man', allow_renaming=True,
                initial_pose={'pose': {'position': {'x': -4.0, 'z': 2.0}}}),
        request('anna', 'man'), request('limp', text=text), request('', 'nowhere')])
    assert code(response) == 150 and '2 of 5' in response.result.error_message
    assert [(code(each), each.entity_name) for each in response.results] == [
        (1, 'anna'), (1, 'anna_2'), (101, ''), (1, 'limp'), (2, '')]
    assert [each.name for each in node.simulation.scene.dolls] == ['man', 'anna', 'anna_2', 'limp']
    assert node.simulation.state.rows.tobytes().startswith(before)
    assert node.simulation.time == time
    assert row(call('GetEntityState', entity='anna_2').state)[:3] == pytest.approx([-4, 0, 2])
    assert code(call('SpawnEntities')) == 1


def test_with_another_engine_nothing_is_spawned_and_the_features_say_so(node, call):
    assert {0, 1, 9, 14, 23, 50} <= set(call('GetSimulatorFeatures').features.features)
    node.set_parameters([Parameter('engine', value='bullet')])
    assert not {0, 1, 9, 14, 23, 50} & set(call('GetSimulatorFeatures').features.features)
    response = call('SpawnEntity', **spawned('woman'))
    assert code(response) == 0 and 'expected rigid' in response.result.error_message
    assert code(call('DeleteEntity', entity='man')) == 0


def test_the_lines_of_the_documentation_are_served(node, peer, call):
    """In their order; the action by its own test."""
    text = Path(ROOT / 'docs/simulation_interfaces.md').read_text()
    lines = re.findall(r"^ros2 service call /ragdoll/(\w+) simulation_interfaces/srv/(\w+)"
                       r"(?: '(.*)')?$", text, re.MULTILINE)
    assert len(lines) == text.count('ros2 service call')
    for topic, name, fields in lines:
        given = yaml.safe_load(fields or '{}')
        if not FLAGS and name == 'LoadWorld':
            given = given['world_resource']
        if not FLAGS and name == 'SpawnEntity':  # SpawnEntities is the same in both
            given |= given.pop('entity_resource')
        if not FLAGS and name == 'SetEntityState':
            given = {key: value for key, value in given.items() if not key.startswith('set_')}
        assert topic == snake_case(name)
        response = call(name, **given)
        assert not hasattr(response, 'result') or code(response) == 1, (name, response)
        if name == 'GetEntities':
            assert list(response.entities) == ['man']
        if name == 'SetEntityState':
            got = row(call('GetEntityState', entity='man').state)
            assert (got[2], got[7]) == (3, pytest.approx(1))
            assert rotation.angle_between(np.array(got[3:7]), np.array([0, 0, 0, 1])) < 1e-9
    assert not node.paused


def rubbish(chance, kind):
    """A value of a field's type that may be anything."""
    if kind.startswith('sequence<'):
        return [rubbish(chance, kind[9:-1]) for _ in range(chance.randrange(4))]
    if kind in ('double', 'float'):
        return chance.choice([0.0, 1.0, -1e300, math.nan, math.inf, 1e-300, chance.gauss(0, 5)])
    if kind == 'boolean':
        return chance.random() < 0.5
    if kind == 'string':
        return chance.choice(['', 'man', 'man/head', 'step_1', 'world', 'drop', '/etc/passwd', '((',
                              '[', 'x' * 5000, '\u2603', 'http://[', 'file://', '/', '\\', '.*'])
    if kind.startswith('uint'):
        return min(chance.choice([0, 1, 2, 4, 7, 100, 255]), 255)
    if kind.startswith('int'):
        return chance.choice([-1, 0, 1])
    package, name = kind.split('/')
    made = getattr(__import__(f'{package}.msg', fromlist=[name]), name)()
    for field, inner in made.get_fields_and_field_types().items():
        setattr(made, field, rubbish(chance, inner))
    return made


def test_nothing_that_is_called_harms_the_node(node, peer):
    """Every service but the one that quits, with anything in every field; states stay finite."""
    chance = random.Random(7)
    names = [name for name in dir(srv) if name[0].isupper()
             and f'/ragdoll/{snake_case(name)}' in dict(node.get_service_names_and_types())]
    assert len(names) == 20
    for count in range(600):
        name = names[count % 20]
        request = getattr(srv, name).Request()
        for field, kind in request.get_fields_and_field_types().items():
            setattr(request, field, rubbish(chance, kind))
        if name != 'SetSimulationState' or request.state.state != 3:
            peer.call(getattr(srv, name), f'/ragdoll/{snake_case(name)}', request)
    if not node.has_world:
        node.set_parameters([Parameter('scene', value='drop')])
    node.pause(True)
    before = node.simulation.time
    response = peer.call(srv.StepSimulation, '/ragdoll/step_simulation',
                         srv.StepSimulation.Request())
    assert code(response) == 1
    assert node.simulation.time == before + node.simulation.tick
    assert np.isfinite(node.simulation.state.rows).all()


@pytest.mark.parametrize('loads', [False, True])
def test_quitting_ends_the_process_with_0(peer, tmp_path, nothing_runs_on, loads):
    """Also while a world loads."""
    process = start('node', '--ros-args', '-r', '__ns:=/other')
    if loads:
        client = peer.create_client(srv.LoadWorld, '/other/ragdoll/load_world')
        peer.wait(client.service_is_ready)
        request = srv.LoadWorld.Request()
        fill(request, resource(large(tmp_path)))
        client.call_async(request)
        peer.wait(lambda: peer.call(
            srv.GetSimulationState, '/other/ragdoll/get_simulation_state',
            srv.GetSimulationState.Request()).state.state == 5)
    request = srv.SetSimulationState.Request()
    request.state.state = msg.SimulationState.STATE_QUITTING
    assert code(peer.call(srv.SetSimulationState, '/other/ragdoll/set_simulation_state',
                          request)) == 1
    assert process.wait(30) == 0
