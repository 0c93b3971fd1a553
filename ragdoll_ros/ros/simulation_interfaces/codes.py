"""Numbers of the standard: results and features. Each equals its constant in the messages."""
from __future__ import annotations

from enum import IntEnum

from ...model.errors import RagdollError


class Code(IntEnum):
    """Results of every service; a service may have more of its own, above 100."""

    FEATURE_UNSUPPORTED = 0
    OK = 1
    NOT_FOUND = 2
    INCORRECT_STATE = 3
    OPERATION_FAILED = 4


class Feature(IntEnum):
    """Features that a server may report; those of the standard that are missing here are not
    implemented.
    """

    SPAWNING = 0
    DELETING = 1
    ENTITY_TAGS = 4
    ENTITY_BOUNDS = 5
    ENTITY_BOUNDS_BOX = 6
    ENTITY_CATEGORIES = 8
    SPAWNING_RESOURCE_STRING = 9
    ENTITY_STATE_GETTING = 10
    ENTITY_STATE_SETTING = 11
    ENTITY_INFO_GETTING = 12
    ENTITY_INFO_SETTING = 13
    SPAWNABLES = 14
    SIMULATION_RESET = 20
    SIMULATION_RESET_STATE = 22
    SIMULATION_RESET_SPAWNED = 23
    SIMULATION_STATE_GETTING = 24
    SIMULATION_STATE_SETTING = 25
    SIMULATION_STATE_PAUSE = 26
    STEP_SIMULATION_SINGLE = 31
    STEP_SIMULATION_MULTIPLE = 32
    STEP_SIMULATION_ACTION = 33
    WORLD_LOADING = 40
    WORLD_UNLOADING = 43
    WORLD_INFO_GETTING = 44
    AVAILABLE_WORLDS = 45
    SPAWNING_ENTITIES = 50


class Refusal(RagdollError):
    """A request that is not carried out: ``code`` of the result, and the reason."""

    def __init__(self, code: int, reason: object) -> None:
        super().__init__(str(reason))
        self.code = int(code)
