"""Anthropometric tables: masses of body segments in percent of the body's mass, their centres and
radii of gyration as fractions of their lengths, and body dimensions.

Masses, centres, radii of gyration and lengths: de Leva 1996, J Biomech 29:1223, table 4, of 100 men
(1.741 m, 73.0 kg) and 15 women (1.735 m, 61.9 kg), young and fit. Limb segments go from joint
centre to joint centre, the head from vertex to mid-gonion, the hand to the third metacarpal's head,
the foot from heel to toe. Percentiles and body dimensions: ANSUR II, the survey of US soldiers of
2012 (Gordon et al., NATICK/TR-15/007), that is of fit adults; the dimensions are means over its men
and women together.
"""
from dataclasses import dataclass
from types import SimpleNamespace

SEXES = ('female', 'male')


@dataclass(frozen=True)
class Segment:
    """A segment of the body; of a limb, that of one side."""

    mass: float
    """Percent of the body's."""
    length: float
    """m, of the sample's mean person."""
    centre: float
    """Distance of the centre of mass from the proximal end (the foot: from the heel), over the
    length."""
    sagittal: float
    transverse: float
    longitudinal: float
    """Radii of gyration about the centre of mass over the length: about the axis from back to
    front, from side to side, and along the segment. Of a foot that points down: in standing, its
    sagittal axis is vertical."""


@dataclass(frozen=True)
class Sample:
    """The mean person of a sample: height and body segments."""

    height: float
    """m"""
    segments: dict[str, Segment]
    """By name."""


MEN = Sample(1.741, {
    'head': Segment(6.94, 0.2033, 0.5976, 0.362, 0.376, 0.312),
    'chest': Segment(15.96, 0.1707, 0.2999, 0.716, 0.454, 0.659),
    'abdomen': Segment(16.33, 0.2155, 0.4502, 0.482, 0.383, 0.468),
    'pelvis': Segment(11.17, 0.1457, 0.6115, 0.615, 0.551, 0.587),
    'upper_arm': Segment(2.71, 0.2817, 0.5772, 0.285, 0.269, 0.158),
    'forearm': Segment(1.62, 0.2689, 0.4574, 0.276, 0.265, 0.121),
    'hand': Segment(0.61, 0.0862, 0.7900, 0.628, 0.513, 0.401),
    'thigh': Segment(14.16, 0.4222, 0.4095, 0.329, 0.329, 0.149),
    'shin': Segment(4.33, 0.4403, 0.4395, 0.251, 0.246, 0.102),
    'foot': Segment(1.37, 0.2581, 0.4415, 0.257, 0.245, 0.124)})
"""The trunk in three: to the xiphoid, to the omphalion, to the hips' middle."""

WOMEN = Sample(1.735, {
    'head': Segment(6.68, 0.2002, 0.5894, 0.330, 0.359, 0.318),
    'chest': Segment(15.45, 0.1425, 0.2077, 0.746, 0.502, 0.718),
    'abdomen': Segment(14.65, 0.2053, 0.4512, 0.433, 0.354, 0.415),
    'pelvis': Segment(12.47, 0.1815, 0.4920, 0.433, 0.402, 0.444),
    'upper_arm': Segment(2.55, 0.2751, 0.5754, 0.278, 0.260, 0.148),
    'forearm': Segment(1.38, 0.2643, 0.4559, 0.261, 0.257, 0.094),
    'hand': Segment(0.56, 0.0780, 0.7474, 0.531, 0.454, 0.335),
    'thigh': Segment(14.78, 0.3685, 0.3612, 0.369, 0.364, 0.162),
    'shin': Segment(4.81, 0.4386, 0.4352, 0.267, 0.263, 0.092),
    'foot': Segment(1.29, 0.2283, 0.4014, 0.299, 0.279, 0.139)})

SAMPLES = {'female': WOMEN, 'male': MEN}

TRUNK = ('chest', 'abdomen', 'pelvis')
UNPAIRED = ('head', *TRUNK)
"""Segments that the body has one of; it has two of the others."""

PERCENTILES = {
    'female': {5: (1.525, 51.3), 50: (1.626, 66.8), 95: (1.740, 87.1)},
    'male': {5: (1.648, 64.4), 50: (1.755, 84.6), 95: (1.870, 110.7)}}
"""Height, m, and mass, kg, at percentiles of ANSUR II."""

ANKLE_HEIGHT = 0.039
"""Height of the ankle joint above the sole over the standing height: Drillis and Contini
1966 (Body Segment Parameters, New York University, Report 1163.03)."""

BODY = SimpleNamespace(
    # circumferences
    head=570.04, neck=375.44, chest=1022.10, waist=914.50, buttock=1020.08, thigh=622.20,
    lower_thigh=406.48, calf=386.04, ankle=224.89, biceps=340.93, forearm=295.01, wrist=169.00,
    hand=203.86,
    # lengths
    chest_breadth=282.86, chest_depth=251.74, waist_breadth=317.75, waist_depth=229.67,
    hip_breadth=348.39, buttock_depth=241.62, foot_breadth=98.87, hand_length=189.29,
    hand_breadth=84.95)
"""Body dimensions, mm: means of ANSUR II, whose mean height (m) and mass (kg) are:"""

HEIGHT, MASS = 1.71441, 79.709


def mass_fractions(sex: str) -> dict[str, float]:
    """Return the fraction of the body's mass of each segment. A limb's is that of one side; the
    fractions of the whole body, both sides included, sum to 1.
    """
    table = SAMPLES[sex].segments
    whole = sum(part.mass * (1 if name in UNPAIRED else 2) for name, part in table.items())
    return {name: part.mass / whole for name, part in table.items()}
