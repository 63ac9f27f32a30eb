"""README.md and docs/ as the tests read them: pages, links, blocks of code, and the options of input/OPTIONS.md."""

import pathlib
import re
import shlex
import subprocess
import unicodedata

import yaml

FENCE = re.compile(r"^```(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
PATH = re.compile(r"(?:src|tests|tools|postproc|input|meshes|cmake|docs)/[\w./-]+")
# Options of PETSc's solvers stand below these, and those of the program itself beside the table.
SOLVERS = {"project", "spring", "elastic", "prism", "heat", "gas", "replay"}
OF_THE_PROGRAM = {"help", "version", "options_table", "log_view", "options_file", "mesh_only"}
# Where columns of tables and fields of frames are declared as {"name", "unit"} and {"name", components, values}.
COLUMN = re.compile(r'(?:report\.add\(|\{)"([a-z_0-9]+)",\s*"([^"]*)"[,}]')
DRAWN = re.compile(r'add_on_\w+\("([a-z_]+)"')
REGISTERED = re.compile(r'\{"([a-z_]+)", "([^"]*)", Item::\w+, Drawn::(?:yes|of_both_layers)')


class Block:
    """A fenced block of code: its language, text, and where it begins."""

    def __init__(self, page, line, language, text):
        self.page, self.line, self.language, self.text = page, line, language, text

    def where(self):
        return f"{self.page}:{self.line}"

    def commands(self):
        """Commands of a block of sh or console, a list of words each, split at && too."""
        for line in self.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            while words:
                end = words.index("&&") if "&&" in words else len(words)
                yield words[:end]
                words = words[end + 1:]

    def file_name(self):
        """Of a block of yaml that is a file by its first line, a comment."""
        first = re.match(r"# (\w+\.yaml)\n", self.text)
        return first[1] if first else None


def slug(heading):
    """The anchor of a heading, as MkDocs and forges make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
    text = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode("ascii")
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", text).strip().lower())


def without_code(text):
    """The text with blocks and inline code blanked, lines kept."""
    text = FENCE.sub(lambda block: "\n" * block[0].count("\n"), text)
    return INLINE.sub("", text)


def line_of(text, place):
    return text.count("\n", 0, place) + 1


class Book:
    def __init__(self, root):
        self.root = root
        self.pages = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
                      for path in [root / "README.md", *sorted((root / "docs").glob("*.md"))]}
        self.blocks = [Block(name, line_of(text, block.start()), block[1], block[2])
                       for name, text in self.pages.items() for block in FENCE.finditer(text)]
        table = (root / "input" / "OPTIONS.md").read_text(encoding="utf-8")
        self.options = set(re.findall(r"^\| `([a-zA-Z_.0-9]+)` \|", table, re.MULTILINE))
        self.sections = {key.split(".")[0] for key in self.options}

    def faults_of_links(self):
        anchors = {}
        for name, text in self.pages.items():
            for link in LINK.finditer(without_code(text)):
                target, _, anchor = link[1].partition("#")
                where = f"{name}:{line_of(without_code(text), link.start())}: {link[1]}"
                if "://" in target:
                    continue
                path = (self.root / name).parent / target if target else self.root / name
                if not path.is_file():
                    yield f"{where}: no such file"
                elif anchor:
                    if path not in anchors:
                        content = FENCE.sub("", path.read_text(encoding="utf-8"))
                        anchors[path] = {slug(heading) for heading in HEADING.findall(content)}
                    if anchor not in anchors[path]:
                        yield f"{where}: no such heading"
        nav = (self.root / "docs" / "mkdocs.yml").read_text(encoding="utf-8")
        for name in sorted(self.pages.keys() - set(re.findall(r": (\S+\.md)$", nav, re.MULTILINE))):
            yield f"docs/mkdocs.yml:1: {name} is not among the pages"

    def faults_of_scenes(self):
        """Every deck has its row in docs/scenes.md, and every row its deck."""
        named = set()
        for row in re.findall(r"^\| (`.*?) \|", self.pages["docs/scenes.md"], re.MULTILINE):
            ends = re.findall(r"`([a-z_0-9]+)`", row)
            if " to " in row:
                stem = ends[0][:-1]
                ends = [stem + chr(code) for code in range(ord(ends[0][-1]), ord(ends[1][-1]) + 1)]
            named.update(ends)
        decks = {path.stem for path in (self.root / "input").glob("*.yaml")}
        for deck in sorted(decks ^ named):
            fault = "a deck without a row" if deck in decks else "no such deck in input/"
            yield f"docs/scenes.md:1: {deck}: {fault}"

    def is_option(self, key):
        """Whether a key of a deck, such as bodies.ball.radius, is one of the table's."""
        parts = key.split(".")
        if parts[0] == "objects":
            parts = parts[2:]
            key = ".".join(parts)
        if not parts or key in self.options:
            return True
        if parts[0] in SOLVERS and len(parts) == 2 and re.match(r"\w*(ksp|pc|mat|snes|fieldsplit)_", parts[1]):
            return True
        return any(self.with_name(parts, at) in self.options for at in range(1, len(parts) - 1))

    @staticmethod
    def with_name(parts, at):
        return ".".join([*parts[:at], "NAME", *parts[at + 1:]])

    def is_argument(self, word):
        """Whether an option of the command line, without its dash, is one of the program's."""
        word = re.sub(r"^objects_[a-z0-9]+_", "", word)
        if word in OF_THE_PROGRAM or word in {key.replace(".", "_") for key in self.options}:
            return True
        section = word.split("_")[0]
        if section in SOLVERS and re.search(r"_(ksp|pc|mat|snes|dm|fieldsplit|save)_", word):
            return True
        return any(re.fullmatch(re.escape(key.replace(".", "_")).replace("NAME", "[a-z0-9_]+"), word)
                   for key in self.options if "NAME" in key)

    def is_section(self, key):
        return any(option.startswith(key + ".") for option in self.options)

    def faults_of_options(self):
        """Inline code that looks like an option, section.key or -section_key, is one."""
        for name, text in self.pages.items():
            prose = FENCE.sub(lambda block: "\n" * block[0].count("\n"), text)
            for code in INLINE.finditer(prose):
                where = f"{name}:{line_of(prose, code.start())}"
                key = re.match(r"([a-z_]+(?:\.[a-zA-Z_]+)+)\b", code[1])
                is_file = key and re.search(r"\.(csv|md|yaml|py|sh|pvd)\b", key[1])
                if key and key[1].split(".")[0] in self.sections and not is_file:
                    if not (self.is_option(key[1]) or self.is_section(key[1])):
                        yield f"{where}: {key[1]}: no such option"
                for word in re.findall(r"(?:^| )-([a-z]+_[a-z_0-9]+)", code[1]):
                    if not self.is_argument(word) and not code[1].startswith(("cmake", "ctest", "srun")):
                        yield f"{where}: -{word}: no such option"

    def faults_of_paths(self):
        """Inline code that looks like a file or folder of the repository is one."""
        for name, text in self.pages.items():
            prose = FENCE.sub(lambda block: "\n" * block[0].count("\n"), text)
            for code in INLINE.finditer(prose):
                for word in code[1].split():
                    if PATH.fullmatch(word) and not (self.root / word).exists():
                        yield f"{name}:{line_of(prose, code.start())}: {word}: no such file"

    def faults_of_decks(self):
        """Comments of decks name files and options that exist; a command stands on lines of its own, indented."""
        for deck in sorted((self.root / "input").glob("*.yaml")):
            lines = deck.read_text(encoding="utf-8").splitlines()
            for number, line in enumerate(lines, 1):
                where, comment = f"input/{deck.name}:{number}", line.partition("#")[2]
                command = re.match(r"   ((?:mpirun|build/|postproc/|tools/).*)", comment)
                if command:
                    for words in Block(where, number, "sh", command[1]).commands():
                        yield from (f"{where}: {fault}" for fault in self.faults_of_command(words, set()))
                for word in re.findall(r"(?:^|[ (])-([a-z]+_[a-z_0-9]+)", "" if command else comment):
                    if not self.is_argument(word):
                        yield f"{where}: -{word}: no such option"

    def documented(self):
        """Names of the tables of docs/output.md with their units, {name: units}; a name of two tables has two."""
        names = {}
        for row in self.pages["docs/output.md"].splitlines():
            cells = [cell.strip() for cell in row.strip("|").split("|")]
            if row.startswith("| `") and len(cells) >= 3:
                for name in re.findall(r"`([A-Za-z_0-9]+)`", cells[0]):
                    names.setdefault(name, set()).add(cells[1])
        return names

    def unit_fault(self, name, unit):
        """What is wrong with what docs/output.md says of a column or field; None where it is right."""
        for known, units in self.documented().items():
            pattern = re.sub(r"NAME|COLOUR|CHAMBER|LINK|STAGE", "[A-Za-z0-9_]+", known)
            if re.fullmatch(pattern, name) and (unit is None or unit in units):
                return None
        return f"{name} [{unit}]: not in docs/output.md with this unit"

    def faults_of_output(self):
        for path in sorted([*(self.root / "src" / "world").glob("*.*"), *(self.root / "src" / "run").glob("*.cpp")]):
            text = path.read_text(encoding="utf-8")
            found = []
            if "report.add(" in text or "History::Column" in text:
                found += COLUMN.findall(text)
            found += [(name, None) for name in DRAWN.findall(text)]
            found += REGISTERED.findall(text)
            for name, unit in found:
                fault = self.unit_fault(name, unit)
                if fault:
                    yield f"{path.relative_to(self.root)}:1: {fault}"

    def faults_of_lines(self):
        for name, text in self.pages.items():
            for number, line in enumerate(text.splitlines(), 1):
                if len(line) > 125 and not line.startswith(("|", "![", "<!--")):
                    yield (f"{name}:{number}: {len(line)} columns, expected at most 125 but for tables, pictures and "
                           "comments")

    def faults_of_blocks(self):
        files = {block.file_name() for block in self.blocks if block.language == "yaml"} - {None}
        for block in self.blocks:
            if block.language == "yaml":
                yield from self.faults_of_yaml(block)
            elif block.language in {"cpp", "cmake"}:
                yield from self.faults_of_quotation(block)
            elif block.language == "diff":
                yield from self.faults_of_change(block)
            elif block.language in {"sh", "console"}:
                for words in block.commands():
                    yield from (f"{block.where()}: {fault}" for fault in self.faults_of_command(words, files))
            elif block.language not in {"bash", "c++", "math"}:
                yield f"{block.where()}: a block of the language '{block.language}', expected one that a test knows"

    def faults_of_yaml(self, block):
        def keys(value, path):
            if isinstance(value, dict):
                for key, below in value.items():
                    yield from keys(below, f"{path}.{key}" if path else str(key))
            else:
                yield path
        for key in keys(yaml.safe_load(block.text), ""):
            if not self.is_option(key):
                yield f"{block.where()}: {key}: no such option"

    def faults_of_quotation(self, block):
        first, _, text = block.text.partition("\n")
        name = first.removeprefix("# " if block.language == "cmake" else "// ")
        path = self.root / name
        if not path.is_file():
            yield f"{block.where()}: expected a first line // FILE (cmake: # FILE), the source that is quoted"
        elif text.rstrip() not in path.read_text(encoding="utf-8"):
            yield f"{block.where()}: not found in {name}"

    def faults_of_change(self, block):
        told = subprocess.run(["git", "apply", "--check", "-C1", "-"], input=block.text, cwd=self.root,
                              capture_output=True, text=True, check=False)
        if told.returncode != 0:
            yield f"{block.where()}: does not apply: {told.stderr.splitlines()[0]}"

    def faults_of_command(self, words, files):
        """Programs, files and options of a command exist."""
        if words[0] == "mpirun":
            words = words[3:] if words[1] == "-n" else words[1:]
        program = words[0]
        if program in {"cmake", "cpack", "ctest"}:
            presets = (self.root / "CMakePresets.json").read_text(encoding="utf-8")
            for preset in [words[i + 1] for i, word in enumerate(words) if word == "--preset"]:
                if f'"name": "{preset}"' not in presets:
                    yield f"{preset}: no such preset"
            return
        if not program.startswith("build/"):
            if not (self.root / program).is_file():
                yield f"{program}: no such program"
            elif program.startswith(("tools/", "postproc/")):
                script = self.root / (words[1] if program == "tools/pvbatch" and len(words) > 1 else program)
                text = script.read_text(encoding="utf-8")
                for word in words:
                    if word.startswith("--") and f'"{word}"' not in text and f"{word}" not in text.split('"""')[1]:
                        yield f"{word}: no option of {script.name}"
        for word in words[1:]:
            if re.match(r"(input|meshes|tests|postproc|src)/", word) and not (self.root / word).exists():
                yield f"{word}: no such file"
            if re.fullmatch(r"[a-z_]+\.yaml", word) and word not in files:
                yield f"{word}: no block of yaml is this file"
            if program.endswith("/pellicle") and re.match(r"-[a-z]", word) and not self.is_argument(word[1:]):
                yield f"{word}: no such option"
