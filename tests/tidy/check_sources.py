#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_sources TOP: rules of this project that compilers do not check.

Prints file:line: complaint for each violation, and exits with 1 if there is one. A rule is a
function of all files ({path: text}) that yields (path, line, complaint); self_test.py shows that
each rule can fail.
"""
import os
import re
import subprocess
import sys

# The folders that a folder may include directly; it may also include what they may include. Call
# order is dependency order.
MAY_INCLUDE = {
    "base": [],
    "schema": ["base"],
    "shm": ["base"],
    "shm/messages": ["schema", "shm"],
    "server": ["schema", "shm", "shm/messages"],
    "server/programs": ["server", "drivers"],
    "client": ["schema", "shm", "shm/messages"],
    "client/programs": ["client"],
    "drivers": ["base"],
    # A router is a server to local clients, and a client to local servers.
    "router": ["schema", "shm", "client", "server", "server/programs"],
    "classic/messages": ["schema"],  # sources that were written for the original MPF
    "classic": ["classic/messages", "client", "server", "drivers"],
    "epics": ["client", "classic/messages"],
    "python": ["client", "server"],
    # The supervisor reads shared memory as reports do, and prints tables.
    "crate": ["base", "shm", "tools", "drivers"],
    "benchmarks": ["client", "server"],
    # server: `mpf replay --as-server`; benchmarks: `mpf bench`
    "tools": ["client", "server", "shm", "schema", "benchmarks"],
    "tools/torture": ["tools", "server"],
}
MAY_INCLUDE_ANYTHING = ("tests", "benchmarks", "examples")
# The folder whose sources define what a public header declares. Headers in
# include/mpf/drivers/ belong to drivers.
PUBLIC_HEADERS = {
    "base": ["clock.h", "file_descriptor.h", "real_time_priority.h", "detail/copy_words.h",
             "detail/cpp20.h"],
    "schema": [
        "message_types.h", "message_layout.h", "message_route.h", "message_body.h",
        "message.h", "message_of.h", "user_message.h", "serial_commands.h",
        "serial_sniff.h", "gpib_commands.h", "gpib_sniff.h", "digital_io_commands.h",
        "ip330_commands.h",
    ],
    "shm": ["wait_mode.h", "rights.h", "errors.h", "backplane.h"],
    "client": ["dispatcher.h", "message_client.h", "sync_client.h"],
    "server": ["message_server.h", "detail/handler_argument.h"],
    "classic/messages": ["classic/message.h"],
    "classic": [
        "classic.h",
        "classic/industry_pack.h",
        "classic/message_client.h",
        "classic/message_server.h",
        "classic/vxworks.h",
    ],
    "epics": ["epics/dev_mpf.h", "epics/classic.h"],
}

TESTED_ELSEWHERE = "tests/tidy/tested_elsewhere.txt"
MAX_LINES = 400
MAX_COLUMNS = 100
MAY_BE_LONG = re.compile(r'[│┌┐└┘├─►◄]|NOLINT|R"|https?://')
PAIR_REACH = 3  # the PAIR line is within so many lines above an ordered access

ORDERED = re.compile(r"\bmemory_order(_|::)(acquire|release|acq_rel|seq_cst|consume)\b|\.load\(\)")
PAIR = re.compile(r"\bPAIR\(([\w-]+)\)")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def is_cpp(path):
    return path.endswith((".h", ".cpp"))


def is_source(path):
    return is_cpp(path) or path.endswith(
        (".py", ".sh", ".capnp", ".cmake", "CMakeLists.txt", "Makefile")
    )


def lines(text):
    return enumerate(text.splitlines(), start=1)


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


def layer(path):
    """The longest key of MAY_INCLUDE that is a folder of `path`, or None. A public header is in
    the folder that implements it."""
    if path.startswith("include/mpf/drivers/"):
        return "drivers"
    if path.startswith("include/mpf/classic/names/"):
        return "classic"
    if path.startswith("include/mpf/epics/names/"):
        return "epics"
    if path.startswith("include/mpf/"):
        name = path.removeprefix("include/mpf/")
        return next((folder for folder, names in PUBLIC_HEADERS.items() if name in names), None)
    fitting = [folder for folder in MAY_INCLUDE if path.startswith(folder + "/")]
    return max(fitting, key=len, default=None)


def reachable(folder):
    found = {folder}
    for allowed in MAY_INCLUDE[folder]:
        found |= reachable(allowed)
    return found


def include_directions(files):
    for path, text in files.items():
        if not is_cpp(path):
            continue
        for match in INCLUDE.finditer(text):
            at = line_of(text, match.start())
            if complaint := judge_include(path, match[1], match[2]):
                yield path, at, complaint


def judge_include(path, bracket, included):
    is_public = included.startswith("mpf/")
    if is_public != (bracket == "<" and is_public) or ".." in included.split("/"):
        return (
            f"includes {included}: write <mpf/message.h> for public headers, "
            '"shm/link.h" for others'
        )
    if bracket == "<" and not is_public:
        return None  # of a library
    if path.startswith("include/") and not is_public:
        return f"includes {included}: a public header includes public headers only"
    if path.startswith(tuple(f"{folder}/" for folder in MAY_INCLUDE_ANYTHING)):
        return None
    source, target = layer(path), layer(f"include/{included}" if is_public else included)
    if source is None or target is None:
        return f"includes {included}: a header that the table of layers does not have"
    return None if target in reachable(source) else f"{source} may not include {target}"


def pairs(files):
    """Each tag stands at both ends of its happens-before edge: at a release and at an acquire."""
    places, orders = {}, {}
    for path, text in files.items():
        if not is_cpp(path):
            continue
        source = text.splitlines()
        for number, line in enumerate(source, start=1):
            for tag in PAIR.findall(line):
                places.setdefault(tag, []).append((path, number))
                below = "\n".join(source[number - 1:number + PAIR_REACH])
                found = {match[2] or "seq_cst" for match in ORDERED.finditer(below)}
                orders.setdefault(tag, set()).update(found)
                if "fence()" in below:
                    orders[tag].add("seq_cst")
    for tag, found in places.items():
        if len(found) == 1:
            yield *found[0], f"PAIR({tag}) has no other end"
        elif not orders[tag] & {"release", "acq_rel", "seq_cst"} or not orders[tag] & {
            "acquire",
            "acq_rel",
            "seq_cst",
            "consume",
        }:
            yield *found[0], f"PAIR({tag}) does not have both a release and an acquire side"


def ordered_accesses(files):
    for path, text in files.items():
        # The board of mpf torture and the tests are sequentially consistent on purpose: their speed
        # does not matter.
        if not is_cpp(path) or path.startswith(("tests/", "tools/torture/")):
            continue
        above = []
        for number, line in lines(text):
            above = [*above[-PAIR_REACH:], line]
            if ORDERED.search(line.split("//")[0]) and not any(PAIR.search(near) for near in above):
                what = f"without a PAIR line within {PAIR_REACH} lines above"
                yield path, number, f"ordered atomic access {what}"


def licences(files):
    for path, text in files.items():
        first = text.splitlines()[:2] if text.startswith("#!") else text.splitlines()[:1]
        if (is_cpp(path) or text.startswith("#!")) and not any(
            "SPDX-License-Identifier: MIT" in line for line in first
        ):
            yield path, 1, "does not begin with the SPDX line"


def sizes(files):
    for path, text in files.items():
        count = len(text.splitlines())
        if count > MAX_LINES and (is_source(path) or text.startswith("#!")):
            yield path, count, f"{count} lines: more than {MAX_LINES}"


def unfinished(files):
    mark = re.compile(r"\b(T[O]DO|F[I]XME|X[X]X)\b")
    for path, text in files.items():
        for number, line in lines(text):
            if match := mark.search(line):
                yield path, number, f"{match[0]}: finish it, or open an issue"


# Words and patterns of the former style. A word that is right in its place: PLACES_OF_WORDS.
OLD_WORDS = re.compile(
    r"\b(shall|anew|nonsense|deeds?|hears of|in vain|whoever|whosoever)\b"
    r"|\b(?:is|are) none\b"
    r"|(?:^|[.;:(]|\b(?:for|of|by|than)) [Ww]ho(?:se)? (?!.*\?)")
PLACES_OF_WORDS = {"LICENSE", "tests/tidy/check_sources.py", "tests/tidy/self_test.py"}


def plain_language(files):
    """Sources and documents use plain technical English: STYLE, "Language"."""
    for path, text in files.items():
        if path in PLACES_OF_WORDS or path.startswith("tests/layout/v1_"):
            continue
        for number, line in lines(text):
            if match := OLD_WORDS.search(line):
                yield path, number, f'"{match[0].strip()}": use plain technical English'


# The layouts of released versions never change.
MAY_HAVE_LONG_LINES = ("tests/layout/v1_",)


def line_lengths(files):
    """Sources, scripts and documents have at most 100 columns, pictures and raw strings excepted.
    A code block of a document shows output as it is."""
    for path, text in files.items():
        if path.startswith(MAY_HAVE_LONG_LINES):
            continue
        is_document = path.endswith(".md")
        if not (is_source(path) or is_document or text.startswith("#!")):
            continue
        is_in_block = False
        for number, line in lines(text):
            is_in_block ^= is_document and line.lstrip().startswith("```")
            if is_in_block:
                continue
            if len(line) > MAX_COLUMNS and not MAY_BE_LONG.search(line):
                yield path, number, f"{len(line)} columns: more than {MAX_COLUMNS}"


def shown_code(files):
    """A block after the name of a file (`drivers/x.h`:) in a document shows lines of that file."""
    block = re.compile(r"^`([\w./-]+)`:\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
    for path, text in files.items():
        for match in block.finditer(text) if path.endswith(".md") else ():
            real = files.get(match[1], "").splitlines()
            for number, line in enumerate(
                match[2].splitlines(), start=line_of(text, match.start(2))
            ):
                if line not in real:
                    yield path, number, f"shows a line that is not in {match[1]}"


def named_functions(files):
    """A step of a list that ends in the line `Class::function` in `path` names a function that this
    file declares or defines."""
    step = re.compile(r"^ +`(?:\w+::)*(\w+)` in `([\w./]+)`$", re.MULTILINE)
    for path, text in files.items():
        for match in step.finditer(text) if path.endswith(".md") else ():
            if not re.search(rf"\b{match[1]}\(", files.get(match[2], "")):
                yield path, line_of(
                    text, match.start()
                ), f"names {match[1]}(), which is not in {match[2]}"


def named_tests(files):
    """A document names tests as `Suite.Name`. Nested types of .capnp files are written alike."""
    defined = re.compile(r"^TEST(?:_[FP])?\((\w+),\s+(\w+)\)", re.MULTILINE)
    named = re.compile(r"`([A-Z]\w+)\.([A-Z]\w+)`")
    tests = {match for text in files.values() for match in defined.findall(text)}
    schema = "".join(text for path, text in files.items() if path.endswith(".capnp"))
    for path, text in files.items():
        for match in named.finditer(text) if path.endswith(".md") else ():
            if match.groups() in tests or re.search(rf"\bstruct {match[1]}\b", schema):
                continue
            yield path, line_of(text, match.start()), f"names a test that is absent: {match[0]}"


def mirrored_tests(files):
    """Each source has tests/SAME/PATH_test.cpp, or a line in TESTED_ELSEWHERE: the test that covers
    it, or why it has no logic."""
    table = list(lines(files.get(TESTED_ELSEWHERE, "")))
    elsewhere = dict(line.split(": ", 1) for _, line in table if ": " in line)
    for path in files:
        without = path.startswith(MAY_INCLUDE_ANYTHING) or path.endswith("main.cpp")
        if not path.endswith(".cpp") or without or path in elsewhere:
            continue
        if f"tests/{path[:-4]}_test.cpp" not in files:
            yield path, 1, f"has no test of its path and no line in {TESTED_ELSEWHERE}"
    for number, line in table:
        source, _, test = line.partition(": ")
        if source not in files:
            yield TESTED_ELSEWHERE, number, f"names an absent source: {source}"
        elif f"tests/{source[:-4]}_test.cpp" in files:
            yield TESTED_ELSEWHERE, number, f"names a source that has a test: {source}"
        elif not test.startswith("no logic, ") and f"tests/{test}" not in files:
            yield TESTED_ELSEWHERE, number, f"names an absent test: {test}"


def machine_paths(files):
    """No file depends on the place of the tree or on a package host."""
    place = re.compile(
        r"(?<![\w.$}-])/(work|root|home/\w+)/[\w.]"
        r"|\b(pypi|debian|npmjs|docker|ghcr)\.(org|com|io)\b/(?!doc)|\bdeb\.debian\.org\b"
    )
    for path, text in files.items():
        for number, line in lines(text):
            if match := place.search(line):
                yield path, number, f"names a path of a machine or a package host: {match[0]}"


def errors_never_throw(files):
    """A program reports errors with printError(), and its main() is runMain(): both work
    when stderr is closed or full."""
    for path, text in files.items():
        if not path.endswith((".h", ".cpp")) or path.startswith(("tests/", "examples/", "base/")):
            continue
        for number, line in lines(text):
            code = line.split("//")[0]
            if re.search(r"\bprint\(stderr\b|\bstd::(cerr|clog)\b|\bfprintf\(stderr\b", code):
                yield path, number, "may throw or lose the message: use printError()"
            if re.match(r"int main\(", code) and not re.search(r"\brun(Main|Echo\w+)\(", text):
                yield path, number, "main() without runMain()"


RULES = (
    include_directions,
    pairs,
    ordered_accesses,
    licences,
    sizes,
    line_lengths,
    unfinished,
    plain_language,
    shown_code,
    named_functions,
    named_tests,
    mirrored_tests,
    machine_paths,
    errors_never_throw,
)


def read_tree(top):
    """Tracked files, and new ones that are not ignored."""
    listed = subprocess.run(
        [
            "git",
            "-c",
            "safe.directory=*",
            "-C",
            top,
            "ls-files",
            "-z",
            "--cached",
            "--others",
            "--exclude-standard",
        ],
        check=True,
        capture_output=True,
    )
    files = {}
    for path in filter(None, listed.stdout.decode().split("\0")):
        try:
            with open(os.path.join(top, path), encoding="utf-8") as file:
                files[path] = file.read()
        except (FileNotFoundError, IsADirectoryError, UnicodeDecodeError):
            pass  # deleted but still tracked; a submodule; binary
    return files


def main(top):
    files = read_tree(top)
    complaints = [complaint for rule in RULES for complaint in rule(files)]
    for path, number, what in complaints:
        print(f"{path}:{number}: {what}")
    print(f"{len(files)} files, {len(RULES)} rules, {len(complaints)} complaints")
    return 1 if complaints or not files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
