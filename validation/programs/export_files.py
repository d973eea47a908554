"""The files of fegear that the comparisons read; they are written into a folder.

    python -m validation.programs.export_files files

Every file is that of a command, which is printed before it runs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

LINEAR, NONLINEAR, TORQUE = 2000, 2800, 100  # Hz, Hz with contact loss, N m
PAIR = "liu-pair", "--torque", str(TORQUE)
FMU = "mesh.fmu"
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("stiffness", *PAIR, "-o", "table.csv"),
    ("stiffness", *PAIR, "-o", "table.mat"),
    ("export", *PAIR, "--stiffness", "fe", "-o", "train.npz"),
    ("export", "liu-idler", "--stiffness", "given", "-o", "idler.npz"),
    ("export", *PAIR, "--mesh", "1", "-o", FMU),
    (
        *("motion", *PAIR, "--speed", str(LINEAR), "--model", "1"),
        *("-o", f"motion-{LINEAR}-model1.csv"),
    ),
    *(
        (
            *("motion", *PAIR, "--speed", str(speed), "--model", str(model)),
            *("--table", "table.csv", "-o", f"motion-{speed}-model{model}.csv"),
        )
        for speed, model in ((LINEAR, 3), (NONLINEAR, 3), (LINEAR, 2))
    ),
)


def write_files(folder: Path) -> None:
    """Run the commands in the folder, which is made where it is missing.

    An FMU is left out without pythonfmu (`pip install 'fegear[fmu]'`).
    """
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    for command in COMMANDS:
        if command[-1] == FMU and find_spec("pythonfmu") is None:
            continue
        sys.stdout.write(f"fegear {' '.join(command)}\n")
        sys.stdout.flush()
        arguments = [sys.executable, "-m", "fegear", *command]
        subprocess.run(
            arguments, cwd=folder, env=environment, check=True, capture_output=True
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    write_files(parser.parse_args().folder)


if __name__ == "__main__":
    main()
