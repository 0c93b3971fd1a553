"""Which entities a query asks for: by name, category, tags and volume, all of them together."""
from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import IntEnum

from ...model.scene import Scene
from ...model.state import State
from .bounds import Volume, overlapping
from .codes import Code, Refusal
from .entities import Entities, Entity
from .pattern import Pattern


class TagsMode(IntEnum):
    """Whether one tag is enough."""

    ANY = 0
    ALL = 1


@dataclass(frozen=True)
class Filters:
    """Conditions on entities; one that is empty or None is always met."""

    name: str = ''
    """A POSIX extended regular expression, looked for in the name."""
    categories: Collection[int] = ()
    tags: Collection[str] = ()
    tags_mode: int = TagsMode.ANY
    volume: Volume | None = None

    def select(self, entities: Entities, scene: Scene, state: State) -> list[Entity]:
        """Entities that pass all filters. Raises Refusal for a filter that is not valid."""
        if self.tags_mode not in list(TagsMode):
            raise Refusal(Code.FEATURE_UNSUPPORTED,
                          f'tags.filter_mode: {self.tags_mode}; expected 0 (any) or 1 (all)')
        pattern = Pattern(self.name)
        found = [entity for entity in entities if pattern.is_in(entity.name)
                 and self._has_kind(entities, entity)]
        if self.volume is None:
            return found
        return list(overlapping(found, self.volume, scene, state))

    def _has_kind(self, entities: Entities, entity: Entity) -> bool:
        """Whether it has one of the categories, and the tags."""
        info = entities.info(entity)
        tagged = any if self.tags_mode == TagsMode.ANY else all
        return ((not self.categories or info.category in self.categories)
                and (not self.tags or tagged(tag in info.tags for tag in self.tags)))
