"""What MkDocs does not do by itself: equations become MathML, which browsers show without scripts; links to files of
the project lead to copies of them."""
import pathlib
import re

from latex2mathml.converter import convert

ROOT = pathlib.Path(__file__).parents[2]
SOURCES = set()


def equations(text):
    text = re.sub(r"\$\$(.+?)\$\$", lambda m: "\n<div class=\"equation\">" + convert(m[1].strip(), display="block") + "</div>\n",
                  text, flags=re.S)
    return re.sub(r"(?<![\w$`\\])\$([^$`\n]+?)\$(?!\w)", lambda m: convert(m[1]), text)


def without_code(text, change):
    """Changes what is neither a fenced block nor code in a line."""
    parts = re.split(r"(^```.*?^```|`[^`\n]*`)", text, flags=re.M | re.S)
    return "".join(part if i % 2 else change(part) for i, part in enumerate(parts))


def project_link(match):
    text = re.sub("`([^`]*)`", r"<code>\1</code>", match[1])
    return f'<a href="source/{match[2].rstrip("/")}.txt">{text}</a>'


def on_page_markdown(markdown, page, **_):
    for path in re.findall(r"\]\(\.\./([^)#\s]+)(?:#[^)\s]*)?\)", markdown):
        SOURCES.add(path.rstrip("/"))
    markdown = without_code(markdown, equations)
    # Made of HTML, for MkDocs to leave it as it is: the copies are written after the pages.
    return re.sub(r"\[([^\]]*)\]\(\.\./([^)#\s]+)(?:#[^)\s]*)?\)", project_link, markdown)


def on_post_build(config, **_):
    for path in sorted(SOURCES):
        file, copy = ROOT / path, pathlib.Path(config["site_dir"]) / "source" / f"{path}.txt"
        if not file.exists():
            raise FileNotFoundError(f"a page links to {path}, which does not exist")
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text("\n".join(sorted(p.name for p in file.iterdir())) if file.is_dir()
                        else file.read_text(errors="replace"))
