"""A study of chapters is the study of all they hold."""

import pytest

from gainful.errors import ConfigError
from gainful.studies import Chapter, Study, Table

from . import walk


def bound(*chapters):
    about = walk.study()
    return Study.of(
        chapters, name=about.name, title=about.title, about=about.about, citations=about.citations, notes=("first",)
    )


def test_chapters_are_bound_in_their_order():
    quiet, jump = walk.experiment(), walk.experiment("jump", "With a jump", walk.JUMP)
    told = Chapter((quiet,), walk.CLAIMS[:1], lambda outcome: [Table("own", ("a",), ())], None, ("second",))
    plain = Chapter((jump,), walk.CLAIMS[1:], figures=walk.figures, notes=("third",))
    study = bound(told, plain)
    assert [each.name for each in study.experiments] == ["quiet", "jump"]
    assert study.claims == walk.CLAIMS
    assert study.notes == ("first", "second", "third")
    outcome = study.run(1)
    assert [table.title for table in study.tables_of(outcome)] == ["own", "With a jump"]
    assert [each.title for each in study.figures_of(outcome)] == ["One run", "All runs", "All runs"]


def test_a_chapter_may_tell_of_the_experiments_of_another():
    study = bound(Chapter((walk.experiment(),)), Chapter(claims=walk.CLAIMS[:1]))
    assert len(study.experiments) == len(study.claims) == 1
    assert study.tables_of(study.run(1))[0].title == "Without a jump"


def test_chapters_must_not_name_two_things_alike():
    chapter = Chapter((walk.experiment(),), walk.CLAIMS[:1])
    with pytest.raises(ConfigError, match="experiments: expected at least one, each name once, got 'quiet' twice"):
        bound(chapter, chapter)
