"""Task codes of KFall and SisFall for falls: by the recipe's cause and the fall's direction.

KFall: Yu, Jang, Xiong 2021 (10.3389/fnagi.2021.692865), tasks 20 to 34 are falls F01 to F15; tasks
1 to 19, 35 and 36 are activities. SisFall: Sucerquia, Lopez, Vargas-Bonilla 2017
(10.3390/s17010198), F01 to F15.
"""
from dataclasses import dataclass

from ..fall import Fall
from ..recipe import Recipe

FORWARDS, LATERAL, BACKWARDS = range(3)


@dataclass(frozen=True)
class TaskCode:
    """Code of a kind of fall in both data sets, and KFall's description of it."""

    kfall: int
    sisfall: int
    description: str

    @property
    def letter(self) -> str:
        """'F' for a fall, 'D' for none."""
        return 'F' if self.sisfall else 'D'


_TRIP = TaskCode(30, 4, 'Forward fall while walking caused by a trip')
_SLIPS = (TaskCode(32, 1, 'Forward fall while walking caused by a slip'),
          TaskCode(33, 3, 'Lateral fall while walking caused by a slip'),
          TaskCode(34, 2, 'Backward fall while walking caused by a slip'))

NO_FALL = TaskCode(0, 0, 'no fall')
"""Of what has no impact: a code that neither data set has, and that no reader takes for a fall."""

CAUSES = {
    'faint': (TaskCode(28, 6, 'Vertical (forward) fall while walking caused by fainting'),) * 3,
    'faint_sitting': (TaskCode(25, 13, 'Forward fall while sitting, caused by fainting'),
                      TaskCode(26, 15, 'Lateral fall while sitting, caused by fainting'),
                      TaskCode(27, 14, 'Backward fall while sitting, caused by fainting')),
    'trip': (_TRIP,) * 3, 'slip': _SLIPS, None: (_TRIP, *_SLIPS[1:])}
"""Codes of falls forwards, to a side and backwards. Falls of another cause have none there: they
get codes of their direction, so that no reader takes them for activities."""

_SIDES = (FORWARDS, LATERAL, BACKWARDS, LATERAL)
"""By the quarter of a turn to the left."""


def task_of(recipe: Recipe, fall: Fall) -> TaskCode:
    """Code of a fall, NO_FALL without an impact."""
    if fall.phases.impact is None:
        return NO_FALL
    quarter = round(fall.direction / 90) % 4
    return CAUSES[recipe.data.get('cause')][_SIDES[quarter]]


def description_of(recipe: Recipe, task: TaskCode) -> str:
    """KFall's description of a fall, or 'no fall'; a fall of a recipe without a cause has none,
    which the text then says.
    """
    known = 'cause' in recipe.data or task is NO_FALL
    return task.description if known else f'{recipe.name}: no task of KFall'
