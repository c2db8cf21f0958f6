"""Tables whose figures have bounds beside them."""

from firefly_sample.lab.experiments.experiment import Table


def holds_its_bounds(table: Table) -> bool:
    """Whether each figure is at most the bound beside it."""
    for row in table.rows:
        for column, bound in enumerate(row):
            if table.columns[column].endswith("bound") and bound is not None:
                assert row[column - 1] <= bound, (table.name, row[0], table.columns[column])
    return True
