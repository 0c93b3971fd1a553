"""Asks a node: its parameters and services, without waiting where nobody has to."""
from __future__ import annotations

import queue
from collections.abc import Callable, Sequence

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import SetBool, Trigger

from ....model import errors

PATIENCE = 20.0
"""s that an answer may take: a large scene is built before the node gives it."""


class Refused(errors.RagdollError):
    """What the node will not do, with its reason; or there is no answer."""


class Ask:
    """The services of the node ``name``. Answers come in the thread that spins ``node``."""

    def __init__(self, node: Node, name: str) -> None:
        self._name = name
        self._get = node.create_client(GetParameters, f'{name}/get_parameters')
        self._set = node.create_client(SetParametersAtomically, f'{name}/set_parameters_atomically')
        self._triggers = {service: node.create_client(Trigger, f'{name}/{service}')
                          for service in ('reset', 'step')}
        self._pause = node.create_client(SetBool, f'{name}/pause')

    def trigger(self, service: str) -> None:
        """Call ``reset`` or ``step``."""
        self._send(self._triggers[service], Trigger.Request())

    def pause(self, wanted: bool) -> bool:
        """Hold the node's time, or let it go on; False if there is no node that could."""
        return self._send(self._pause, SetBool.Request(data=wanted))

    def parameters(self, names: Sequence[str], take: Callable[[dict], None]) -> None:
        """Ask for parameters by name; no answer if there is no node."""
        def answered(answer: GetParameters.Response) -> None:
            if len(answer.values) == len(names):
                take({name: parameter_value_to_python(value)
                      for name, value in zip(names, answer.values, strict=True)})
        self._send(self._get, GetParameters.Request(names=list(names)), answered)

    def set(self, name: str, value: object, take: Callable[[object], None] | None = None) -> bool:
        """Set a parameter without waiting; a refusal is in the node's diagnostics, too."""
        return self._send(self._set, SetParametersAtomically.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]), take)

    def set_and_wait(self, name: str, value: object) -> None:
        """Set a parameter; Refused, with the node's reason, if it will not. Not for callbacks."""
        answers: queue.SimpleQueue[SetParametersAtomically.Response] = queue.SimpleQueue()
        if not self.set(name, value, answers.put):
            raise Refused(f'there is no node `{self._name}` to ask')
        try:
            result = answers.get(timeout=PATIENCE).result
        except queue.Empty:
            raise Refused(f'the node `{self._name}` does not answer') from None
        if not result.successful:
            raise Refused(result.reason)

    def _send(self, client: Client, request: object,
              take: Callable[[object], None] | None = None) -> bool:
        """Ask; False if there is no node that could answer."""
        if not client.service_is_ready():
            return False
        future = client.call_async(request)
        if take is not None:
            def answered(done: object) -> None:
                if done.result() is not None:
                    take(done.result())
            future.add_done_callback(answered)
        return True
