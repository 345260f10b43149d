"""What is changed: the mutants of a folder's sources, drawn by a seed, and those known to be equivalent."""
import contextlib
import pathlib
import random
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOMS = ("stimuli", "protocols", "data", "rendering", "runner", "analysis")

TOKEN = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<raw>R"(?P<mark>\w*)\(.*?\)(?P=mark)")
      | (?P<preprocessor>^[ ]*\#(?:\\\n|[^\n])*)
      | (?P<string>"(?:\\.|[^"\\\n])*")
      | (?P<character>'(?:\\.|[^'\\\n])+')
      | (?P<number>(?:0[xXbB][\da-fA-F']+|(?:\d[\d']*)?\.?\d[\d']*\.?(?:[eE][+-]?\d+)?)[uUlLfF]*)
      | (?P<word>[A-Za-z_]\w*)
      | (?P<operator><=>|<<=|>>=|->|::|\+\+|--|<<|>>|[<>=!+\-*/%&|^]=|&&|\|\||.)""",
    re.VERBOSE | re.DOTALL | re.MULTILINE)
SPACED = {"<": ("<=", ">="), ">": (">=", "<="), "<=": ("<", ">="), ">=": (">", "<="), "==": ("!=",),
          "!=": ("==",), "&&": ("||",), "||": ("&&",), "+": ("-",), "-": ("+",), "*": ("/",),
          "/": ("*",), "%": ("*",), "|": ("&",), "&": ("|",), "+=": ("-=",), "-=": ("+=",),
          "*=": ("/=",), "/=": ("*=",), "|=": ("&=",), "&=": ("|=",)}
PAIRS = (("true", "false"), ("min", "max"), ("front", "back"), ("begin", "end"), ("sin", "cos"),
         ("floor", "ceil"), ("first", "second"), ("any_of", "all_of"), ("lower_bound", "upper_bound"),
         ("break", "continue"), ("tip", "tail"), ("left", "right"), ("width", "height"))
OTHER = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
NOT_IN_STATEMENTS = re.compile(r"\b(static_assert|assert|using|operator|add_options|friend|requires|throw_with_nested)\b")
DELETABLE = re.compile(r"^\s*(?:[\w.:\[\]>*()-]+ (?:=|\+=|-=|\*=|/=|\|=|&=) .*|[\w.:\[\]>-]+\(.*\)|(?:\+\+|--)[\w.\[\]>-]+"
                       r"|break|continue|return|if \([^;]*\) (?:return|break|continue))\s*;\s*$")
ARGUMENTS = re.compile(r"\b(\w+)\(([\w.\[\]>-]+), ([\w.\[\]>-]+)\)")
SYMMETRIC = {"min", "max", "hypot", "dot", "if", "while", "for", "switch", "return", "swap", "distance", "min_element"}


def tokens(text):
    return [(m.lastgroup if m.lastgroup != "mark" else "raw", m.start(), m.group())
            for m in TOKEN.finditer(text) if not m.group().isspace()]


def number_mutants(literal):
    body = literal.rstrip("uUlLfF")
    if literal[:2].lower() in ("0x", "0b"):
        return ()
    if re.fullmatch(r"\d[\d']*", body):
        value, suffix = int(body.replace("'", "")), literal[len(body):]
        return (f"{value + 1}{suffix}",) if value == 0 else (f"{value + 1}{suffix}", f"{value - 1}{suffix}")
    value = float(body.replace("'", ""))
    return ("1.0",) if value == 0 else (f"({literal} * 2)", f"({literal} * 0.5)")


def excluded_spans(text, all_tokens):
    """Statements that hold an assertion, a declaration of options or an alias; template heads."""
    spans, begin, words, depth = [], 0, False, 0
    for kind, at, token in all_tokens:
        if kind in ("comment", "preprocessor", "raw"):
            continue
        depth += (token in ("(", "[")) - (token in (")", "]"))
        if token in (";", "{", "}") and depth <= 0:
            if words:
                spans.append((begin, at + 1))
            begin, words, depth = at + 1, False, 0
        elif kind == "word" and NOT_IN_STATEMENTS.fullmatch(token):
            words = True
    spans += [m.span() for m in re.finditer(r"^\s*template <[^\n]*", text, re.MULTILINE)]
    return spans


class Sites:
    """What may be changed in a text: rows[line index] = [(column, old, new, is_text)]."""

    def __init__(self, text):
        every = tokens(text)
        self.text, self.lines, self.rows = text, text.split("\n"), {}
        self.code = [t for t in every if t[0] not in ("comment", "preprocessor")]
        self.spans = excluded_spans(text, every)
        self.starts = [0] + [m.end() for m in re.finditer("\n", text)]
        in_line = {}
        for index, (_, at, _) in enumerate(self.code):
            in_line.setdefault(self.place(at)[0], []).append(index)
            self.of_token(index)
        for row, members in in_line.items():
            self.of_line(row, members)

    def place(self, at):
        low, high = 0, len(self.starts)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self.starts[middle] <= at else (low, middle)
        return low, at - self.starts[low]

    def add(self, at, old, new, is_text=False):
        if old == new or any(a <= at < b for a, b in self.spans):
            return
        row, column = self.place(at)
        self.rows.setdefault(row, []).append((column, old, new, is_text))

    def of_token(self, index):
        kind, at, token = self.code[index]
        last = self.code[index - 1][2] if index else ""
        declared = token not in ("true", "false", "break", "continue") and last != "return" and \
            re.match(r"[\w>&*]", last[-1:])
        if kind == "operator":
            self.of_operator(index, last)
        elif kind == "number" and self.text[at + len(token):at + len(token) + 1] != ">":
            for new in number_mutants(token):
                self.add(at, token, new)
        elif kind == "word" and token in OTHER and not declared:
            self.add(at, token, OTHER[token])
        elif kind == "string" and last != "extern":
            self.add(at, token, '""' if len(token) > 2 else '"?"', True)

    def of_operator(self, index, last):
        _, at, token = self.code[index]
        before, after = self.text[at - 1:at], self.text[at + len(token):at + len(token) + 1]
        neighbours = [self.code[i][0] for i in (index - 1, index + 1) if 0 <= i < len(self.code)]
        spaced = before in " \n" and after in " \n"
        if token in SPACED and spaced and "string" not in neighbours:
            for new in SPACED[token]:
                self.add(at, token, new)
        elif token == "!" or (token == "-" and after.strip() and before in " ([{" and
                              (last in "([{,?:=<>&|+*/" or last in ("return", "&&", "||", "==", "<="))):
            self.add(at, token, "")
        elif token in ("++", "--") and "for (" not in self.lines[self.place(at)[0]]:
            self.add(at, token, "--" if token == "++" else "++")

    def of_line(self, row, members):
        """Statements without effect, and arguments exchanged."""
        if any(self.code[i][0] == "raw" for i in members):
            return
        line, first = self.lines[row], members[0]
        end_before = self.code[first - 1][2] if first else ";"
        if end_before in (";", "{", "}", ")", ":", "else") and DELETABLE.match(line) and \
                line.count("(") == line.count(")"):
            column = len(line) - len(line.lstrip())
            self.add(self.starts[row] + column, line.strip(), ";")
        for match in ARGUMENTS.finditer(line):
            name, one, two = match.groups()
            if name not in SYMMETRIC and one != two:
                self.add(self.starts[row] + match.start(), match.group(), f"{name}({two}, {one})")


def sites(text):
    return sorted(Sites(text).rows.items())


def sources(tree, folder):
    return sorted(p for ending in ("*.cpp", "*.h") for p in (tree / folder).rglob(ending))


def draw(tree, folder, seed):
    """All mutants of a folder that this seed would try, in its order."""
    chance = random.Random(f"{folder} {seed}")
    rows = []
    for path in sources(tree, folder):
        text = path.read_text()
        lines = text.split("\n")
        for row, options in sites(text):
            rows.append((str(path.relative_to(tree)), row, lines[row], options))
    chance.shuffle(rows)
    for name, row, line, options in rows:
        if all(is_text for *_, is_text in options) and chance.random() >= 0.25:
            continue
        column, old, new, is_text = chance.choice(options)
        assert line[column:column + len(old)] == old, (name, row, old)
        yield {"file": name, "line": row + 1, "before": line, "text": is_text,
               "after": line[:column] + new + line[column + len(old):]}


def locate(tree, mutant):
    """(path, line index) of a mutant whose file may have moved or changed since, or None."""
    path = tree / mutant["file"]
    if not path.exists():
        same = [p for room in ROOMS for p in sources(tree, room) if p.name == path.name]
        if len(same) != 1:
            return None
        path = same[0]
    lines = path.read_text().split("\n")
    rows = [i for i, line in enumerate(lines) if line == mutant["before"]]
    return (path, min(rows, key=lambda i: abs(i + 1 - mutant["line"]))) if rows else None


@contextlib.contextmanager
def applied(tree, mutant, before=""):
    """The mutant stands in the copy, with `before` put before its file."""
    path, row = locate(tree, mutant)
    original = path.read_bytes()
    lines = original.decode().split("\n")
    lines[row] = mutant["after"]
    try:
        path.write_text(before + "\n".join(lines))
        yield
    finally:
        path.write_bytes(original)


def equivalents():
    """equivalent.txt: blocks of `file`, `- before`, `+ after` and the reason, parted by empty lines."""
    known = {}
    path = HERE / "equivalent.txt"
    for block in path.read_text().split("\n\n") if path.exists() else ():
        lines = [line for line in block.strip().split("\n") if not line.startswith("#")]
        if len(lines) >= 4 and lines[1].startswith("- ") and lines[2].startswith("+ "):
            known[(pathlib.Path(lines[0]).name, lines[1][2:].strip(), lines[2][2:].strip())] = " ".join(lines[3:])
        elif any(lines):
            sys.exit(f"{path}: a block must be file, '- before', '+ after', reason; not:\n{block}")
    return known


def key(mutant):
    return pathlib.Path(mutant["file"]).name, mutant["before"].strip(), mutant["after"].strip()
