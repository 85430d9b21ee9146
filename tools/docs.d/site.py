"""The pages of the repository as a site that is read offline: `site.py summary` prints mdBook's list of chapters,
`site.py make FOLDER` writes the site with `mdbook` and `mdbook-mermaid` of PATH and checks every link in it, `site.py check FOLDER` checks the
links of a site.

The site has the folders of the repository, so that relative links mean the same in both. Sources that a page links to are copied
beside it as `NAME.txt`, which a browser shows instead of saving."""

import html
import html.parser
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

TOP = pathlib.Path(__file__).resolve().parents[2]
FRONT = "docs/gallery.md"
LINK = re.compile(r"(\]\()([^)\s#]+)((?:#[^)\s]*)?\))")
SHOWN = {".md", ".png", ".svg"}

BOOK = """\
[book]
title = "Echolume"
language = "en"

# README.md keeps its name, and no page includes another.
[build]
use-default-preprocessors = false

[output.html]
no-section-label = true
input-404 = ""
additional-css = ["site.css"]
fold = { enable = true, level = 0 }
print = { enable = false }
"""

# Tables of figures and rows of pictures need more width than prose. Links to the page before and after lie below the text, not over wide tables.
STYLE = """\
:root { --content-max-width: 1100px; }
.content table { margin: 0 0 1em 0; }
.content th, .content td { vertical-align: top; }
.content td img { min-width: 120px; }
.content thead:not(:has(th:not(:empty))) { display: none; }
.content :not(pre) > code.hljs, .content :not(pre) > code { padding: 0.1em 0.2em; }
.nav-wide-wrapper { display: none; }
.nav-wrapper { display: block; }
.content pre.mermaid { background: #fff; }
"""

# Draws the diagrams of a page, from a file beside the site's pages.
DIAGRAMS = """
<script src="{root}mermaid.min.js"></script>
<script>mermaid.initialize({{ startOnLoad: true }});</script>
"""

REDIRECT = """\
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Echolume</title><meta http-equiv="refresh" content="0; url={page}"></head>
<body><a href="{page}">Echolume</a></body></html>
"""


def text_of(page):
    return (TOP / page).read_text(encoding="utf-8")


def prose_of(text):
    """A page without its blocks of code."""
    return re.sub(r"(?ms)^```.*?^```$", "", text)


def targets(page, rows_first=False):
    """Files of the repository that a page links to, in its order, or those in a table of pages first."""
    lines = prose_of(text_of(page)).splitlines()
    if rows_first:
        lines.sort(key=lambda line: not line.startswith("| [docs/"))
    for _, target, _ in LINK.findall("\n".join(lines)):
        if "://" not in target:
            path = os.path.normpath(os.path.join(os.path.dirname(page), target))
            if (TOP / path).is_file():
                yield path


def pages():
    """Every page with its depth in the list: the front page, README.md and what it links to, each page below a README.md indented."""
    found = {FRONT: 0}

    def add(page, depth):
        if page in found and page != FRONT:
            return
        found.setdefault(page, depth)
        if os.path.basename(page) == "README.md":
            folder = os.path.dirname(page)
            below = depth + 1 if folder else 0
            for target in targets(page, rows_first=True):
                if target.endswith(".md") and (not folder or os.path.dirname(target) == folder):
                    add(target, below)

    add("README.md", 0)
    # Pages elsewhere that any of these link to.
    for page in list(found):
        for target in targets(page):
            if target.endswith(".md"):
                add(target, 0)
    missing = {str(page.relative_to(TOP)) for page in (TOP / "docs").rglob("*.md")} - set(found)
    if missing:
        sys.exit(f"docs --site: no README.md has a link to {', '.join(sorted(missing))}")
    return found


def title(page):
    heading = next((line[2:] for line in text_of(page).splitlines() if line.startswith("# ")), None)
    return (heading or page).replace("`", "").strip()


def summary():
    lines = [f"{'    ' * depth}- [{title(page)}]({page})" for page, depth in pages().items()]
    return "\n".join(["# Summary", "", *lines, ""])


def with_diagrams(page, text):
    """A page with its diagrams as the elements that Mermaid draws, and the script for them if it has any."""

    def element(match):
        # From the top down: a page is narrower than the long rows of a diagram.
        return f'<pre class="mermaid">\n{html.escape(match[1].replace("flowchart LR", "flowchart TB"))}</pre>'

    drawn = re.sub(r"(?ms)^```mermaid\n(.*?)^```$", element, text)
    root = "../" * page.count("/")
    return drawn if drawn == text else drawn + DIAGRAMS.format(root=root)


def write_sources(folder):
    """The pages, and what they link to or show, below `folder`."""
    for page in pages():
        text = with_diagrams(page, text_of(page))
        for target in targets(page):
            path = pathlib.Path(target)
            if path.suffix == ".md":
                continue
            copy = folder / (target if path.suffix in SHOWN else f"{target}.txt")
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(TOP / target, copy)

        def shown(match):
            suffix = pathlib.Path(match[2]).suffix
            is_here = "://" not in match[2] and (TOP / os.path.dirname(page) / match[2]).is_file()
            return match[1] + match[2] + (".txt" if is_here and suffix not in SHOWN else "") + match[3]

        place = folder / page
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(LINK.sub(shown, text), encoding="utf-8")
    (folder / "SUMMARY.md").write_text(summary(), encoding="utf-8")


class Links(html.parser.HTMLParser):
    """What a page of the site links to, and the places in it that others can link to."""

    def __init__(self):
        super().__init__()
        self.targets, self.anchors = [], set()

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name == "id":
                self.anchors.add(value)


def broken_links(site):
    """Every relative link or picture of the site that leads to no file, or to no place in a page."""
    parsed = {}
    for page in site.rglob("*.html"):
        parsed[page] = Links()
        parsed[page].feed(page.read_text(encoding="utf-8"))
    for page, links in parsed.items():
        for target in links.targets:
            url = urllib.parse.urlsplit(target)
            if url.scheme or url.netloc:
                continue
            path = page if not url.path else pathlib.Path(os.path.normpath(page.parent / urllib.parse.unquote(url.path)))
            is_anchor = bool(url.fragment) and path in parsed
            if not path.is_file() or (is_anchor and urllib.parse.unquote(url.fragment) not in parsed[path].anchors):
                yield f"{page.relative_to(site)}: {target}"


def check(site):
    broken = sorted(broken_links(site))
    if broken:
        sys.exit("docs --site: broken links\n  " + "\n  ".join(broken))


def make(out):
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        write_sources(work / "src")
        # Its script alone: as a part of the book every page would load it.
        (work / "mermaid").mkdir()
        (work / "mermaid" / "book.toml").write_text("", encoding="utf-8")
        subprocess.run(["mdbook-mermaid", "install", str(work / "mermaid")], check=True, capture_output=True)
        shutil.copy(work / "mermaid" / "mermaid.min.js", work / "src")
        (work / "book.toml").write_text(BOOK, encoding="utf-8")
        (work / "site.css").write_text(STYLE, encoding="utf-8")
        subprocess.run(["mdbook", "build", "--dest-dir", str(work / "book"), str(work)], check=True)
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(work / "book", out)
    # mdBook puts the first chapter there too, but its pictures lie elsewhere.
    page = FRONT.removesuffix(".md") + ".html"
    (out / "index.html").write_text(REDIRECT.format(page=page), encoding="utf-8")
    check(out)
    print(f"{out}/index.html: {len(pages())} pages, every link leads somewhere")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["summary"]:
            print(summary(), end="")
        case ["make", out]:
            make(pathlib.Path(out).resolve())
        case ["check", folder]:
            check(pathlib.Path(folder).resolve())
        case _:
            sys.exit(__doc__)
