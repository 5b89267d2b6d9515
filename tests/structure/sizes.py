"""How long files, lines and functions are, and how many parameters a function has: told from text as clang-format
leaves it."""

import ast
import re

MOST_LINE = 120
MOST_FILE = 400
MOST_FUNCTION = 60
MOST_PARAMETERS = 8

TOKEN = re.compile(
    r"""//[^\n]*|/\*.*?\*/                                 # comments
      | R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"               # raw strings
      | "(?:\\.|[^"\\\n])*" | '(?:\\.|[^'\\\n])+'          # strings, characters
      | ^[ \t]*\#(?:\\\n|[^\n])*                           # preprocessor
    """, re.X | re.S | re.M)
NUMBER_WITH_MARKS = re.compile(r"(?<=[0-9a-fA-F])'(?=[0-9a-fA-F])")
CONTROL = re.compile(r"\s*(?:if|for|while|switch|catch|do|else|return|throw|using|typedef|static_assert|namespace)\b")
HEAD = re.compile(r"(?:(?:\w+::)*operator\s*(?:\(\s*\)|[^\s\w(]+|\w+)|(?:[\w:~]|<[^<>]*>)+)\s*\(")


def blank(text):
    """The text without comments, strings and preprocessor lines; every other character stays where it is."""
    def spaces(match):
        return re.sub(r"[^\n]", " ", match.group())
    return TOKEN.sub(spaces, NUMBER_WITH_MARKS.sub(" ", text))


def closing(text, begin):
    """Where the bracket that opens at `begin` closes."""
    depth = 0
    for i in range(begin, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0:
            return i
    return len(text)


def parameters_of(text):
    """How many there are between the brackets of a function's head; commas within <>, () and {} do not part them."""
    if text.strip() in ("", "void"):
        return 0
    depth, count = 0, 1
    for i, c in enumerate(text):
        depth += (c in "([{<") - (c in ")]}" or (c == ">" and text[i - 1] != "-"))
        count += c == "," and depth == 0
    return count


def without_template(text):
    """The text without a `template <...>` at its head."""
    match = re.match(r"\s*template\s*<", text)
    if not match:
        return text
    depth, i = 1, match.end()
    while depth > 0 and i < len(text):
        depth += (text[i] == "<") - (text[i] == ">")
        i += 1
    return text[i:]


def head_of(text):
    """(name, number of parameters) if this text before a brace or a semicolon is the head of a function, else None."""
    bare = re.sub(r"^\s*(?:public|private|protected)\s*:", "", text)
    bare = without_template(bare)
    if "=" in bare.split("(")[0] and "operator" not in bare.split("(")[0]:
        return None
    if CONTROL.match(bare):
        return None
    match = HEAD.search(bare)
    while match and re.match(r"(?:__attribute__|alignas|decltype|noexcept|requires)\s*\(", match.group()):
        match = HEAD.search(bare, closing(bare, match.end() - 1))
    if not match:
        return None
    begin = match.end() - 1
    return match.group()[:-1].strip(), parameters_of(bare[begin + 1:closing(bare, begin)])


def functions(text):
    """(name, first line, last line, parameters) of each function that is defined here, or declared (last line 0)."""
    text = blank(text)
    found = []
    scan(text, 0, len(text), found)
    return found


def scan(text, begin, end, found):
    """Walks over what stands between braces of namespaces and classes; bodies of functions are skipped as a whole."""
    start = i = begin
    while i < end:
        c = text[i]
        if c in "([":
            i = closing(text, i)
        elif c == ";":
            head = head_of(text[start:i])
            if head and re.match(r"[\s\w:<>,*&~\[\]]*\s[\w:~<>*&]*$", text[start:i].split("(")[0] or " "):
                found.append((head[0], line_of(text, start), 0, head[1]))
            start = i + 1
        elif c == "{":
            last = closing(text, i)
            before = text[start:i]
            head = head_of(before)
            if head and not is_member_initialiser(before):
                found.append((head[0], line_of(text, start), text.count("\n", 0, last) + 1, head[1]))
                start = last + 1
            elif re.match(r"\s*(?:(?:public|private)\s*:\s*)?(?:inline\s+)?(?:namespace|class|struct|union|extern)\b",
                          without_template(before)):
                scan(text, i + 1, last, found)
                start = last + 1
            i = last
        elif c == ":" and re.fullmatch(r"\s*(?:public|private|protected)\s*", text[start:i]):
            start = i + 1
        i += 1


def is_member_initialiser(before):
    """Whether the brace belongs to `: member{` rather than to the body."""
    return re.search(r"\)\s*(?:noexcept\s*)?:[^:].*[\w>]\s*$", before, re.S) is not None


def line_of(text, start):
    """Of the first character from `start` on that is not blank."""
    skipped = len(text[start:]) - len(text[start:].lstrip())
    return text.count("\n", 0, start + skipped) + 1


def python_functions(text):
    """As functions(), of Python; what is given by name alone is no parameter to keep in order."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            every = node.args.posonlyargs + node.args.args
            own = [a for a in every if a.arg not in ("self", "cls")]
            yield node.name, node.lineno, node.end_lineno, len(own)


def check_functions(where, found):
    faults = []
    for name, first, last, parameters in found:
        if last and last - first + 1 > MOST_FUNCTION:
            faults.append("%s:%d: %s has %d lines" % (where, first, name, last - first + 1))
        if parameters > MOST_PARAMETERS:
            faults.append("%s:%d: %s has %d parameters" % (where, first, name, parameters))
    return faults


def check_text(where, text, with_functions):
    """What is too long in one file. @param where  its path, as messages name it"""
    lines = text.splitlines()
    faults = ["%s:%d: %d columns" % (where, n + 1, len(line)) for n, line in enumerate(lines) if len(line) > MOST_LINE]
    if len(lines) > MOST_FILE:
        faults.append("%s: %d lines" % (where, len(lines)))
    if with_functions and where.endswith((".h", ".cpp")):
        faults += check_functions(where, functions(text))
    if with_functions and where.endswith(".py"):
        faults += check_functions(where, python_functions(text))
    return faults
