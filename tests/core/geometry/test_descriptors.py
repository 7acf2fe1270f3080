import numpy as np

from r2c2r_core.geometry.descriptors import mutual_pairs


def unit(rows: list[list[float]]) -> np.ndarray:
    array = np.array(rows)
    return array / np.linalg.norm(array, axis=1, keepdims=True)


def test_only_unambiguous_mutual_pairs_are_matched() -> None:
    first = unit([[1, 0, 0], [0, 1, 0], [0.8, 0.1, 0.6], [0, 0, 1]])
    second = unit([[0, 1, 0.02], [1, 0.02, 0], [0.1, 0, 1], [0, 0.1, 1]])
    rows, columns = mutual_pairs(first, second, 0.8)
    # row 2 is nearest to column 1, which is nearer to row 0; row 3 has a tie
    assert rows.tolist() == [0, 1]
    assert columns.tolist() == [1, 0]


def test_a_single_descriptor_gives_no_matches() -> None:
    one = unit([[1, 0, 0]])
    assert [len(found) for found in mutual_pairs(one, unit([[1, 0, 0], [0, 1, 0]]), 0.8)] == [0, 0]
