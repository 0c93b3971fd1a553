"""What the verdict says of dolls of which it is known whether they are right.

python test/verdicts.py: the rigs of test/ as they are fitted, and their broken twins, as a table.
"""
from collections import Counter

import fit_rigs
import wild_rigs
from test_fit_verdict import BREAKS, FIGURES

from ragdoll_ros.fit.judging.verdict import judge

WORDS = ('good', 'doubtful', 'wrong')


def main():
    fits = [fit_rigs.fitted(name) for name in fit_rigs.RIGS]
    fits += [wild_rigs.fitted(name) for name in wild_rigs.WILD]
    right = Counter(judge(fit.doll, fit, falls=False).word for fit in fits)
    broken = Counter(judge(broken(fit.doll), fit, falls=False).word
                     for broken, names in BREAKS.items()
                     for fit in [*map(fit_rigs.fitted, names),
                                 *map(wild_rigs.fitted, FIGURES.get(broken, ()))])
    print('| dolls | ' + ' | '.join(WORDS) + ' |\n| --- | --- | --- | --- |')
    for name, found in (('right', right), ('broken', broken)):
        print(f'| {found.total()} {name} | ' + ' | '.join(str(found[w]) for w in WORDS) + ' |')


if __name__ == '__main__':
    main()
