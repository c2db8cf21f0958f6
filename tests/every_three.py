"""Choose few cases of many: every three choices that occur together in a case do so in one that is chosen.

The cases are those of some products, and a product's are a row of each of its parts: no list of them is made.
"""

from itertools import combinations_with_replacement, groupby

import numpy as np


class _Product:
    """The cases that have a row of each part; a part is (numbers of its fields, table of its choices)."""

    def __init__(self, parts):
        self.parts = parts
        self.where = {field: (k, n) for k, (fields, _) in enumerate(parts) for n, field in enumerate(fields)}

    def by_part(self, fields):
        """For each part with some of the fields: its number, their columns of its table, and their places."""
        found = sorted((*self.where[field], place) for place, field in enumerate(fields))
        for part, group in groupby(found, key=lambda each: each[0]):
            _, columns, places = zip(*group, strict=True)
            yield part, self.parts[part][1][:, columns], list(places)

    def codes(self, fields, powers):
        """Every code, the sum of choices times powers, that the fields have in a case."""
        sums = np.zeros(1, int)
        for _, columns, places in self.by_part(fields):
            sums = (sums[:, None] + np.unique(columns @ powers[places])).ravel()
        return sums

    def rows_with(self, fields, wanted):
        """For each part, the rows that a case can have whose fields are as wanted."""
        rows = [np.arange(len(table)) for _, table in self.parts]
        for part, columns, places in self.by_part(fields):
            rows[part] = np.flatnonzero((columns == wanted[places]).all(axis=1))
        return rows

    def cases(self, rows):
        """The choices of cases that are given by their row in each part."""
        made = np.empty((len(rows), len(self.where)), int)
        for (fields, table), row in zip(self.parts, rows.T, strict=True):
            made[:, fields] = table[row]
        return made


def every_three(products, seed=0, tried=50):
    """Some cases of products, each as the index of its product and those of its rows, one a part.

    A product is a list of parts, each (numbers of its fields, table of shape (rows, its fields)) of small
    whole numbers; its parts have each of the same fields once. For any three fields, each three values that
    stand in a case stand in one of those chosen. Greedy: of about `tried` cases that have what is still
    missing, the one that brings most is taken.
    """
    products = [_Product(parts) for parts in products]
    base = max(int(table.max(initial=0)) for product in products for _, table in product.parts) + 1
    powers = np.array([base**2, base, 1])
    fields = np.array(list(combinations_with_replacement(sorted(products[0].where), 3)))
    missing = np.zeros((len(fields), base**3), dtype=bool)  # for each three fields, each three choices
    for here, three in zip(missing, fields.tolist(), strict=True):
        for product in products:
            here[product.codes(three, powers)] = True
    all_fields = np.arange(len(fields))
    random, chosen = np.random.default_rng(seed), []
    while missing.any():
        which, code = divmod(int(missing.argmax()), base**3)  # the first one
        wanted = code // powers % base
        rows = [product.rows_with(fields[which].tolist(), wanted) for product in products]
        counts = np.array([np.prod([float(len(row)) for row in each]) for each in rows])
        best = (0,)
        for index in np.flatnonzero(counts):
            share = int(np.ceil(tried * counts[index] / counts.sum()))
            drawn = np.stack([random.choice(row, share) for row in rows[index]], axis=1)
            codes = products[index].cases(drawn)[:, fields] @ powers
            brought = missing[all_fields, codes].sum(axis=1)
            first = int(np.argmax(brought))
            if brought[first] > best[0]:
                best = (brought[first], int(index), drawn[first].tolist(), codes[first])
        _, index, drawn, codes = best
        missing[all_fields, codes] = False
        chosen.append((index, drawn))
    return chosen
