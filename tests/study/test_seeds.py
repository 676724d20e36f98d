import numpy as np

from swesbi.seeds import generator, integer_seed


def test_streams_are_named_not_numbered_by_order() -> None:
    first = generator(1, "prior", "A", 3).random(4)
    generator(1, "prior", "B", 3).random(4)
    np.testing.assert_array_equal(first, generator(1, "prior", "A", 3).random(4))


def test_every_part_of_the_name_and_the_seed_change_the_stream() -> None:
    named = [(1, "a", "A", 0), (2, "a", "A", 0), (1, "b", "A", 0), (1, "a", "B", 0), (1, "a", "A", 1)]
    named.append((1, "a", "A", "1"))  # a text is another name than the number that it looks like
    assert len({generator(*each).random() for each in named}) == len(named)
    assert 0 <= integer_seed(5, "train") < 2**32  # as libraries want it
