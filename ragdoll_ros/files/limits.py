"""Biomechanical limits as YAML files (config/limits.schema.json)."""
from pathlib import Path

from ..model.biomechanical_limits import BiomechanicalLimits, BodyRegion
from ..model.errors import ModelError
from .config import LIMITS
from .schema import has_error_under, read_by_name, schema_errors, try_build, value_or_raise

DEFAULT_LIMITS = 'iso_ts_15066'


def load_limits(name: str | Path = DEFAULT_LIMITS) -> BiomechanicalLimits:
    """Read biomechanical limits from a YAML file.

    Args:
        name: path, or name of shipped limits in config/limits/.

    Returns:
        The limits.

    Raises:
        ModelErrors: all errors of the file, each with its path, its value, what is expected.

    Example:
        >>> load_limits().regions['chest'].transient_force
        280.0
    """
    data, path = read_by_name(str(name), LIMITS)
    return value_or_raise(path, *build_limits(data))


def build_limits(data: object) -> tuple[BiomechanicalLimits | None, list[ModelError]]:
    """Build limits from the data of a YAML file; else None and every error."""
    found = schema_errors('limits', data)
    if found or not isinstance(data, dict):
        return None, found
    regions = {name: try_build(found, f'regions.{name}', BodyRegion, **fields)
               for name, fields in data['regions'].items()
               if not has_error_under(found, f'regions.{name}')}
    if found:
        return None, found
    return try_build(found, '', BiomechanicalLimits, data['source'], regions), found
