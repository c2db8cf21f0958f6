"""Choose few cases of many: every three choices that occur together in a case do so in one that is chosen."""

from itertools import combinations_with_replacement

import numpy as np


def every_three(table, seed=0, tried=50):
    """Indices of rows of `table`, shape (cases, fields) of any integers, each row a case and its choices.

    For any three fields, each three values that stand in a row of the table stand in one of the rows chosen.
    Greedy: of `tried` rows that have what is still missing, the one that brings most is taken.
    """
    columns = [np.unique(column, return_inverse=True)[1].astype(np.int32) for column in np.transpose(table)]
    base = max(int(column.max()) for column in columns) + 1
    powers = np.array([base**2, base, 1], np.int32)
    fields = np.array(list(combinations_with_replacement(range(len(columns)), 3)))
    missing = np.zeros((len(fields), base**3), dtype=bool)  # for each three fields, each three choices
    for here, (a, b, c) in zip(missing, fields, strict=True):
        here[(columns[a] * base + columns[b]) * base + columns[c]] = True
    choices, all_fields = np.stack(columns, axis=1), np.arange(len(fields))
    random, chosen = np.random.default_rng(seed), []
    while missing.any():
        which, code = (int(index[0]) for index in np.nonzero(missing))
        wanted = code // powers % base
        have = [columns[k] == choice for k, choice in zip(fields[which], wanted, strict=True)]
        rows = random.choice(np.flatnonzero(have[0] & have[1] & have[2]), tried)
        codes = choices[rows][:, fields] @ powers
        best = np.argmax(missing[all_fields, codes].sum(axis=1))
        missing[all_fields, codes[best]] = False
        chosen.append(int(rows[best]))
    return chosen
