"""The bugs that tools/mutate puts in: operators, and the places in the sources that they can change.

An operator takes a line and gives (start, end, text) of each of its places: what is from start to end becomes the text.
"""

import io
import pathlib
import random
import re
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Sources are searched as they are but for comments (blanks), strings (quotes), and template arguments (tildes).
NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])+\''
                     r"|^[ ]*#(?:[^\n]*\\\n)*[^\n]*|\b(?:static_)?assert\([^;]*;", re.DOTALL | re.MULTILINE)
TEMPLATE_ARGUMENTS = re.compile(r"(?<=\w)<[\w:,.*&~\[\] ]*>")
LEFT_ALONE = re.compile(r"^\s*(?:template|using|namespace|case|import|from|def|class|assert|@)\b|^\s*enum\b|reserve\("
                        r"|shrink_to_fit|PetscLog|LogScope|LogEvent|log_event|flops")
OPERAND = r"[\w.]*\w(?:\(\))?(?![\w.(\[:~]|->)"
NUMBER = re.compile(r"(?<![\w.\[-])(?<!\[:)(?:\d+\.?\d*(?:e-?\d+)?)(?![\w.])")
BALANCED = r"\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)"
WIDE = r"double|long long|std::(?:size_t|ptrdiff_t|u?int64_t)"
WIDE_TYPES = {"double", "long long", "Eigen::Index", "std::size_t", "std::ptrdiff_t", "std::int64_t", "std::uint64_t"}
NUMBERS = WIDE_TYPES | {"int", "PetscInt", "bool"}
DECLARED = re.compile(rf"\b({WIDE}|int|bool|[A-Z]\w*(?:::\w+)*|std::\w+(?:<[^;(){{}}=]*?>)?)[&*]* (\w+)")
STATEMENT = re.compile(r"^(\s*)(?:\+\+|--|\*)*([A-Za-z_][\w:]*)(?:(?:\.|->)\w+|\[[^\]]*\]|\([^()]*\)|~)*"
                       r"(?: [-+*/|&%]?= .*|\(.*\)|(?:\.|->).*|\+\+|--)?(;?)$")
KEYWORDS = {"return", "break", "continue", "throw", "default", "pass", "raise", "yield", "else", "private", "public",
            "protected", "delete", "try", "finally", "if", "for", "while", "switch", "with", "lambda"}
REDUCED = re.compile(r"\b(?:on_any_rank|\w+_over_ranks|global_sum)\([\w.>()-]+, ")
REDUCTION = re.compile(r"^(\s*)(?:[\w.>()\[\]*-]+(?:\.|->))?(?:MPI_Allreduce|MPI_Exscan|\w+_over_ranks|\w*update_ghosts"
                       r"|add_ghosts)\(")


class Line:
    """A line of a source: its text, its code without strings and comments, and that without template arguments."""

    def __init__(self, path, number, text, code, before, depth, types):
        self.path, self.number, self.text, self.code, self.types = path, number, text, code, types
        self.bare = code
        found = 1
        while found:
            self.bare, found = TEMPLATE_ARGUMENTS.subn(lambda match: "~" * len(match[0]), self.bare)
        # Whether a statement begins here: before is the code of the line above, depth how many brackets are open.
        self.begins = depth == 0 if path.suffix == ".py" else before[-1:] in ";{}:"
        self.is_text = '"' in code  # sums of strings are messages

    def types_of(self, operand):
        """The types that a name is declared with somewhere, those of numbers for numbers."""
        if re.fullmatch(r"\d+|true|false", operand):
            return {"int"}
        if re.fullmatch(r"[\d.]+(e-?\d+)?", operand):
            return {"double"}
        if re.search(r"\b(abs|sqrt|norm|squaredNorm|dot|maxCoeff|minCoeff)\b", operand):
            return {"double"}
        if re.search(r"\bsize(of)?$", operand):
            return {"std::size_t"}
        name = re.findall(r"[A-Za-z_]\w*", operand)
        return self.types.get(name[-1], set()) if name else set()

    def neighbours(self, start, end):
        """The operands on both sides of what is from start to end, as far as they are simple."""
        left = re.search(r"([\w.>-]*\w)(?:\([\w.]*\)|\[\w*\])?(?: [-+*/])? ?$", self.bare[:start])
        right = re.match(r" ?(?:[-+*/] )?-?(\d[\w.]*|[\w.:]*\w)", self.bare[end:])
        return [match[1] if match else "" for match in (left, right)]


def signs(line):
    for match in re.finditer(r"(?<= )[+-](?= (?!0\b)|$)|(?<= )[+-](?== )|(?<![\w)\] ] )(?<![-\w)\]])-(?=[\w(])"
                             r"|(?<=return )-(?=[\w(])", line.bare):
        if not (match[0] == "+" and line.is_text):
            is_binary = re.match(r"[ =]|$", line.bare[match.end():])
            yield *match.span(), {"+": "-", "-": "+"}[match[0]] if is_binary else ""


def comparisons(line):
    for match in re.finditer(r"(?<= )(?:[<>]=?|[=!]=)(?= |$)|\b(?:std::|numpy\.)?m(?:in|ax)(?=(?:imum)?\()", line.bare):
        put = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}.get(match[0])
        if put is None:
            put = match[0].replace("min", "max") if "min" in match[0] else match[0].replace("max", "min")
        elif match[0][0] in "<>":
            sides = line.neighbours(*match.span())
            if "0" not in sides and any(line.types_of(side) == {"double"} for side in sides):
                put = match[0].translate(str.maketrans("<>", "><"))
        yield *match.span(), put


def indices(line):
    for match in re.finditer(r"(?<=[\w)\]]\[)(?:[a-z]\w*|[01])(?=\])|(?<=\.(?:col|row)\()\w+(?=\))", line.bare):
        if not re.search(r"\b(?:double|int|bool|char|PetscInt) \w+\[$", line.bare[:match.start()]):  # a declaration
            yield *match.span(), {"0": "1", "1": "0"}.get(match[0], match[0] + " + 1")


def factors(line):
    for match in re.finditer(rf" ([*/])( {OPERAND}|= )", line.bare):
        if match[2].strip() not in {"1", "1.0"}:
            is_dropped = match[1] == "*" and match[2] != "= "
            yield *match.span(), "" if is_dropped else f" {'*' if match[1] == '/' else '/'}{match[2]}"
    for match in NUMBER.finditer(line.bare):
        if float(match[0]) != 0 and not re.fullmatch(r"1e-?\d+|1?0+\.0*1?", match[0]) and "MPI_" not in line.bare:
            yield *match.span(), str(2 * int(match[0])) if match[0].isdigit() else repr(2 * float(match[0]))


def swapped_arguments(line):
    argument = r"-?[\w.]+(?:->\w+)*(?:\(\)|\[\w+\])?"
    for match in re.finditer(rf"(?<=[(,])( ?)({argument}), (?=({argument})[,)])", line.bare):
        call = re.search(r"(\w+)~*\($", line.bare[:match.start()])
        types = [{"number" if kind in NUMBERS else kind for kind in line.types_of(match[group])} for group in (2, 3)]
        if all(types) and not types[0] & types[1] or "MPI_" in line.bare:
            continue  # would not compile
        is_call = call and call[1] not in {"min", "max", "hypot", "swap", "minmax", "minimum", "maximum", "dot"}
        is_call = is_call or line.bare[match.start() - 1] == "," and "(" in line.bare[:match.start()]
        if match[2] != match[3] and is_call:
            yield match.start(2), match.end(3), f"{match[3]}, {match[2]}"


def dropped_statements(line):
    match = STATEMENT.match(line.bare)
    if match and line.begins and match[2] not in KEYWORDS and bool(match[3]) == (line.path.suffix != ".py") \
            and all(line.bare.count(opens) == line.bare.count(closes) for opens, closes in ("()", "[]", "{}")) \
            and line.bare.strip(" ;") != match[2] and not REDUCTION.match(line.bare) \
            and not re.search(r"Restore|Destroy|close\(|free\(", line.bare) \
            and not (line.path.suffix == ".h" and match[2][0].isupper()):  # a constructor
        yield match.end(1), len(line.bare), match[3] or "pass"


def dropped_reductions(line):
    if line.path.suffix != ".py":
        for match in REDUCED.finditer(line.bare):
            yield *match.span(), "("
        match = REDUCTION.match(line.bare)
        if match and line.begins:
            yield match.end(1), match.end(1), "if (false) "


def overflows(line):
    for match in re.finditer(rf"static_cast<({WIDE})>({BALANCED})", line.code):
        # Of a product or a quotient with what is no wider.
        before, after = line.code[:match.start()], line.code[match.end():]
        times = r" [*/] " if match[1] == "double" else r" [*] "
        factors_before = re.search(r"((?:[\w.>()-]+ [*/] )*)$", before)[1]
        sides = [line.types_of(factor.strip("()")) for factor in re.split(" [*/] ", factors_before)[:-1]]
        is_second = re.search(times + "$", before) and sides and sides[-1]
        is_first = re.match(times, after) and not re.search(r" [*/] $", before)
        if is_first:
            sides.append(line.types_of(line.neighbours(*match.span())[1]))
        is_wide = "static_cast" in before + after or any(types & WIDE_TYPES for types in sides)
        if (is_first or is_second) and not is_wide:
            yield *match.span(), match[2]
    for match in re.finditer(r"\b(?<!unsigned )(?:long long|std::u?int64_t|PetscInt64)\b(?!&? [\w:]+[(,)])", line.code):
        cast = re.match(r">\((.*?)\)*[,; )]", line.code[match.end():])
        is_small = cast and line.types_of(cast[1]) and line.types_of(cast[1]) <= {"int", "PetscInt", "bool"}
        if not is_small and not re.search(r"constexpr.* = \d+;", line.code):
            yield *match.span(), "int"


OPERATORS = {"sign": signs, "comparison": comparisons, "index": indices, "factor": factors,
             "swapped arguments": swapped_arguments, "dropped statement": dropped_statements,
             "dropped reduction or ghost update": dropped_reductions, "overflow": overflows}


class Mutant:
    """A bug: the operator and the line, and what the line becomes."""

    def __init__(self, operator, line, start, end, put):
        self.operator, self.path, self.line, self.old = operator, line.path, line.number, line.text
        self.new = line.text[:start] + put + line.text[end:]

    def key(self):
        return self.path, self.line, self.new

    def title(self):
        return f"{self.path}:{self.line} {self.operator}"

    def change(self):
        return f"      {self.old.strip()}\n   -> {self.new.strip()}"

    def applied(self, text):
        lines = text.split("\n")
        assert lines[self.line - 1] == self.old
        lines[self.line - 1] = self.new
        return "\n".join(lines)


def code_of(path, text):
    """@returns the text, in which what is no code is blank, and strings are quotes."""

    def blank(match):
        return re.sub(r"[^\n]", '"' if match[0][0] in "\"'R" else " ", match[0])

    if path.suffix != ".py":
        return NO_CODE.sub(blank, text)
    lines = text.split("\n")
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        name, (first, start), (last, end) = tokenize.tok_name[token.type], token.start, token.end
        if name == "COMMENT" or name == "STRING" or name.startswith("FSTRING"):
            for number in range(first, last + 1):
                line = lines[number - 1]
                left, right = start if number == first else 0, end if number == last else len(line)
                lines[number - 1] = line[:left] + (" " if name == "COMMENT" else '"') * (right - left) + line[right:]
    return "\n".join(lines)


def all_sites():
    """@returns {operator: its mutants}, of all sources, in the order of their names."""
    paths = sorted([*ROOT.glob("src/**/*.h"), *ROOT.glob("src/**/*.cpp"), *ROOT.glob("postproc/*.py")])
    texts = {path: path.read_text(encoding="utf-8") for path in paths}
    codes = {path: code_of(path, text) for path, text in texts.items()}
    types = {}
    for code in codes.values():
        for kind, name in DECLARED.findall(code):
            types.setdefault(name, set()).add(kind)
    sites = {operator: [] for operator in OPERATORS}
    for path in paths:
        name, before, depth = path.relative_to(ROOT), ";", 0
        for number, (text, code) in enumerate(zip(texts[path].split("\n"), codes[path].split("\n")), 1):
            code = code.rstrip()
            if len(code.strip()) > 3 and not LEFT_ALONE.search(code):
                line = Line(name, number, text, code, before, depth, types)
                for operator, find in OPERATORS.items():
                    sites[operator] += (Mutant(operator, line, *site) for site in find(line))
            before = code or before
            depth += len(re.findall(r"[(\[{]", code)) - len(re.findall(r"[)\]}]", code))
    return sites


def draw(sites, seed):
    """Draws mutants without end, none twice."""
    chance, drawn = random.Random(seed), set()
    while len(drawn) < sum(map(len, sites.values())):
        mutant = chance.choice(sites[chance.choice(list(OPERATORS))])
        if mutant.key() not in drawn:
            drawn.add(mutant.key())
            yield mutant
