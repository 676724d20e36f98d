import numpy as np

from swesbi.seeds import generator, integer_seed, spawn_key


def test_streams_are_named_not_numbered_by_order() -> None:
    first = generator(1, "prior", "A", 3).random(4)
    generator(1, "prior", "B", 3).random(4)
    np.testing.assert_array_equal(first, generator(1, "prior", "A", 3).random(4))


def test_every_part_of_the_name_and_the_seed_change_the_stream() -> None:
    draws = [
        generator(seed, *names).random()
        for seed, names in [
            (1, ("a", "A", 0)),
            (2, ("a", "A", 0)),
            (1, ("b", "A", 0)),
            (1, ("a", "B", 0)),
            (1, ("a", "A", 1)),
        ]
    ]
    assert len(set(draws)) == len(draws)


def test_a_text_and_the_number_it_looks_like_are_different_names() -> None:
    assert spawn_key("1") != spawn_key(1)


def test_integer_seed_fits_libraries_that_want_32_bits() -> None:
    assert 0 <= integer_seed(5, "train") < 2**32
