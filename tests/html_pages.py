"""What holds for every page that is written."""

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "hr", "img", "input", "link"}
LOADING = {"script", "link", "img", "iframe", "object", "embed", "base", "video", "audio"}


class _Checker(HTMLParser):
    """Tags are balanced, names unique, and nothing is loaded or run."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.names: list[str] = []
        self.seen: set[str] = set()
        self.references: set[str] = set()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        assert tag not in LOADING, tag
        self.seen.add(tag)
        if tag not in VOID:
            self.open.append(tag)
        self._check(attributes)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self._check(attributes)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def _check(self, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            assert not name.startswith("on"), name
            if name == "id":
                self.names.append(str(value))
            elif name in ("href", "src"):
                assert str(value).startswith("#"), value
                self.references.add(str(value)[1:])
            self.references |= set(re.findall(r"url\(#([^)]+)\)", value or ""))


def check_page(text: str) -> None:
    """Fail unless the page is whole, loads nothing and runs nothing."""
    checker = _Checker()
    checker.feed(text)
    checker.close()
    assert not checker.open
    assert {"html", "head", "title", "main", "h1", "table"} <= checker.seen
    assert len(checker.names) == len(set(checker.names))
    assert checker.references <= set(checker.names)
    assert text.startswith("<!doctype html>")
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", text)
    assert '<meta name="viewport"' in text
    assert "@media print" in text
