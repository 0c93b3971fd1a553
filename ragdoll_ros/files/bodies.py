"""`bodies:` of a scene: static bodies, each alone or repeated."""
from ..model.errors import ModelError, OutOfRange
from ..model.rotation import IDENTITY
from ..model.static_body import StaticBody
from .doll import build_shape, shape_data
from .repeat import repeated
from .schema import entries, has_error_under, try_build

MOST_BODIES = 100_000


def build_bodies(data: dict, found: list[ModelError]) -> tuple[StaticBody, ...]:
    """The bodies of a scene's data. Appends every error to ``found``."""
    bodies: list[StaticBody] = []
    for index, entry in enumerate(entries(data, 'bodies')):
        where = f'bodies[{index}]'
        if has_error_under(found, where):
            continue
        first = try_build(found, where, _body, entry)
        if first:
            bodies += repeated(first, entry['repeat']) if 'repeat' in entry else [first]
        if len(bodies) > MOST_BODIES:
            found.append(OutOfRange(where, len(bodies), f'at most {MOST_BODIES} bodies in all'))
            break
    return tuple(bodies)


def body_data(body: StaticBody) -> dict:
    """A body as lists and numbers in the form of scene.schema.json."""
    optional = {'orientation': None if body.orientation == IDENTITY else list(body.orientation),
                'friction': body.friction, 'rolling_friction': body.rolling_friction,
                'restitution': body.restitution,
                'color': None if body.color is None else list(body.color)}
    return {'name': body.name, **shape_data(body.shape), 'position': list(body.position),
            **{key: value for key, value in optional.items() if value is not None}}


def _body(entry: dict) -> StaticBody:
    fields = {key: value for key, value in entry.items()
              if key not in ('shape', 'shapes', 'repeat')}
    return StaticBody(shape=build_shape(entry), **fields)
