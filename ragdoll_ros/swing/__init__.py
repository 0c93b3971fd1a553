"""Hair, tails and straps: cheap pendulums and springs that ride on bones and give poses back."""
from .chain import MODES, Link, Swing, strand
from .frames import Frames, Track
from .mount import Mount, mounts
from .pose import SwingState
from .swings import Swings

__all__ = ['MODES', 'Frames', 'Link', 'Mount', 'Swing', 'SwingState', 'Swings', 'Track', 'mounts',
           'strand']
