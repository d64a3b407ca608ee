"""No part escapes its laws."""

import itertools

import pytest

from .parts import KINDS, LIKE_HUBERS, LIKE_SAGE_HUSAS, combinations, covering, final_subclasses, import_all, name_of


@pytest.fixture(scope="module", autouse=True)
def everything_imported() -> None:
    import_all()


@pytest.mark.parametrize("base", KINDS, ids=lambda base: base.__name__)
def test_every_part_is_tried(base: type) -> None:
    found = set(final_subclasses(base))
    missing = sorted(f"{cls.__module__}.{cls.__name__}" for cls in found - set(KINDS[base]))
    assert found, f"found no {base.__name__} at all, so the walk is broken"
    assert not missing, f"enter an instance in tests/laws/parts.py for {missing}"


def test_the_covering_set_holds_every_pair_and_is_smaller_than_the_product() -> None:
    axes = [["a", "b", "c"], [0, 1, 2, 3], ["x"], [True, False]]
    rows = covering(axes)
    for i, j in itertools.combinations(range(len(axes)), 2):
        assert {(row[i], row[j]) for row in rows} == set(itertools.product(axes[i], axes[j]))
    assert len(rows) < 3 * 4 * 1 * 2


def test_the_covering_set_of_filters_holds_every_update_and_estimate() -> None:
    chosen = combinations(full=False)
    everything = combinations(full=True)
    for part in ("update", "estimate", "noise"):
        held, all_of_them = ({name_of(getattr(each, part)) for each in some} for some in (chosen, everything))
        assert held == all_of_them - {kind.__name__ for kind in (*LIKE_HUBERS, *LIKE_SAGE_HUSAS)}
    assert len(chosen) < len(everything)
