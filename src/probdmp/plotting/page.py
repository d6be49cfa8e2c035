"""A page that needs nothing else: text, tables and pictures in one HTML file, for the screen, the phone and paper."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from itertools import count

from probdmp.plotting.panels import Panel, svg_of

__all__ = ["code", "definitions", "figure", "heading", "note", "page", "paragraph", "table"]

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
  :root {{ color-scheme: light dark; --ink: #1c1c1c; --soft: #4a4a4a; --line: #d8d8d8; --box: #f1f1f1; --paper: #fff; }}
  @media (prefers-color-scheme: dark) {{
    :root {{ --ink: #e6e6e6; --soft: #b4b4b4; --line: #444; --box: #2a2a2a; --paper: #181818; }}
  }}
  * {{ box-sizing: border-box; }}
  body {{ font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 0; }}
  main {{ max-width: 64rem; margin: 0 auto; padding: 1.5rem 1rem 3rem; overflow-wrap: break-word; }}
  h1 {{ font-size: 1.55rem; line-height: 1.25; }} h2 {{ font-size: 1.2rem; margin: 2.2rem 0 .4rem; }}
  h3 {{ font-size: 1rem; margin: 1.4rem 0 .2rem; }}
  .wide {{ overflow-x: auto; margin: .6rem 0 1.2rem; }}
  table {{ border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }}
  th, td {{ text-align: left; padding: .35rem 1rem .35rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }}
  td {{ overflow-wrap: normal; min-width: 3rem; }} td:first-child {{ min-width: 6rem; }} .many {{ min-width: 42rem; }}
  td small {{ display: block; color: var(--soft); white-space: nowrap; }}
  figure {{ margin: .8rem 0 1.2rem; }}
  .panels {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 24rem), 1fr)); gap: .6rem; }}
  .panels svg {{ display: block; width: 100%; height: auto; background: #fff; }}
  figcaption, .note, dd {{ font-size: .9rem; color: var(--soft); }}
  dt {{ font-weight: 600; margin-top: .6rem; }} dd {{ margin: 0; }}
  pre {{ background: var(--box); padding: .6rem .8rem; overflow-x: auto; white-space: pre-wrap; overflow-wrap: anywhere; }}
  @media print {{
    :root {{ --ink: #000; --soft: #333; --line: #bbb; --box: #f4f4f4; --paper: #fff; }}
    html, body {{ font-size: 10pt; }} main {{ max-width: none; padding: 0; }}
    .wide {{ overflow-x: visible; }} table {{ font-size: 8.5pt; }} td small {{ white-space: normal; }}
    th, td {{ padding-right: .6rem; }} td, td:first-child, .many {{ min-width: 0; }}
    .panels {{ grid-template-columns: repeat(2, 1fr); }}
    h2, h3 {{ break-after: avoid; }} tr, .panels svg, figcaption, pre {{ break-inside: avoid; }}
  }}
  @page {{ margin: 1.8cm; }}
</style>
</head>
<body>
<main>
<h1>{title}</h1>
{body}
</main>
</body>
</html>
"""


MANY_COLUMNS = 5
"""So many are not squeezed on a phone, but scroll."""


def page(title: str, parts: Iterable[str]) -> str:
    """A whole page of parts made by the functions below; the pictures in it get names of their own.

    Parameters
    ----------
    title : plain text.
    """
    numbers = count()
    body = re.sub(
        r"<svg .*?</svg>", lambda found: _renamed(found[0], next(numbers)), "\n".join(filter(None, parts)), flags=re.S
    )
    return PAGE.format(title=escape(title), body=body)


def heading(text: str, level: int = 2) -> str:
    """A heading, of plain text."""
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(html: str) -> str:
    """A paragraph of HTML."""
    return f"<p>{html}</p>"


def note(html: str) -> str:
    """A paragraph of HTML, smaller."""
    return f'<p class="note">{html}</p>'


def code(*commands: str) -> str:
    """What to type, a command on each line."""
    return f"<pre><code>{escape(chr(10).join(commands))}</code></pre>"


def definitions(texts: dict[str, str]) -> str:
    """What words mean; plain text."""
    return "<dl>" + "".join(f"<dt>{escape(word)}</dt><dd>{escape(text)}</dd>" for word, text in texts.items()) + "</dl>"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Plain text in rows; what follows a line break in a cell stands smaller below it. Too wide, it scrolls by itself."""
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "\n".join("<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    many = ' class="many"' if len(heads) >= MANY_COLUMNS else ""
    return f'<div class="wide"><table{many}>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>'


def figure(panels: Sequence[Panel], caption: str) -> str:
    """Pictures side by side, as many as fit, over a caption in HTML; nothing if there are none."""
    if not panels:
        return ""
    pictures = "\n".join(svg_of(panel) for panel in panels)
    return f'<figure><div class="panels">\n{pictures}\n</div><figcaption>{caption}</figcaption></figure>'


def _cell(text: str) -> str:
    first, _, rest = text.partition("\n")
    return f"{escape(first)}<small>{escape(rest)}</small>" if rest else escape(first)


def _renamed(svg: str, number: int) -> str:
    """Matplotlib gives parts of all its pictures the same names, and a page may have each only once."""
    return re.sub(r'\b(id="|href="#|url\(#)', rf"\g<1>p{number}-", svg)
