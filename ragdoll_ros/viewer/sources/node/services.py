"""Client of a node's services and parameters, mostly without waiting."""
from __future__ import annotations

import queue
import time
from collections.abc import Callable, Sequence

from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import SetBool, Trigger

from ....model import errors

PATIENCE = 10.0
"""s that a trigger waits for its service: to discover one takes up to 3 s, on a busy machine 10."""

RESPONSE_TIMEOUT = 60.0
"""s: the node builds a scene before it responds, beside its ticks: .1 s for a doll on an idle
machine, 14 s seen on one with four times the work that it can do."""


class Refused(errors.RagdollError):
    """The node refused a request, with its reason, or did not respond."""


class NodeServices:
    """The services of the node ``name``. Callbacks run in the thread that spins ``node``."""

    def __init__(self, node: Node, name: str) -> None:
        self._name = name
        self._get = node.create_client(GetParameters, f'{name}/get_parameters')
        self._set = node.create_client(SetParametersAtomically, f'{name}/set_parameters_atomically')
        self._triggers = {service: node.create_client(Trigger, f'{name}/{service}')
                          for service in ('reset', 'step', 'go_limp')}
        self._pause = node.create_client(SetBool, f'{name}/pause')
        self._waiting: dict[str, float] = {}
        """When triggers were asked for whose services are not known yet, s of the steady clock."""

    def trigger(self, service: str) -> None:
        """Call ``reset``, ``step`` or ``go_limp``; if its service is unknown, `retry` does it."""
        if not self._send(self._triggers[service], Trigger.Request()):
            self._waiting[service] = time.monotonic()

    def retry(self) -> None:
        """Call waiting services that are known now; drop what has waited for over PATIENCE."""
        for service, asked in list(self._waiting.items()):
            if time.monotonic() - asked > PATIENCE or self._send(
                    self._triggers[service], Trigger.Request()):
                self._waiting.pop(service, None)

    def pause(self, paused: bool) -> bool:
        """Pause or resume; False if there is no node."""
        return self._send(self._pause, SetBool.Request(data=paused))

    def get_parameters(self, names: Sequence[str], on_values: Callable[[dict], None]) -> None:
        """Get parameters by name; no callback if there is no node."""
        def on_response(response: GetParameters.Response) -> None:
            if len(response.values) == len(names):
                on_values({name: parameter_value_to_python(value)
                           for name, value in zip(names, response.values, strict=True)})
        self._send(self._get, GetParameters.Request(names=list(names)), on_response)

    def set_parameter(self, name: str, value: object,
                      on_response: Callable[[object], None] | None = None) -> bool:
        """Set a parameter without waiting; the node's diagnostics report a refusal, too."""
        return self._send(self._set, SetParametersAtomically.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]), on_response)

    def set_parameter_and_wait(self, name: str, value: object) -> None:
        """Set a parameter; Refused with the node's reason. Must not be called in a callback."""
        responses: queue.SimpleQueue[SetParametersAtomically.Response] = queue.SimpleQueue()
        if not self.set_parameter(name, value, responses.put):
            raise Refused(f'there is no node `{self._name}`')
        try:
            result = responses.get(timeout=RESPONSE_TIMEOUT).result
        except queue.Empty:
            raise Refused(f'the node `{self._name}` does not respond') from None
        if not result.successful:
            raise Refused(result.reason)

    def _send(self, client: Client, request: object,
              on_response: Callable[[object], None] | None = None) -> bool:
        """Send a request; False if there is no node."""
        if not client.service_is_ready():
            return False
        future = client.call_async(request)
        if on_response is not None:
            def on_done(done: object) -> None:
                if done.result() is not None:
                    on_response(done.result())
            future.add_done_callback(on_done)
        return True
