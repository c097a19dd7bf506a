"""Searches the built documentation for words that a reader types, and checks that each leads to its page, and that the
equations are set.

usage: check_search.py SITE

It asks the index that mkdocs has built, with lunr and with the rules of the site's theme: a title counts a thousand
times as much as a text, each word also finds its continuations, a whole page and a section with all words count more,
and the best section ranks its page. Exits with 1 if a page is not among the first three.
"""

import json
import re
import sys
from pathlib import Path

from lunr.builder import Builder
from lunr.stop_word_filter import stop_word_filter

PROBES = {
    "covariance units": "reference/frames/",
    "frames": "reference/frames/",
    "vehicle frame": "reference/frames/",
    "nadir": "reference/frames/",
    "quaternion": "reference/frames/",
    "timestamps": "reference/timestamps/",
    "time stamps": "reference/timestamps/",
    "utc": "reference/timestamps/",
    "rosbag": "guide/ros/",
    "rerun": "guide/ros/",
    "foxglove": "guide/ros/",
    "basilisk": "guide/tools/",
    "brahe": "guide/tools/",
    "star trackers": "guide/tools/",
    "horizonopnav": "guide/tools/",
    "install": "guide/install/",
    "mask": "guide/mask/",
    "payload": "guide/mask/",
    "rejected": "reference/statuses/",
    "frames.csv": "reference/files/",
    "threshold": "reference/sensor-toml/",
    "mount": "reference/sensor-toml/",
    "opencv": "guide/python/from-opencv/",
    "gallery": "guide/gallery/",
    "where is the limb": "theory/limb/",
    "own firmware": "guide/own-firmware/",
    "sequences": "guide/sequences/",
    "browser": "guide/browser/",
}
FIRST = 3


def load(site):
    """Return the documents of the index by their place, the separator of words, and lunr's index of them."""
    content = json.loads((site / "search/search_index.json").read_text())
    separator = re.compile(content["config"]["separator"])

    def words(text):
        return separator.sub(" ", re.sub(r"<[^>]*>", " ", text)).strip().lower()

    builder = Builder()
    builder.ref("location")
    builder.field("title", boost=1000)
    builder.field("text", boost=1)
    builder.b(0)
    builder.pipeline.add(stop_word_filter)
    places = []
    for document in content["docs"]:
        places.append(document["location"])
        builder.add({"location": document["location"], "title": words(document["title"]), "text": words(document["text"])})
    return places, words, builder.build()


def find_pages(query, words, index):
    """Return the pages for a query, the best first."""
    terms = words(query).split()
    best = {}
    for hit in index.search(" ".join(f"{term}*" for term in terms)):
        page, _, section = hit["ref"].partition("#")
        found = hit["match_data"].metadata
        boost = (not section) + all(any(word.startswith(term) for word in found) for term in terms)
        best[page] = max(best.get(page, 0.0), hit["score"] * (1 + boost**2))
    return sorted(best, key=best.get, reverse=True)


def check_equations(site):
    """Exit if a page of the theory shows TeX, or if the page of the equations has none that is set."""
    pages = {page: page.read_text() for page in site.glob("theory/*/index.html")}
    if raw := [str(page) for page, text in pages.items() if "$$" in text or 'class="arithmatex"' in text]:
        sys.exit(f"equations are not set: {raw}")
    if "<math " not in pages[site / "theory/math/index.html"]:
        sys.exit("theory/math has no equation")


def main(site):
    check_equations(Path(site))
    places, words, index = load(Path(site))
    failed = 0
    for query, wanted in PROBES.items():
        if wanted not in places:
            sys.exit(f"the site has no page {wanted}")
        pages = find_pages(query, words, index)
        if wanted not in pages[:FIRST]:
            failed += 1
            print(f"{query!r}: {wanted} is not among the first {FIRST}: {pages[:FIRST]}")
    print(f"{len(PROBES) - failed} of {len(PROBES)} searches lead to their page")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
