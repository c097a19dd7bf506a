"""Checks the links of a built site: every link to its own files leads to a file, and every anchor to an element.

usage: check_links.py SITE [--without FOLDER]

mkdocs checks the links that are written in Markdown; this script also checks those of its theme, of the notebooks, and
of pages that others have made. Links into FOLDER are not followed, because something else builds it. Exits with 1 if a
link is broken.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What these attributes name is loaded or opened.
LINKS = {"href", "src", "poster"}


class Page(HTMLParser):
    """The links and anchors of a page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in LINKS and value and not (tag == "link" and dict(attrs).get("rel") == "canonical"):
                self.links.append(value)
            if name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value)


def target(site, page, link):
    """Return the file that a link of a page leads to."""
    path = unquote(link.path)
    found = site / path.lstrip("/") if path.startswith("/") else page.parent / path
    if not path:
        return page
    return found / "index.html" if path.endswith("/") or found.is_dir() else found


def broken(site, without):
    """Yield each broken link as the page that has it and the link. Return the number of links to own files."""
    pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}
    checked = 0
    for path, page in pages.items():
        # The error page is shown at every address, so its links begin at the root of the server.
        if path.name == "404.html":
            continue
        for text in page.links:
            link = urlsplit(text)
            if link.scheme or link.netloc:
                continue
            found = Path(*target(site, path, link).parts).resolve()
            if without and site / without in [found, *found.parents]:
                continue
            checked += 1
            if not found.is_relative_to(site) or not found.exists():
                yield path, text
            elif link.fragment and found.suffix == ".html" and unquote(link.fragment) not in pages[found].anchors:
                # Such a fragment is read by the scripts of the page.
                if found.parent.name != "app":
                    yield path, text
    return checked


def main():
    site = Path(sys.argv[1]).resolve()
    without = sys.argv[3] if sys.argv[2:3] == ["--without"] else None
    found, checking = [], broken(site, without)
    while True:
        try:
            found.append(next(checking))
        except StopIteration as end:
            checked = end.value
            break
    for page, link in found:
        print(f"{page.relative_to(site)}: {link}")
    if found or checked < 1000:
        raise SystemExit(f"check_links: {len(found)} of {checked} links are broken")
    print(f"{checked} links of the site lead to their files and anchors")


if __name__ == "__main__":
    main()
