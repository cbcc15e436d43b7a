#!/usr/bin/env python3
"""run_page.py PAGE.md SECTION SOURCE_FOLDER PROGRAMS_FOLDER: runs the commands of a section as they stand.

The commands are the blocks of ```sh below the heading. They run in an empty folder in which `configs` is
that of the sources. Exit code 1 of `viwo inspect` says that something was found, which is no failure.
Prints how long each took. Ends with 77 when a program that a command begins with was not built.
"""
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


def main():
    page, section, source, programs = sys.argv[1:]
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
            if done.returncode not in ((0, 1) if command.startswith("viwo inspect") else (0,)):
                sys.exit(f"'{command}' ended with {done.returncode}")


if __name__ == "__main__":
    main()
