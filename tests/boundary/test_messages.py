"""Every message of the library: the argument, what was expected, what came."""

import ast
from pathlib import Path

import pytest

import gainful as gf

HERE = Path(__file__).parent
LIBRARY = Path(gf.__file__).parent
ELSEWHERE = ("testing", "report", "live")
"""Rooms whose messages are tested beside the rest of what they do."""


def raise_statements():
    """File, first and last line and text of every statement that raises one of the library's errors."""
    for path in sorted(LIBRARY.rglob("*.py")):
        if path.relative_to(LIBRARY).parts[0] in ELSEWHERE:
            continue
        text = path.read_text()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name):
                name = node.exc.func.id
                if isinstance(getattr(gf.errors, name, None), type):
                    yield path, node.lineno, node.end_lineno, " ".join(ast.get_source_segment(text, node).split())


def test_every_message_of_the_library_is_provoked_here(request, raised):
    chosen = request.config.args
    files = {item.path for item in request.session.items}
    whole = not any("::" in name for name in chosen) and set(HERE.glob("test_*.py")) <= files
    deselected = request.config.pluginmanager.get_plugin("terminalreporter").stats.get("deselected")
    if not whole or deselected or hasattr(request.config, "workerinput"):
        pytest.skip("only when all of these tests run in one process")
    left = [
        f"{path.relative_to(LIBRARY)}:{first}: {text}"
        for path, first, last, text in raise_statements()
        if not any((str(path), line) in raised for line in range(first, last + 1))
    ]
    assert not left, "no test provokes\n" + "\n".join(left)
