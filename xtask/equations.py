"""Sets the equations of the documentation as mathematics when the site is built.

A page needs no script and nothing from another server: MathML, which browsers show, replaces the TeX between `$$`. mkdocs
calls this hook after the extension pymdownx.arithmatex has marked the equations.
"""

import html
import re

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError

EQUATION = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)


def on_page_content(content, page, **_):
    """Return the page with its equations as MathML."""

    def mathml(match):
        tex = html.unescape(match[1]).strip()
        try:
            made = convert(tex, display="block")
        except Exception as error:  # the library has many classes of errors without a common base
            raise PluginError(f"{page.file.src_uri}: the equation cannot be set: {tex}: {error!r}") from error
        # What the library does not know, it writes as it is.
        if "\\" in re.sub(r"&#[^;]*;", "", made):
            raise PluginError(f"{page.file.src_uri}: a command of TeX is not known: {tex}")
        return made

    return EQUATION.sub(mathml, content)
