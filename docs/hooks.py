"""What mkdocs does beyond Markdown: formulas as MathML, the gallery, and pages for the files that documents link to.

Pages read well without it, too: formulas are GitHub's, the gallery is a list of links, and links lead to files.
"""

import ast
import posixpath
import re
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "build/gallery"
GALLERY, MESSAGES = "examples.md", "troubleshooting.md"

FENCE = re.compile(r"^```math\n(.*?)^```$", flags=re.M | re.S)
INLINE = re.compile(r"\$`(.+?)`\$")
LINK = re.compile(r"(?<=\]\()(\.\./[^)#]+)(?=\))")
EXAMPLE = re.compile(r"^- \[.*?\]\(\.\./examples/(\w+)\.py\).*\n", flags=re.M)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pictures of the gallery and a page for each file outside docs/ that a document links to."""
    pages = [file for file in files if file.src_uri.endswith(".md")]
    for target in sorted({target for page in pages for target in _outside(page.src_uri, page.content_string).values()}):
        files.append(File.generated(config, _source_page(target), content=_as_page(ROOT / target)))
    for name in _examples():
        picture = PICTURES / f"{name}.png"
        if not picture.exists():
            raise PluginError(f"{picture} is missing: run `make gallery`, or `make docs`, which does.")
        files.append(File.generated(config, f"gallery/{name}.png", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Formulas, links and the gallery."""
    uri = page.file.src_uri
    if uri == GALLERY:
        markdown = _gallery(markdown)
    outside = _outside(uri, markdown)
    markdown = LINK.sub(
        lambda link: _relative(uri, _source_page(outside[link[0]])) if link[0] in outside else link[0], markdown
    )
    markdown = FENCE.sub(lambda formula: f'<div class="formula">{convert(formula[1].strip(), display="block")}</div>', markdown)
    return INLINE.sub(lambda formula: f'<span class="math">{convert(formula[1])}</span>', markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Messages are headings, so that they can be found and linked to, but too long for a table of contents."""
    if page.file.src_uri == MESSAGES:
        for section in page.toc:
            for part in section.children:
                part.children = []
    return html


def _outside(uri: str, markdown: str) -> dict[str, str]:
    """Links of a page that leave docs/: the target as written, and from the root."""
    found = {}
    for target in LINK.findall(markdown):
        path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(uri), target))
        if not path.startswith("docs/"):
            found[target] = path
    return found


def _source_page(target: str) -> str:
    return f"source/{target}.md"


def _relative(uri: str, target: str) -> str:
    return posixpath.relpath(target, posixpath.dirname(uri) or ".")


def _as_page(path: Path) -> str:
    language = {".py": "python", ".md": "markdown", ".toml": "toml"}.get(path.suffix, "text")
    return f"---\nsearch:\n  exclude: true\n---\n\n# {path.relative_to(ROOT)}\n\n````{language}\n{path.read_text()}````\n"


def _examples() -> list[str]:
    return sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def _gallery(markdown: str) -> str:
    """The list of examples as a wall of pictures, and below it each with its picture, its words and its code."""
    listed = EXAMPLE.findall(markdown)
    if listed != _examples():
        raise PluginError(f"{GALLERY} lists {listed}, and in examples/ are {_examples()}.")
    cards, sections = [], []
    for name in listed:
        code = (ROOT / "examples" / f"{name}.py").read_text()
        title = name[3:].replace("_", " ").capitalize().replace(" 3d ", " 3-D ")
        words = str(ast.get_docstring(ast.parse(code)))
        said = (PICTURES / f"{name}.txt").read_text()
        cards.append(
            f'<a href="#{name}"><img src="gallery/{name}.png" alt="" loading="lazy"><span>{name[:2]} {title}</span></a>'
        )
        sections.append(
            f"## {name[:2]} {title} {{ #{name} }}\n\n{words}\n\n![{title}](gallery/{name}.png)\n\n"
            f"It prints\n\n```text\n{said}```\n\n"
            f'??? example "examples/{name}.py"\n\n    ```python\n{_indented(code)}    ```\n'
        )
    wall = '<div class="gallery">\n' + "\n".join(cards) + "\n</div>\n"
    before, after = markdown[: EXAMPLE.search(markdown).start()], EXAMPLE.sub("", markdown)  # type: ignore[union-attr]
    return before + wall + after[len(before) :] + "\n" + "\n".join(sections)


def _indented(code: str) -> str:
    return "".join(f"    {line}" if line.strip() else line for line in code.splitlines(keepends=True))
