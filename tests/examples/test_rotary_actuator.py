"""The rotary actuator's README says what its record says."""

import re

import numpy as np
import pytest

from gainful.jobs import estimate, parameter_rows

from .test_examples import EXAMPLES, recorded

FOLDER = EXAMPLES / "rotary_actuator"
SCRIPT = FOLDER / "all_strokes.py"
README = (FOLDER / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def table(script):
    return script.estimates(recorded("hydraulic_rotary_actuator"))


def said(pattern: str) -> list[tuple[str, ...]]:
    """What the README says where a pattern matches."""
    found = re.findall(pattern, README, re.M)
    assert found
    return [each if isinstance(each, tuple) else (each,) for each in found]


def numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"-?\d+\.\d+", text)]


def test_one_stroke_from_its_configuration_is_that_of_the_script(table, tmp_path):
    folder = recorded("hydraulic_rotary_actuator")
    text = (FOLDER / "stroke.toml").read_text().replace('folder = "data"', f'folder = "{folder}"')
    path = tmp_path / "stroke.toml"
    path.write_text(text.replace('file = "rotary_actuator.py"', f'file = "{FOLDER / "rotary_actuator.py"}"'))
    job = estimate(path)
    heads, rows = parameter_rows(job.result)
    found = {row[0]: row[heads.index("at the end")] for row in rows}
    (own,) = table[table.run_id == 422].to_dict("records")
    # The configuration counts the angle from another zero; the first row's input differs, which nothing is predicted with.
    assert 1000.0 * found["opening"] == pytest.approx(own["opening"], rel=1e-6)
    told = " ".join(job.verdict.warnings)
    assert all(f"next to nothing was learned of {name}" in told for name in ("gain", "friction", "leakage"))
    assert "opening" not in told


def test_what_one_stroke_tells_is_what_the_readme_says(table):
    for name, share in said(r"^\| (gain|load|friction|leakage|opening) \| (\d+) % \|$"):
        assert 100.0 * table[f"{name} left"].median() == pytest.approx(float(share), abs=0.6)


def test_the_readings_that_slipped_are_found_by_their_weights(table):
    assert sorted(table[table.slipped].run_id) == [575, 594]


def test_the_differences_between_actuators_are_those_of_the_readme(script, table):
    for second, first, *cells in said(r"^\| .* \((\d)\) - healthy \((\d)\), .*? \| (.*) \| (.*) \| (.*) \|$"):
        for size, cell in zip(script.SIZES, cells, strict=True):
            mean, half, larger = script.difference(table, int(first), int(second), size)
            assert numbers(cell) == pytest.approx([mean, half, max(larger, 1.0 - larger)], abs=0.06)
    mean, half, larger = script.difference(table, 1, 6, "by_travel")
    assert f"differ by {mean:.1f} ± {half:.1f} in `by_travel`, and each single stroke shows it ({larger:.2f})" in README


def test_the_table_of_actuators_is_that_of_the_readme(script, table):
    each = script.by_actuator(table)
    for actuator, condition, *cells in said(r"^\| (\d) \| (\w+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$"):
        row = each.loc[int(actuator)]
        assert row.condition == condition
        found = [row[name] for name in ("temperature", *script.SIZES)]
        assert [float(cell) for cell in cells] == pytest.approx(found, abs=0.06)
    assert each.held_outlet.max() == pytest.approx(1.0, abs=0.06)
    assert each.held_outlet[4] == pytest.approx(each.held_outlet[1], abs=0.1)


def test_a_fault_is_not_claimed_where_healthy_actuators_may_lie(script, table):
    each = script.by_actuator(table)
    ends = {size: script.expected(each, size) for size in ("opening", "by_travel")}
    for size, (low, high, _) in ends.items():
        assert f"{low:.1f} to {high:.1f}" in README
        assert low < each[size][3] < high
    assert each.opening[4] > ends["opening"][1]
    assert each.by_travel[4] < ends["by_travel"][1]
    warm = ends["by_travel"][2].loc[3]
    assert f"{warm.lower:.1f} to {warm.upper:.1f} by travel" in README
    assert (np.abs(each.temperature[[3, 4]] - 27.1) < 0.05).all()
