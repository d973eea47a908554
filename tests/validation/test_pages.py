"""Figures and templates of pages."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import pytest
from jinja2 import UndefinedError
from matplotlib.figure import Figure
from PIL import Image

from validation.pages import filled, save_figure
from validation.pages.templates import address, code, escaped, shown


def drawn():
    figure = Figure(figsize=(3.0, 2.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0, 2.0], [0.1234567, 3.0, 1.0], "k", marker="o")
    axes.set_xlabel("speed [Hz]")
    return figure


def saved(folder, name="response", caption="a <b> & c"):
    return save_figure(drawn(), folder, name, caption, "fegear sets")


def test_svg_and_png_are_written_and_can_be_read(tmp_path):
    figure = saved(tmp_path)
    assert (figure.svg, figure.png) == ("figures/response.svg", "figures/response.png")
    root = ElementTree.parse(tmp_path / figure.svg).getroot()
    assert "speed [Hz]" in "".join(root.itertext())
    with Image.open(tmp_path / figure.png) as image:
        assert image.size == (480, 320)


def test_equal_input_gives_equal_bytes(tmp_path):
    one, two = saved(tmp_path / "one"), saved(tmp_path / "two")
    assert one.inline == two.inline
    for name in (one.svg, one.png, one.interactive):
        first, second = ((tmp_path / d / name).read_bytes() for d in ("one", "two"))
        assert first == second


def test_inline_figures_share_no_identifier_and_take_the_ink_of_the_page(tmp_path):
    one, two = saved(tmp_path), saved(tmp_path, "other")
    texts = [figure.inline for figure in (one, two)]
    ids = [set(re.findall(r'\sid="([^"]+)"', text)) for text in texts]
    assert ids[0]
    assert not ids[0] & ids[1]
    for text, identifiers in zip(texts, ids, strict=True):
        ElementTree.fromstring(text)
        assert set(re.findall(r'(?:url\(#|href="#)([^)"]+)', text)) == identifiers
        assert "#000000" not in text
        assert "currentColor" in text
        assert "a &lt;b&gt; &amp; c" in text
        assert not re.search(r"\d\.\d{3}", text.split("<defs>", 1)[1])


def test_templates_escape_text_and_refuse_what_is_missing():
    page = {"about": {"who": "<script>"}}
    assert "&lt;script&gt;" in filled("page.html", **page)
    with pytest.raises(UndefinedError):
        filled("page.html")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (110.4, "110"),
        (-0.08314, "-0.0831"),
        (2.98e8, "2.98e+08"),
        (1234.5, "1230"),
        (3e-16, "3e-16"),
        (math.nan, "-"),
        (None, "-"),
    ],
)
def test_numbers_are_shown_with_three_digits(value, text):
    assert shown(value) == text


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("plain, 3.5 of m-1", "plain, 3.5 of m-1"),
        ("a | b *c* _d_ `e`", r"a \| b \*c\* \_d\_ \`e\`"),
        ("[x](http://y) <script>", r"\[x\](http://y) \<script\>"),
        ("one\n# two", "one # two"),
        ("# one", r"\# one"),
        ("1. one", r"1\. one"),
        ("- one", r"\- one"),
        ("--", r"\--"),
    ],
)
def test_texts_are_escaped_in_markdown(text, written):
    assert escaped(text) == written
    assert escaped(escaped(text)) == written


def test_commands_and_addresses_in_markdown():
    assert escaped(code("fegear show a*b")) == "`fegear show a*b`"
    assert code("a `b` c") == "`` a `b` c ``"
    assert escaped(address("figures/a b_(1).png")) == "figures/a%20b_%281%29.png"
    assert escaped(3.5) == 3.5
