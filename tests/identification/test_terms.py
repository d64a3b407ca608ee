"""Terms written as text: what they mean, and what is refused."""

import numpy as np
import pytest

from gainful.errors import ConfigError
from gainful.identification import FUNCTIONS, Reference, parse_equation, parse_term
from gainful.identification.terms import parse_condition

SIGNALS = ("r", "q", "tau")


def value(text: str, **signals: float) -> float:
    """Of a term of one moment."""
    term = parse_term(text, SIGNALS)
    return sum(piece.factor * piece.value(lambda each: signals[each.signal], FUNCTIONS) for piece in term.pieces)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("r*abs(r)", -4.0),
        ("2*r + q/4 - tau", -11.5),
        ("-(r - q)**2", -9.0),
        ("+q", 1.0),
        ("sin(q)*cos(pi/2 - q)", np.sin(1.0) ** 2),
        ("atan2(r, q) + sqrt(tau)", np.arctan2(-2.0, 1.0) + np.sqrt(7.75)),
        ("max(r, q) * min(r, q) * sign(r)", 2.0),
        ("1", 1.0),
        ("r/(2*2)", -0.5),
        ("2**3*r", -16.0),
    ],
)
def test_a_term_is_what_it_says(text: str, expected: float) -> None:
    assert float(value(text, r=-2.0, q=1.0, tau=7.75)) == pytest.approx(expected, rel=1e-12)


def test_derivatives_and_lags_are_found_wherever_they_stand() -> None:
    term = parse_term("3*d(r*q) - lag(d(tau), 2) + d(q)*r + d(lag(q), 2)", SIGNALS)
    assert [(piece.factor, piece.order, piece.references) for piece in term.pieces] == [
        (3.0, 1, (Reference("r"), Reference("q"))),
        (-1.0, 1, (Reference("tau", 2),)),
        (1.0, 0, (Reference("q", 0, 1), Reference("r"))),
        (1.0, 2, (Reference("q", 1),)),
    ]
    assert term.lag == 2
    assert term.order == 2
    assert not term.weak
    assert parse_term("d(r*q)", SIGNALS).weak


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("r +", "drag: 'r +' is not an expression"),
        ("rr", "drag: 'rr': 'rr' is not a signal; did you mean 'r'?"),
        ("sinn(r)", "drag: 'sinn(r)': 'sinn' is not a function; did you mean 'sin'?"),
        ("r[0]", "drag: 'r[0]': expected numbers, signals, + - * / **, brackets and functions, got 'r[0]'"),
        ("r % 2", "got 'r % 2'"),
        ("'r'", "got \"'r'\""),
        ("True*r", "got 'True'"),
        ("r.real", "got 'r.real'"),
        ("__import__('os')", "'__import__' is not a function"),
        ("d(2)", "expected d(...) of something with a signal in it"),
        ("d(d(d(r)))", "expected derivatives up to the second, got a higher one"),
        ("d(r*q)*q", "expected d(...) of a product to stand alone or multiplied by a number, got 'r * q'"),
        ("d(sin(q))*q", "expected d(...) of a function to stand alone or multiplied by a number, got 'sin(q)'"),
        ("lag(r, 0)", "expected lag(x) or lag(x, n) with a whole number n of at least 1, got 'lag(r, 0)'"),
        ("lag(r, 1.5)", "with a whole number n of at least 1"),
        ("lag()", "expected lag(x) or lag(x, n)"),
        ("sin(x=r)", "got 'sin(x=r)'"),
        ("r*(1/0)", "'1 / 0' is not a number"),
    ],
)
def test_what_no_term_may_hold_is_refused_with_its_place(text: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_term(text, SIGNALS, name="drag")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("tau", {}, SIGNALS), "terms: expected at least one, got none"),
        (("tau", {"a b": "r"}, SIGNALS), "terms: expected names of parameters such as 'drag_2', got 'a b'"),
        (
            ("tau", {"a": "r"}, SIGNALS, None, "r"),
            "where: expected one comparison by < or >, such as 'abs(pitch) > 0.2'",
        ),
        (("tau", {"a": "r"}, SIGNALS, None, "1 < r < 2"), "where: expected one comparison by < or >"),
        (("tau", {"a": "r"}, SIGNALS, None, "r >"), "where: 'r >' is not an expression"),
        (("tau", {"a": "r"}, SIGNALS, None, "d(r) > 0"), "where: 'd(r) > 0': expected no derivatives"),
    ],
)
def test_what_no_equation_may_hold_is_refused(arguments, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_equation(*arguments)
    assert message in str(caught.value)


def test_a_condition_is_above_zero_where_it_holds() -> None:
    assert parse_condition("abs(r) > 0.2", SIGNALS).text == "abs(r) - 0.2"
    assert parse_condition("0.2 > r", SIGNALS).text == "0.2 - r"


def test_a_users_function_may_be_called() -> None:
    equation = parse_equation("tau", {"a": "cubed(r)"}, SIGNALS, {"cubed": lambda x: x**3})
    piece = equation.terms["a"].pieces[0]
    assert piece.value(lambda each: 2.0, equation.functions) == 8.0
