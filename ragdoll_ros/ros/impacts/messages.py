"""Impacts as a DiagnosticArray: a status for each."""
from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from ...model.biomechanical_limits import BiomechanicalLimits
from ...model.scene import SECOND
from ...physics.sensors.head_injury import HIC15, HIC36
from ..messages.convert import to_header

if TYPE_CHECKING:
    from ...physics.sensors.impacts import Impact


def to_impacts(frame: str, stamp: int, impacts: Iterable[Impact],
               limits: BiomechanicalLimits) -> DiagnosticArray:
    """A status for each impact: level WARN where the ratio to the limit is above 1, else OK."""
    return DiagnosticArray(header=to_header(stamp, frame),
                           status=[_status(impact, limits) for impact in impacts])


def _status(impact: Impact, limits: BiomechanicalLimits) -> DiagnosticStatus:
    above = impact.ratio > 1
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if above else DiagnosticStatus.OK, name=impact.bone,
        hardware_id=impact.doll, message=impact_text(impact),
        values=[KeyValue(key=key, value=value) for key, value in _values(impact, limits).items()])


def impact_text(impact: Impact) -> str:
    """What met, and the ratio to the limit, if there is one."""
    where = f'{impact.region or impact.bone} against {impact.against}'
    if math.isnan(impact.ratio):
        return f'{where}: no limit is known'
    return f'{where}: {impact.ratio:.3g} of the limit'


def _values(impact: Impact, limits: BiomechanicalLimits) -> dict[str, str]:
    """Return the figures as text, with units in the keys. For a bone without a region those that
    need one are 'unknown': peak force, duration, limit, ratio.
    """
    figures = {
        'approach_speed_m_s': impact.speed, 'effective_mass_kg': impact.effective_mass,
        'impulse_N_s': impact.impulse, 'peak_force_N': impact.peak_force,
        'duration_s': impact.duration, 'limit_N': impact.limit, 'ratio': impact.ratio}
    region = limits.regions.get(impact.region)
    if region is not None and region.head:
        figures |= {'hic15': impact.head_injury(HIC15), 'hic36': impact.head_injury(HIC36)}
    return {'simulated_time': f'{impact.time / SECOND:.9f}', 'region': impact.region or 'unknown',
            'against': impact.against, 'point_m': _vector(impact.point),
            'normal': _vector(impact.normal),
            **{key: _number(value) for key, value in figures.items()},
            'source_of_limits': limits.source if region is not None else 'unknown'}


def _number(value: float) -> str:
    return f'{value:.6g}' if math.isfinite(value) else 'unknown'


def _vector(values: tuple[float, float, float]) -> str:
    return ' '.join(f'{value:.6g}' for value in values)
