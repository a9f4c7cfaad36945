"""Links of built pages to each other, anchors too: python docs/check_links.py FOLDER."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """What a page refers to, and the anchors that it has."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = set(), {"", "top"}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name == "id" and value:
                self.anchors.add(value)
            elif name in ("href", "src", "poster") and value:
                self.links.add(value)


def broken(folder):
    """Pairs of a page and a link of it that leads nowhere in the folder."""
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8"))
             for path in Path(folder).rglob("*.html") if "_static" not in path.parts}
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if target.is_dir():
                target /= "index.html"
            if not target.exists() or (
                    target in pages and unquote(parts.fragment) not in pages[target].anchors):
                yield path, link


def main(folder):
    """Print what is broken; the number of it."""
    found = list(broken(folder))
    for path, link in found:
        print(f"{path.relative_to(Path(folder).resolve())}: {link}")
    print(f"{len(found)} broken links")
    return len(found)


if __name__ == "__main__":
    sys.exit(bool(main(sys.argv[1])))
