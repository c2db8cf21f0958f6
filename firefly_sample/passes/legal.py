"""Legal variants as products of parts: a pass may have more of them than can be listed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from itertools import chain, product
from typing import Any

from firefly_sample.plan.variants import Variant

Part = Sequence[Mapping[str, Any]]
"""Choices, each the values of the same fields of a variant."""


class Product:
    """The variants of one kind that have any choice of each of its parts.

    Attributes
    ----------
    kind : type of Variant
        Their class.
    parts : tuple of Part
        No two parts choose the same field; together they choose every field.
    """

    def __init__(self, kind: type[Variant], *parts: Iterable[Mapping[str, Any]]):
        """Take the choices of each part: what one of them, or every part, leaves out is as by default."""
        self.kind = kind
        rest: dict[str, Any] = {field.name: field.default for field in fields(kind)}
        made = []
        for part in ([dict(choice) for choice in part] for part in parts):
            defaults = {name: rest.pop(name) for name in dict.fromkeys(chain.from_iterable(part))}
            made.append([defaults | choice for choice in part])
        self.parts: tuple[Part, ...] = (*made, [rest]) if rest else (*made,)
        self._rows = [(tuple(part[0]), {tuple(choice.values()) for choice in part}) for part in self.parts]

    def __len__(self) -> int:
        count = 1
        for part in self.parts:
            count *= len(part)
        return count

    def __iter__(self) -> Iterator[Variant]:
        return map(self.variant, product(*self.parts))

    def variant(self, chosen: Iterable[Mapping[str, Any]]) -> Variant:
        """Return the variant that has one choice of each part."""
        return self.kind(**dict(chain.from_iterable(choice.items() for choice in chosen)))

    def __contains__(self, variant: object) -> bool:
        return type(variant) is self.kind and all(
            tuple(getattr(variant, name) for name in names) in rows for names, rows in self._rows
        )


class Products(Collection[Variant]):
    """All variants of some products, which have none in common.

    Attributes
    ----------
    products : tuple of Product
        The products.
    """

    def __init__(self, *products: Product):
        self.products = products

    def __len__(self) -> int:
        return sum(map(len, self.products))

    def __iter__(self) -> Iterator[Variant]:
        return chain.from_iterable(self.products)

    def __contains__(self, variant: object) -> bool:
        return any(variant in each for each in self.products)


def as_products(variants: Iterable[Variant]) -> Products:
    """Return listed variants of one kind as a product of one part, and products as they are."""
    if isinstance(variants, Products):
        return variants
    listed = list(variants)
    return Products(Product(type(listed[0]), map(vars, listed)))


def choices(**values: Iterable[Any]) -> list[dict[str, Any]]:
    """Return every combination of the values of some fields."""
    return [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]
