#!/usr/bin/env python3
"""run_page.py PAGE.md SECTION SOURCE_FOLDER PROGRAMS_FOLDER [ORDER]: runs the commands of a section as they stand.

The commands are the blocks of ```sh below the heading. They run in an empty folder in which `configs` is
that of the sources. Each robot of the pages has something that `viwo inspect` finds (exit code 1), and is
calibrated in folder `calibrated`: what comes out must be what was simulated. ORDER: which wheels of the
simulation those of the page are (1423).
Prints how long each took. Ends with 77 when a program that a command begins with was not built.
"""
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time


def commands(page, section):
    parts = re.split(r"^## (.*)$", page.read_text(), flags=re.M)
    sections = dict(zip(parts[1::2], parts[2::2]))
    if section not in sections:
        sys.exit(f"{page}: no section '{section}' - there are: {', '.join(sections)}")
    blocks = re.findall(r"^```sh\n(.*?)^```", sections[section], flags=re.M | re.S)
    found = [line for block in blocks for line in block.splitlines() if line.strip()]
    if not found:
        sys.exit(f"{page}: section '{section}' has no commands")
    return found


def check_calibration(folder, order):
    """Each parameter within four of its sigmas of what is true, and lengths and angles together less than half
    as wrong as before; a zero half a turn away is the same wheel."""
    with next(folder.rglob("calibration_groundtruth0/data.csv")).open() as file:
        truth = {row["name"]: float(row["value"]) for row in csv.DictReader(file)}
    found = json.loads((folder / "calibrated/summary.json").read_text())["calibration"]
    before, after = {}, {}
    for name, one in found.items():
        if not one["sigma"]:
            continue
        simulated = name[:-1] + order[int(name[-1]) - 1] if order else name
        error, was = one["final"] - truth[simulated], one["initial"] - truth[simulated]
        if name.startswith("delta_"):
            error, was = math.remainder(error, math.pi), math.remainder(was, math.pi)
        before[one["unit"]] = math.hypot(before.get(one["unit"], 0), was)
        after[one["unit"]] = math.hypot(after.get(one["unit"], 0), error)
        print(f"{name}: {one['final']:.6f}, true {truth[simulated]:.6f}, off by {error / one['sigma']:.2f} sigmas")
        if abs(error) > 4 * one["sigma"]:
            sys.exit(f"{name} is {one['final']} +- {one['sigma']}, true {truth[simulated]}")
    if not before:
        sys.exit("nothing was calibrated")
    for unit, was in before.items():
        if after[unit] > was / 2:
            sys.exit(f"errors in {unit}: {after[unit]}, {was} before the calibration")


def main():
    page, section, source, programs, *order = sys.argv[1:]
    env = dict(os.environ, PATH=programs + os.pathsep + os.environ["PATH"])
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(pathlib.Path(source) / "configs", pathlib.Path(folder) / "configs")
        for command in commands(pathlib.Path(page), section):
            program = command.split()[0]
            if program.startswith("viwo") and not (pathlib.Path(programs) / program).exists():
                print(f"skipped: {program} was not built")
                sys.exit(77)
            begin = time.monotonic()
            done = subprocess.run(command, shell=True, cwd=folder, env=env, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            print(f"$ {command}\n{done.stdout}[{time.monotonic() - begin:.1f} s, exit {done.returncode}]\n")
            if done.returncode != (1 if command.startswith("viwo inspect") else 0):
                sys.exit(f"'{command}' ended with {done.returncode}")
        if any("viwo calibrate" in command for command in commands(pathlib.Path(page), section)):
            check_calibration(pathlib.Path(folder), order[0] if order else None)


if __name__ == "__main__":
    main()
