"""A glTF animation whose tracks have the same times."""
import numpy as np

from .glb import Glb


class GltfAnimation:
    """Collects tracks; ``end`` adds the animation to the file.

    Args:
        glb: the file.
        times: (k,) s, of the keys of all tracks.
    """

    def __init__(self, glb: Glb, times: np.ndarray) -> None:
        self.glb = glb
        self._times = glb.accessor(times.astype(np.float32))
        self._channels: list[dict] = []
        self._samplers: list[dict] = []

    def add(self, node: int, tracks: dict[str, np.ndarray]) -> None:
        """Add float32 tracks (k, 3 or 4) of a node's ``translation`` and ``rotation``."""
        for path, track in tracks.items():
            self._channels.append({'sampler': len(self._samplers),
                                   'target': {'node': node, 'path': path}})
            self._samplers.append({'input': self._times, 'output': self.glb.accessor(track)})

    def end(self, name: str) -> None:
        """Add the animation to the file."""
        self.glb.add('animations', name=name, channels=self._channels, samplers=self._samplers)


def continuous(orientations: np.ndarray) -> np.ndarray:
    """The same rotations (k, ..., 4), with the sign of q that is nearer to the instant before."""
    steps = (orientations[1:] * orientations[:-1]).sum(axis=-1)
    signs = np.cumprod(np.where(steps < 0, -1.0, 1.0), axis=0)
    return np.concatenate([orientations[:1], orientations[1:] * signs[..., None]])
