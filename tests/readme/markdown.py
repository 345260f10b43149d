"""What the tests of the READMEs need of Markdown: links, headings, code spans, blocks and tables."""

import pathlib
import re
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
ROOMS = ["stimuli", "rendering", "protocols", "data", "analysis", "runner", "tests"]
READMES = ["README.md"] + [f"{room}/README.md" for room in ROOMS] + ["runner/participants/README.md",
                                                                               "runner/python/README.md"]
CONTRIBUTING = ".github/CONTRIBUTING.md"  # not installed

SHELL = ("sh", "bash", "shell", "console")
RUN, NOT_RUN = "sh test", "sh not tested: "  # marks of blocks

FENCE = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```$", re.M | re.S)


class Block:
    """A fenced block: its words after the fence, its lines without the common indentation, where it begins."""

    def __init__(self, text, match):
        self.words = match.group(2).strip()
        self.text = textwrap.dedent(match.group(3))
        self.line = text.count("\n", 0, match.start()) + 1

    def language(self):
        return self.words.split(" ")[0]


class Page:
    def __init__(self, name, root=ROOT):
        self.name = name
        self.path = root / name
        self.text = self.path.read_text()
        self.blocks = [Block(self.text, match) for match in FENCE.finditer(self.text)]
        # Blanked, not removed: lines keep their numbers.
        self.prose = FENCE.sub(lambda match: "\n" * match.group(0).count("\n"), self.text)

    def headings(self):
        """(level, text) in order."""
        return [(len(marks), words.strip()) for marks, words in re.findall(r"^(#+) (.*)$", self.prose, re.M)]

    def anchors(self):
        """As a code host makes them of headings: lower case, words joined by hyphens, no punctuation; the second of
        one name gets -1."""
        seen, out = {}, set()
        for _, words in self.headings():
            anchor = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
            count = seen.get(anchor, 0)
            seen[anchor] = count + 1
            out.add(f"{anchor}-{count}" if count else anchor)
        return out

    def links(self):
        """(line, text, target), pictures included."""
        text = re.sub(r"`[^`\n]*`", lambda span: re.sub(r"[\[\]()]", " ", span.group(0)), self.prose)
        return [(text.count("\n", 0, match.start()) + 1, match.group(1), match.group(2))
                for match in re.finditer(r"\[([^\]]*)\]\(([^)]*)\)", text)]

    def spans(self):
        """(line, code) of the code spans outside of blocks."""
        return [(self.prose.count("\n", 0, match.start()) + 1, match.group(1))
                for match in re.finditer(r"`([^`\n]+)`", self.prose)]

    def section(self, heading):
        """The text below a heading, up to the next of its level or above."""
        lines, level, out = self.text.splitlines(), None, []
        for line in lines:
            match = re.match(r"^(#+) (.*)$", line)
            if level is None:
                if match and match.group(2).strip() == heading:
                    level = len(match.group(1))
            elif match and len(match.group(1)) <= level:
                break
            else:
                out.append(line)
        if level is None:
            raise AssertionError(f"{self.name} has no heading '{heading}'")
        return "\n".join(out)


PAGES = {name: Page(name) for name in READMES + [CONTRIBUTING]}


def cells(section):
    """Rows of the tables of a section, each a list of its cells, without heads."""
    rows, out = section.splitlines(), []
    for i, row in enumerate(rows):
        if not row.lstrip().startswith("|") or re.match(r"^ *\|[-| ]+\|$", row):
            continue
        if i + 1 < len(rows) and re.match(r"^ *\|[-| ]+\|$", rows[i + 1]):
            continue  # the head
        out.append([cell.strip() for cell in re.split(r"(?<!\\)\|", row.strip().strip("|"))])
    return out


def codes(text):
    return re.findall(r"`([^`]+)`", text)


def broken_links(root, names=None):
    """(faults, number of links) of the pages below a folder. Addresses are looked at, not asked for."""
    names = names or [path.relative_to(root).as_posix() for path in sorted(root.rglob("README.md"))]
    faults, followed = [], 0
    for page in (Page(name, root) for name in names):
        for line, _, target in page.links():
            followed += 1
            place = f"{page.name}:{line}: {target}"
            path, _, anchor = target.partition("#")
            file = (page.path.parent / path).resolve() if path else page.path.resolve()
            if re.match(r"[a-z]+:", target):
                if not re.fullmatch(r"https://[\w.-]+\.[a-z]+(/[^\s]*)?", target):
                    faults.append(f"{place} is no address")
            elif root.resolve() not in file.parents or not file.is_file():
                faults.append(f"{place} leads to no file")
            elif anchor and anchor not in Page(file.relative_to(root.resolve()).as_posix(), root).anchors():
                faults.append(f"{place}: no such heading")
    return faults, followed
