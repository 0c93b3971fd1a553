"""Parquet in the layout of LeRobot v3: an episode is a fall, a data file is a shard.

The layout, not the code, of https://github.com/huggingface/lerobot (Apache-2.0): meta/info.json,
meta/stats.json, meta/tasks.parquet, meta/episodes/chunk-000/file-000.parquet and
data/chunk-000/file-000.parquet. Recorded real numbers are float32, those of labels float64. All
falls have equally many frames, so the indices of a shard follow from its number.

Labels in meta/episodes: onset, impact (first contact) and rest are the frames of Phases;
impact_frames and impact_speeds (m/s downwards) are those of each bone's first contact. Of the worst
impact: region, other side, speed, peak force and ratio. Of the head: hic15. Of each region: largest
peak force and ratio. Of each contact: time, bone, other side, speed and energies.
"""
import io
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from ...model.errors import WrongForm
from ...model.scene import SECOND
from ..fall import SAMPLE_NAMES, Fall, samples_by_frame
from ..recipe import Recipe

FILES_PER_CHUNK = 1000
PLACE = 'chunk-{chunk_index:03d}/file-{file_index:03d}.parquet'
DATA, EPISODES = f'data/{PLACE}', f'meta/episodes/{PLACE}'
STATISTICS = ('min', 'max', 'mean', 'std', 'count')
POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')
VELOCITY = ('vx', 'vy', 'vz', 'wx', 'wy', 'wz')
LABELS = ('onset', 'impact', 'rest', 'direction_deg', 'impact_frames', 'impact_speeds', 'hic15',
          'region_peak_forces_N', 'region_ratios')


CONTACTS = {
    'contact_times_s': (lambda hit: hit.time / SECOND, pa.float64()),
    'contact_bones': (lambda hit: hit.bone, pa.string()),
    'contact_against': (lambda hit: hit.against, pa.string()),
    'contact_speeds_m_s': (lambda hit: hit.speed, pa.float64()),
    'contact_energies_J': (lambda hit: hit.approach_energy, pa.float64()),
    'contact_losses_J': (lambda hit: hit.lost_energy, pa.float64())}
"""Columns with a value of each impact of a fall, and their types."""


def shard_files(recipe: Recipe, falls: list[Fall], shard: int) -> dict[str, bytes]:
    """Data file and episodes file of a shard."""
    place = dict(zip(('chunk_index', 'file_index'), divmod(shard, FILES_PER_CHUNK), strict=True))
    tables = [_frames(recipe, fall) for fall in falls]
    rows = [_episode(recipe, fall, place) for fall in falls]
    return {DATA.format(**place): _parquet(pa.concat_tables(tables), recipe.frames),
            EPISODES.format(**place): _parquet(pa.Table.from_pylist(rows, _episode_schema(rows[0])),
                                               len(rows))}


def last_files(recipe: Recipe, count: int, folder: Path) -> dict[str, bytes]:
    """Metadata of the whole data set."""
    names = sorted(folder.glob('meta/episodes/*/*.parquet'))
    first = parquet.read_table(names[0]).slice(0, 1).to_pylist()[0]
    keys = [key.split('/')[1] for key in first if key.startswith('stats/') and key.endswith('/min')]
    stats = _whole_stats(names, keys)
    info = {
        'codebase_version': 'v3.0', 'robot_type': recipe.dolls[0].name, 'total_episodes': count,
        'total_frames': count * recipe.frames, 'total_tasks': 1, 'chunks_size': FILES_PER_CHUNK,
        'data_files_size_in_mb': 100, 'video_files_size_in_mb': 200, 'fps': recipe.rate,
        'splits': {'train': f'0:{count}'}, 'data_path': DATA, 'video_path': None,
        'features': _features(folder / DATA.format(chunk_index=0, file_index=0))}
    return {'meta/info.json': _json(info), 'meta/stats.json': _json(stats),
            'meta/tasks.parquet': _tasks(recipe.name)}


def read_labels(folder: Path) -> dict[str, np.ndarray]:
    """Labels of a data set's f falls: onset, impact and rest (f,) in frames, direction_deg (f,),
    impact_frames (f, n) and impact_speeds (f, n) m/s; hic15 (f,), region_peak_forces_N (f, r) and
    region_ratios (f, r); NaN where there is none.
    """
    paths = sorted(folder.glob('meta/episodes/*/*.parquet'))
    if missing := set(LABELS) - set(parquet.read_schema(paths[0]).names):
        raise WrongForm('labels', str(folder), f'labels with {", ".join(missing)}: generate the '
                        'data set again')
    table = pa.concat_tables(parquet.read_table(path, columns=list(LABELS)) for path in paths)
    return {key: np.array(table.column(key).to_pylist(), float) for key in LABELS}


def read_regions(folder: Path) -> list[str]:
    """The r regions of the body in a data set's labels."""
    path = min(folder.glob('meta/episodes/*/*.parquet'))
    return parquet.read_table(path, columns=['regions']).slice(0, 1).to_pylist()[0]['regions']


def read_forces(folder: Path, recipe: Recipe, imu: str) -> Iterator[np.ndarray]:
    """Yield, for each fall of a data set, the specific force (s, 3) m/s^2 that a sensor reads, in
    the sensor's axes; the first sample is that at the start.
    """
    for path in sorted(folder.glob('data/*/*.parquet')):
        table = parquet.read_table(path, columns=[f'observation.imu.{imu}'])
        flat = table.column(0).combine_chunks().flatten().to_numpy(zero_copy_only=False)
        for fall in flat.reshape(-1, recipe.frames * recipe.samples_per_frame, len(SAMPLE_NAMES)):
            yield fall[recipe.samples_per_frame - 1:, :3].astype(float)


def _frames(recipe: Recipe, fall: Fall) -> pa.Table:
    """Rows of one fall."""
    count = recipe.frames
    made = {f'observation.{column.name}': _array(column) for column in columns(recipe, fall)}
    frames = np.arange(count)
    made['observation.valid'] = pa.array(frames < fall.valid)
    made['timestamp'] = pa.array(fall.times.astype(np.float32))
    made['frame_index'] = pa.array(frames)
    made['episode_index'] = pa.array(np.full(count, fall.number))
    made['index'] = pa.array(fall.number * count + frames)
    made['task_index'] = pa.array(np.zeros(count, np.int64))
    table = pa.table(made)
    names = {f'observation.{column.name}': list(column.names) for column in columns(recipe, fall)}
    return table.replace_schema_metadata({'names': json.dumps(names)})


@dataclass(frozen=True)
class Column:
    """One quantity in t frames: ``values`` (t, m), float or bool, with ``names`` of m numbers."""

    name: str
    values: np.ndarray
    names: tuple[str, ...]


def columns(recipe: Recipe, fall: Fall) -> list[Column]:
    """Columns that the recipe records of a fall, without those that its doll lacks."""
    bones, angles = fall.scene.bone_names, fall.scene.angle_names
    frames = len(fall.times)
    made = {
        'poses': (fall.states[:, :, :7], _each(bones, POSE)),
        'velocities': (fall.states[:, :, 7:], _each(bones, VELOCITY)),
        'angles': (fall.angles, angles), 'rates': (fall.rates, angles),
        'touching': (fall.touching, bones)}
    return [Column(name, made[name][0].reshape(frames, -1), tuple(made[name][1]))
            for name in recipe.recorded if made[name][1]] + [
                Column(f'imu.{mount["name"]}', samples_by_frame(fall, imu).reshape(frames, -1),
                       _sample_names(recipe))
                for imu, mount in enumerate(recipe.imus)]


def _each(bones: tuple[str, ...], parts: tuple[str, ...]) -> list[str]:
    return [f'{bone}.{part}' for bone in bones for part in parts]


def _sample_names(recipe: Recipe) -> tuple[str, ...]:
    """Names of a sensor's numbers in a frame, with the sample's number if a frame has several."""
    if recipe.samples_per_frame == 1:
        return SAMPLE_NAMES
    return tuple(f'{name}_{sample}' for sample in range(recipe.samples_per_frame)
                 for name in SAMPLE_NAMES)


def _array(column: Column) -> pa.Array:
    flags = column.values.dtype == bool
    flat = column.values.ravel() if flags else column.values.ravel().astype(np.float32)
    return pa.FixedSizeListArray.from_arrays(pa.array(flat), column.values.shape[1])


def _episode(recipe: Recipe, fall: Fall, place: dict[str, int]) -> dict:
    """Row of a fall in meta/episodes: LeRobot's columns, then this package's labels."""
    first = fall.number * recipe.frames
    speeds = -fall.impact_velocities[:, 2]
    row = {
        'episode_index': fall.number, 'tasks': [recipe.name], 'length': recipe.frames,
        'dataset_from_index': first, 'dataset_to_index': first + recipe.frames,
        **{f'{table}/{key}': value for table in ('data', 'meta/episodes')
           for key, value in place.items()},
        'onset': fall.phases.onset, 'impact': fall.phases.impact, 'rest': fall.phases.rest,
        'failure': fall.failure, 'valid_frames': fall.valid,
        'energy_excess_J': fall.energy_excess,
        'direction_deg': fall.direction,
        'impact_frames': [None if np.isnan(frame) else int(frame) for frame in
                          fall.impact_frames.tolist()],
        'impact_speeds': [None if np.isnan(speed) else speed for speed in speeds.tolist()],
        **_impacts(fall),
        'drawn': json.dumps(fall.drawn, sort_keys=True)}
    for column in columns(recipe, fall):
        values = column.values[:fall.valid].astype(float)
        known = len(values) > 0
        for name in STATISTICS[:-1]:
            row[f'stats/observation.{column.name}/{name}'] = getattr(values, name)(
                axis=0).tolist() if known else [None] * values.shape[1]
        row[f'stats/observation.{column.name}/count'] = [fall.valid]
    return row


def _impacts(fall: Fall) -> dict:
    """Columns of the worst impacts, None where there is none, and lists of all contacts."""
    worst, regions = fall.worst_impacts.worst, fall.worst_impacts.by_region
    hic15 = fall.worst_impacts.hic15
    return {
        'worst_region': worst and worst.region, 'worst_against': worst and worst.against,
        'worst_speed_m_s': worst and worst.speed, 'worst_peak_force_N': worst and worst.peak_force,
        'worst_ratio': worst and worst.ratio, 'hic15': None if np.isnan(hic15) else hic15,
        'regions': list(regions),
        'region_peak_forces_N': [impact and impact.peak_force for impact in regions.values()],
        'region_ratios': [impact and impact.ratio for impact in regions.values()],
        **{name: [value(hit) for hit in fall.contacts] for name, (value, _) in CONTACTS.items()}}


def _episode_schema(row: dict) -> pa.Schema:
    """Types of an episode's columns, even if a shard has no values of them."""
    kinds = {str: pa.string(), int: pa.int64(), float: pa.float64(), type(None): pa.int64()}
    fields = {key: kinds[type(value)] for key, value in row.items() if not isinstance(value, list)}
    fields.update(tasks=pa.list_(pa.string()), impact_speeds=pa.list_(pa.float64()),
                  impact_frames=pa.list_(pa.int64()), valid_frames=pa.int64(),
                  worst_region=pa.string(), worst_peak_force_N=pa.float64(),
                  worst_ratio=pa.float64(), hic15=pa.float64(), regions=pa.list_(pa.string()),
                  worst_against=pa.string(), worst_speed_m_s=pa.float64(),
                  region_peak_forces_N=pa.list_(pa.float64()),
                  region_ratios=pa.list_(pa.float64()),
                  **{name: pa.list_(kind) for name, (_, kind) in CONTACTS.items()})
    for key in row:
        if key.startswith('stats/'):
            fields[key] = pa.list_(pa.int64() if key.endswith('/count') else pa.float64())
    return pa.schema([(key, fields[key]) for key in row])


def _whole_stats(paths: list[Path], keys: list[str]) -> dict:
    """Statistics of all frames, from those of the episodes weighted by their counts."""
    whole = {}
    for key in keys:
        parts = {name: [] for name in STATISTICS}
        for path in paths:
            table = parquet.read_table(path, columns=[f'stats/{key}/{name}' for name in STATISTICS])
            for name in STATISTICS:
                parts[name] += table.column(f'stats/{key}/{name}').to_pylist()
        low, high, mean, deviation, count = (np.array(parts[name], float) for name in STATISTICS)
        known = count[:, 0] > 0
        low, high, mean, deviation, count = (
            part[known] for part in (low, high, mean, deviation, count))
        total = count.sum()
        middle = (count * mean).sum(axis=0) / total
        spread = (count * (deviation ** 2 + (mean - middle) ** 2)).sum(axis=0) / total
        whole[key] = {'min': low.min(axis=0).tolist(), 'max': high.max(axis=0).tolist(),
                      'mean': middle.tolist(), 'std': np.sqrt(spread).tolist(),
                      'count': [int(total)]}
    return whole


def _features(path: Path) -> dict:
    """LeRobot's description of each column."""
    schema = parquet.read_schema(path)
    names = json.loads(schema.metadata[b'names'])
    features = {}
    for field in schema:
        many = pa.types.is_fixed_size_list(field.type)
        kind = field.type.value_type if many else field.type
        features[field.name] = {
            'dtype': {'float': 'float32'}.get(str(kind), str(kind)),
            'shape': [field.type.list_size if many else 1], 'names': names.get(field.name)}
    return features


def _tasks(name: str) -> bytes:
    """The table of the one task, which is the index when read by pandas."""
    columns = [{'name': 'task_index', 'field_name': 'task_index', 'pandas_type': 'int64',
                'numpy_type': 'int64', 'metadata': None},
               {'name': 'task', 'field_name': 'task', 'pandas_type': 'unicode',
                'numpy_type': 'object', 'metadata': None}]
    about = {'index_columns': ['task'], 'column_indexes': [], 'columns': columns,
             'creator': {'library': 'pyarrow', 'version': pa.__version__}, 'pandas_version': None}
    table = pa.table({'task_index': pa.array([0]), 'task': pa.array([name])})
    return _parquet(table.replace_schema_metadata({'pandas': json.dumps(about)}), 1)


def _parquet(table: pa.Table, rows_per_group: int) -> bytes:
    """Encode a table; the bytes depend on the arguments and pyarrow's version alone."""
    stream = io.BytesIO()
    parquet.write_table(table, stream, row_group_size=rows_per_group, compression='zstd')
    return stream.getvalue()


def _json(data: object) -> bytes:
    return (json.dumps(data, indent=2) + '\n').encode()
