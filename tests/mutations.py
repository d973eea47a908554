"""Small faults in the mechanics, drawn at random, and which tests notice them.

    python tests/mutations.py list
    python tests/mutations.py run DIR -o mutations.csv

`list` shows the faults: signs, factors, powers, indices, numbers of repetitions, terms
left out. `run` puts each alone into a copy of the project in DIR, and runs the tests
there until one fails: first quick ones of the same folder, then those of all mechanics,
all others, and, with `--tiers 4`, slow ones of the same folder. What is in the file
already is not run again.
"""

from __future__ import annotations

import argparse
import ast
import csv
import math
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).parents[1]
PARTS = "fegear/contact", "fegear/elasticity", "fegear/statics", "fegear/dynamics"
FOLDERS = *PARTS, "lumped"
NOT_MECHANICS = {"figures", "common"}  # pictures, files and compilers of `lumped`
TOP = ROOT / "tests" / "fegear"  # tests of statics, among others
COUNT, SEED = 60, 2026
LIMIT_S = 1800.0  # of a run of tests
LEFT_OUT = shutil.ignore_patterns(".git", ".venv*", "build")
COLUMNS = "number", "kind", "place", "before", "after", "tier", "test", "seconds"


@dataclass(frozen=True)
class Mutation:
    """A piece of a source file and what takes its place."""

    kind: str
    path: str
    line: int
    begin: int
    end: int
    before: str
    after: str

    def applied(self, text: str) -> str:
        lines = text.splitlines(keepends=True)
        line = lines[self.line - 1].encode()
        assert line[self.begin : self.end].decode() == self.before
        line = line[: self.begin] + self.after.encode() + line[self.end :]
        lines[self.line - 1] = line.decode()
        return "".join(lines)


def pieces(tree: ast.AST) -> Iterator[tuple[str, ast.expr, str]]:
    """Kind, expression and what may take its place, of all functions."""
    for node in ast.walk(tree):
        match node:
            case ast.BinOp():
                for kind, after in of_operation(node):
                    yield kind, node, after
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                yield "sign", node, f"({ast.unparse(operand)})"
            case ast.Constant(value=float(value)) if value not in (0.0, math.inf):
                yield "factor", node, repr(1.1 * value)
            case ast.Subscript(slice=ast.Constant(value=int(value)) as index):
                yield "index", index, str(1 - value)
            case ast.Call(func=ast.Name(id="range"), args=[count]):
                yield "off by one", count, f"{ast.unparse(count)} - 1"


def of_operation(node: ast.BinOp) -> Iterator[tuple[str, str]]:
    """Kinds of faults of a binary operation, and what takes its place."""
    left, right = ast.unparse(node.left), ast.unparse(node.right)
    match node.op:
        case ast.Add() | ast.Sub() if not isinstance(node.left, ast.Constant):
            sign = "-" if isinstance(node.op, ast.Add) else "+"
            yield "sign", f"({left}) {sign} ({right})"
            yield "term left out", f"({left})"
        case ast.Mult() | ast.Div():
            yield "factor left out", f"({left})"
        case ast.Pow():
            yield "power", f"({left}) ** (1 + ({right}))"


def annotations(tree: ast.AST) -> Iterator[ast.AST]:
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation:
            yield from ast.walk(node.annotation)
        if isinstance(node, ast.FunctionDef) and node.returns:
            yield from ast.walk(node.returns)


def mutations_of(path: Path) -> Iterator[Mutation]:
    """All of a file, those on one line of code within functions alone."""
    text = path.read_text("utf-8")
    tree = ast.parse(text)
    left_out = set(map(id, annotations(tree)))
    functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
    seen = set[tuple[str, int, int, int]]()
    for function in functions:
        for statement in function.body:
            for kind, node, after in pieces(statement):
                place = kind, node.lineno, node.col_offset, node.end_col_offset or 0
                one_line = node.lineno == node.end_lineno
                if not one_line or id(node) in left_out or place in seen:
                    continue
                seen.add(place)
                before = ast.get_source_segment(text, node) or ""
                name = path.relative_to(ROOT).as_posix()
                yield Mutation(kind, name, *place[1:], before, after)


def drawn(count: int = COUNT, seed: int = SEED) -> list[Mutation]:
    """Faults drawn at random, the same number from each folder."""
    source = random.Random(seed)
    chosen = list[Mutation]()
    for folder in FOLDERS:
        paths = sorted((ROOT / folder).rglob("*.py"))
        candidates = [
            mutation
            for path in paths
            if not NOT_MECHANICS & set(path.relative_to(ROOT).parts)
            for mutation in mutations_of(path)
        ]
        chosen += source.sample(candidates, count // len(FOLDERS))
    return chosen


def stages(mutation: Mutation) -> Iterator[tuple[str, list[str]]]:
    """Names of the tiers, and words of pytest."""
    folders = Path("tests", mutation.path).parents  # kernels have the tests around them
    folder = next(folder for folder in folders if (ROOT / folder).is_dir())
    files = sorted(file.relative_to(ROOT) for file in TOP.glob("test_*.py"))
    near = [str(file) for file in files] if ROOT / folder == TOP else [str(folder)]
    yield "quick, near", near
    mechanics = [
        f"tests/{part}" for part in FOLDERS if (ROOT / "tests" / part).is_dir()
    ]
    others = {*mechanics, "tests/fegear/studies", *map(str, files)} - {*near}
    yield "quick, mechanics", sorted(others)
    seen = [f"--ignore={path}" for path in {*near, *others}]
    yield "quick, others", [*seen, "tests"]
    yield "slow, near", ["-m", "slow", *near]


def noticed(mutation: Mutation, copy: Path, tiers: range) -> tuple[str, str]:
    """Tier and test that fails, or nothing."""
    for tier, arguments in islice(stages(mutation), tiers.start, tiers.stop):
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", *arguments]
        command += ["--durations=0", "-p", "no:cacheprovider"]
        try:
            done = subprocess.run(
                command, cwd=copy, capture_output=True, text=True, timeout=LIMIT_S
            )
        except subprocess.TimeoutExpired:
            return tier, "no end"
        if done.returncode not in (0, 5):  # 5: no test is there
            lines = [li for li in done.stdout.splitlines() if "ERROR" in li[:6]]
            lines += [li for li in done.stdout.splitlines() if li[:6] == "FAILED"]
            return tier, (lines or ["not imported"])[0].partition(" - ")[0]
    return "", ""


def run(copy: Path, target: Path, numbers: Sequence[int], tiers: range) -> None:
    if not target.exists():
        target.write_text(",".join(COLUMNS) + "\n")
    finished = {row["number"] for row in csv.DictReader(target.open())}
    for number, mutation in enumerate(drawn(), 1):
        if str(number) in finished or (numbers and number not in numbers):
            continue
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(ROOT, copy, ignore=LEFT_OUT)  # compiled kernels as well
        path, begun = copy / mutation.path, time.monotonic()
        path.write_text(mutation.applied(path.read_text("utf-8")))
        tier, test = noticed(mutation, copy, tiers)
        place = f"{mutation.path}:{mutation.line}"
        row = [number, mutation.kind, place, mutation.before, mutation.after]
        with target.open("a", newline="") as file:
            csv.writer(file).writerow(
                [*row, tier, test, f"{time.monotonic() - begun:.0f}"]
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("action", choices=["list", "run"])
    parser.add_argument("copy", type=Path, nargs="?", help="a folder for the copy")
    parser.add_argument("-o", "--output", type=Path, default=Path("mutations.csv"))
    parser.add_argument("--numbers", type=int, nargs="*", default=[])
    parser.add_argument("--first", type=int, default=1, help="tier, of four")
    parser.add_argument("--tiers", type=int, default=3, help="last tier, of four")
    options = parser.parse_args()
    if options.action == "list":
        for number, m in enumerate(drawn(), 1):
            line = f"{number:3} {m.kind:15} {m.path}:{m.line}  {m.before} -> {m.after}"
            print(line)  # noqa: T201
        return
    if options.copy is None:
        parser.error("run: needs a folder")
    run(
        options.copy,
        options.output,
        options.numbers,
        range(options.first - 1, options.tiers),
    )


if __name__ == "__main__":
    main()
