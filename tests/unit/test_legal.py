"""Products of parts hold what a list of them holds."""

from dataclasses import dataclass, replace

from firefly_sample.passes.legal import Product, Products, as_products, choices
from firefly_sample.plan.variants import Variant


@dataclass(frozen=True)
class Paint(Variant):
    tone: str = "grey"
    gloss: bool = False
    coats: int = 1


@dataclass(frozen=True)
class Other(Variant):
    tone: str = "grey"
    gloss: bool = False
    coats: int = 1


def test_a_product_has_every_choice_of_each_part_and_defaults_for_the_rest():
    made = Product(Paint, choices(tone=("red", "blue")), [{"coats": 2}, {}])
    listed = [Paint("red", False, 2), Paint("red"), Paint("blue", False, 2), Paint("blue")]
    assert list(made) == listed
    assert len(made) == 4
    assert all(each in made for each in listed)
    for each in listed:
        assert replace(each, gloss=True) not in made
        assert replace(each, tone="grey") not in made
        assert replace(each, coats=3) not in made
    assert Other("red") not in made


def test_some_products_have_the_variants_of_all():
    made = Products(
        Product(Paint, choices(tone=("red",), gloss=(False, True))),
        Product(Paint, choices(tone=("blue",), coats=(1, 2, 3))),
    )
    assert len(made) == len(set(made)) == 5
    assert all(each in made for each in made)
    assert Paint("blue", True) not in made
    assert Paint("red", coats=2) not in made


def test_a_list_is_a_product_of_one_part():
    listed = [Paint("red", True), Paint("blue", False, 2)]
    made = as_products(listed)
    assert list(made) == listed
    assert Paint("red", False, 2) not in made
    assert list(as_products([Variant()])) == [Variant()]
    assert as_products(made) is made
