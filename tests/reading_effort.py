"""What the code costs a reader, in numbers.

    python tests/reading_effort.py
    python tests/reading_effort.py --list

Bindings with names that fit anything, definitions with private words, class names of
several things, asserts that serve as checks, constants in comments that do not exist,
code lines of all and of a study.
`--list` prints the places as well.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import statistics
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from source_files import ROOT, parsed

PACKAGES = "fegear", "lumped", "meshes", "validation"
FOLDERS = *PACKAGES, "tests"
CATCH_ALL = {
    *("found", "asked", "given", "known", "own", "each", "what", "words", "kept"),
}
# words of our own, where the field has one
PRIVATE = {
    *("EXACT", "SAME", "NEAR", "FAR", "SURE", "ALIKE", "APART", "CLEAR", "USUAL"),
    *("Board", "Box", "Followed", "Keeping", "Leaping", "Look", "Naming", "Offered"),
    *("OfMachine", "OfTrain", "OverFigure", "OverSpeed", "QuietMotion", "Room"),
    *("Sought", "Springs", "Stand", "Stretch", "Varied", "alike", "both_ways"),
    *("close_in", "complain", "confirmed", "count_anew", "doubtful", "doubts", "faded"),
    *("fades", "goes_on", "halves_apart", "heeded", "judge", "kept_beside"),
    *("leapt", "leap_cost", "left_out_error", "loosen", "made_small", "own_offers"),
    *("pass_teeth", "plain_branch", "retraced", "rubs", "safe_span", "say"),
    *("scattered", "settle_or_leap", "shrink", "slow_down", "straining", "strike"),
    *("take_off", "tell_finished", "turn_round", "upright", "whole_texts"),
    *("words_of", "yielding"),
}
PRIVATE_BEGINNINGS = re.compile(r"_?(MOST|LEAST|FEWEST|USUAL)_|_?(usual|doubts)_")
# one each by nature: gear-set file, train, finite elements
TWINS = {"Gear", "Mesh", "Shaft"}
FUNCTIONS = ast.FunctionDef, ast.AsyncFunctionDef
CONSTANT = re.compile(r"(?<![\w.-])_?[A-Z]{2}[A-Z_]{2,}(?![\w-])")
# in capitals, but no constants: formats, libraries, points of a flank, placeholders
CAPITALS = {
    *("ARPACK", "ASCE", "HPSTC", "HTML", "ICTP", "JSON", "LAPACK", "LPSTC"),
    *(
        "MEMORYSTATUSEX",
        "PCHIP",
        "REXS",
        "ROSS",
        "TOML",
        "FILE",
        "MODULE",
        "NAME",
        "NAMES",
        "STEP",
        "VALUE",
    ),
}


def sources(folders: tuple[str, ...] = FOLDERS) -> Iterator[tuple[Path, ast.Module]]:
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT), parsed(path)


def bindings(node: ast.AST) -> Iterator[tuple[str, int]]:
    """Names that a file binds with their lines, once in each scope."""
    for scope in ast.walk(node):
        if isinstance(scope, (ast.Module, ast.ClassDef, ast.Lambda, *FUNCTIONS)):
            yield from _bound_in(scope).items()
        if isinstance(scope, ast.comprehension):
            for target in ast.walk(scope.target):
                if isinstance(target, ast.Name):
                    yield target.id, target.lineno


def _bound_in(scope: ast.AST) -> dict[str, int]:
    bound: dict[str, int] = {}
    pending = list(ast.iter_child_nodes(scope))
    while pending:
        node = pending.pop()
        if isinstance(node, (ast.ClassDef, *FUNCTIONS)):
            bound.setdefault(node.name, node.lineno)
            continue
        if isinstance(node, ast.Lambda | ast.comprehension):
            continue
        if isinstance(node, ast.arg):
            bound.setdefault(node.arg, node.lineno)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            bound.setdefault(node.id, node.lineno)
        pending += ast.iter_child_nodes(node)
    return bound


def catch_alls() -> list[str]:
    """Places of bindings that are named by a word for anything."""
    return [
        f"{path}:{line} {name}"
        for path, tree in sources()
        for name, line in bindings(tree)
        if name in CATCH_ALL
    ]


def private_definitions() -> list[str]:
    """Functions, classes and constants of the packages with words of our own."""
    return [
        f"{path}:{line} {name}"
        for path, tree in sources(PACKAGES)
        for name, line in _defined(tree)
        if name in PRIVATE or PRIVATE_BEGINNINGS.match(name)
    ]


def _defined(tree: ast.Module) -> Iterator[tuple[str, int]]:
    for node in ast.walk(tree):
        if isinstance(node, (ast.ClassDef, *FUNCTIONS)):
            yield node.name, node.lineno
    for statement in tree.body:
        for node in ast.walk(statement):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id, node.lineno


def repeated_classes() -> list[str]:
    """Class names of the packages that stand for several things."""
    homes = defaultdict(list)
    for path, tree in sources(PACKAGES):
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(str(path))
    return [
        f"{name}: {', '.join(paths)}"
        for name, paths in sorted(homes.items())
        if len(paths) > 1 and name not in TWINS
    ]


def asserts() -> list[str]:
    """Asserts in the packages: they vanish under `python -O`."""
    return [
        f"{path}:{node.lineno}"
        for path, tree in sources(PACKAGES)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assert)
    ]


def missing_constants() -> list[str]:
    """Constants that a comment or docstring names and its file does not know."""
    return [
        f"{path}:{line} {name}"
        for path, _ in sources(PACKAGES)
        for line, name in missing_in((ROOT / path).read_text(encoding="utf-8"))
    ]


def missing_in(text: str) -> Iterator[tuple[int, str]]:
    code, comments = [], []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        is_docstring = token.type == tokenize.STRING and '"""' in token.string
        is_comment = token.type == tokenize.COMMENT or is_docstring
        (comments if is_comment else code).append(token)
    known_names = CAPITALS | {
        name for token in code for name in CONSTANT.findall(token.string)
    }
    for token in comments:
        for match in CONSTANT.finditer(token.string):
            if match.group() not in known_names:
                line = token.start[0] + token.string.count("\n", 0, match.start())
                yield line, match.group()


def code_lines(path: Path) -> int:
    """Lines of a file that hold code: no blanks, comments and docstrings."""
    text = (ROOT / path).read_text(encoding="utf-8")
    tree, lines = ast.parse(text), set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in IGNORED and token.string.strip():
            lines |= set(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, *FUNCTIONS)) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                last = first.end_lineno or first.lineno
                lines -= set(range(first.lineno, last + 1))
    return len(lines)


IGNORED = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.ENDMARKER}


def study_files() -> list[Path]:
    """Files of the packages that declare a study."""
    return [
        path
        for path, tree in sources(PACKAGES)
        if any(
            isinstance(node, ast.ClassDef)
            and any(keyword.arg == "command" for keyword in node.keywords)
            for node in ast.walk(tree)
        )
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="print places as well")
    with_places = parser.parse_args().list
    for name, places in (
        ("bindings of a word for anything", catch_alls()),
        ("definitions with private words", private_definitions()),
        ("class names of several things", repeated_classes()),
        ("asserts as checks", asserts()),
        ("constants in comments that are not in their file", missing_constants()),
    ):
        sys.stdout.write(f"{name}: {len(places)}\n")
        if with_places:
            sys.stdout.writelines(f"  {place}\n" for place in places)
    sizes = {path: code_lines(path) for path, _ in sources()}
    for folder in FOLDERS:
        part = [size for path, size in sizes.items() if path.parts[0] == folder]
        sys.stdout.write(f"code lines of {folder}: {sum(part)} in {len(part)} files\n")
    packages = sum(size for path, size in sizes.items() if path.parts[0] != "tests")
    sys.stdout.write(f"code lines of the packages: {packages}\n")
    studies = sorted(sizes[path] for path in study_files())
    sys.stdout.write(
        f"studies: {len(studies)} files, median {statistics.median(studies):g} lines\n"
    )


if __name__ == "__main__":
    main()
