"""What the documents may say: links that lead somewhere, names that fit, and nothing that a reader does not have."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
FENCE = re.compile(r"^( *)```.*?^\1```", re.MULTILINE | re.DOTALL)
CITED = re.compile(r"\bdocs/[\w./-]+\.(?:md|png|svg)\b")
PLACED = re.compile(r"`(\w+)` in\s+`((?:app|web|tests)/[\w./-]+\.\w+)`")
CODE = re.compile(
    r"\b(?:fails?|failed|rejected|refused|answers|answered)\s+(?:\w+\s+)?with\s+(?:\d{3}\s+)?`([a-z_]+\.[a-z_.]+)`"
)
DECISION = re.compile(r"decisions/(\d{4})-([\w-]+)\.md$")
EXTERNAL = re.compile(r"^[a-z]+:")


def dead_links(pages: Mapping[str, str], existing: frozenset[str]) -> list[str]:
    """Relative links of Markdown pages to files or headings that do not exist. `existing`: files and folders."""
    return [
        f"{path}:{line}: the link {target} leads nowhere"
        for path, text in pages.items()
        for line, target in _links(text)
        if not _leads_somewhere(path, target, pages, existing)
    ]


def dead_citations(texts: Mapping[str, str], existing: frozenset[str]) -> list[str]:
    """Documents that code or comments name and that do not exist."""
    return [
        f"{path}:{line}: {cited.group()} does not exist"
        for path, text in texts.items()
        for line, content in enumerate(text.splitlines(), 1)
        for cited in CITED.finditer(content)
        if cited.group() not in existing
    ]


def dead_names(pages: Mapping[str, str], texts: Mapping[str, str]) -> list[str]:
    """Names that a page places in a file that does not have them: "`ROUTES` in `app/api/application.py`"."""
    return [
        f"{path}: {file} has no {name}"
        for path, text in pages.items()
        for name, file in PLACED.findall(text)
        if not re.search(rf"\b{name}\b", texts.get(file, ""))
    ]


def dead_codes(pages: Mapping[str, str], texts: Mapping[str, str]) -> list[str]:
    """Codes with which something fails or is rejected on a page, and that no module of the service names."""
    modules = "".join(text for path, text in texts.items() if path.startswith("app/"))
    return [
        f"{path}: {code} does not exist"
        for path, text in pages.items()
        for code in CODE.findall(text)
        if f'"{code}"' not in modules
    ]


def retired(texts: Mapping[str, str], names: Mapping[str, str]) -> list[str]:
    """Uses of retired names, each with the term that replaces it."""
    patterns = [(re.compile(pattern), term) for pattern, term in names.items()]
    return [
        f"{path}:{line}: {found.group()!r} was retired; use {term}"
        for path, text in texts.items()
        for line, content in enumerate(text.splitlines(), 1)
        for pattern, term in patterns
        if (found := pattern.search(content))
    ]


def misnamed_decisions(pages: Mapping[str, str]) -> list[str]:
    """Decisions whose file name has another number than the title, or words that do not stand there in a row."""
    return [
        f"{path}: its title is {title!r}"
        for path, text in pages.items()
        if (named := DECISION.search(path))
        for title in HEADING.findall(text)[:1]
        for number, _, words in [next(_slugs([title])).partition("-")]
        if int(named[1]) != int(number) or f"-{named[2]}-" not in f"-{words}-"
    ]


def anchors(text: str) -> frozenset[str]:
    """The anchors of a page's headings, as GitHub and Python-Markdown make them."""
    return frozenset(_slugs(HEADING.findall(FENCE.sub("", text))))


def _links(text: str) -> Iterator[tuple[int, str]]:
    blank = FENCE.sub(lambda fence: "\n" * fence.group().count("\n"), text)
    for line, content in enumerate(blank.splitlines(), 1):
        yield from ((line, target) for target in LINK.findall(content))


def _leads_somewhere(path: str, target: str, pages: Mapping[str, str], existing: frozenset[str]) -> bool:
    if EXTERNAL.match(target):
        return True
    file, _, anchor = target.partition("#")
    found = path if not file else _joined(PurePosixPath(path).parent, file)
    return found in existing and (not anchor or found not in pages or anchor in anchors(pages[found]))


def _joined(folder: PurePosixPath, relative: str) -> str:
    parts: list[str] = []
    for part in (folder / relative).parts:
        if part == "..":
            if not parts:
                return ""
            parts.pop()
        else:
            parts.append(part)
    return "/".join(parts)


def _slugs(headings: Iterable[str]) -> Iterator[str]:
    for heading in headings:
        plain = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        yield re.sub(r"[^\w\- ]", "", plain.lower()).strip().replace(" ", "-")
