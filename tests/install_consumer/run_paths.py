#!/usr/bin/env python3
"""run_paths.py BUILD: where programs and libraries look for libraries.

An entry that is empty or relative is the folder that somebody happens to be in, and one of the machine
that built them is anybody's on another: whoever can write there runs code as the user. So each entry
begins with $ORIGIN, the folder of the file itself. What is linked to a library that lies elsewhere
(ROS in /opt) may say so as long as it is not installed.
"""

import pathlib
import subprocess
import sys

SHARED, PROGRAM = b'\x03\x00', b'\x02\x00'  # e_type, of a machine with little ends


def is_linked(file):
    """Programs and shared libraries, not object files."""
    with open(file, 'rb') as stream:
        header = stream.read(18)
    return header[:4] == b'\x7fELF' and header[16:18] in (SHARED, PROGRAM)


def linked_files(folder):
    return [file for file in sorted(pathlib.Path(folder).rglob('*'))
            if not file.is_symlink() and file.is_file() and is_linked(file)]


def entries(file):
    """Of its RUNPATH and RPATH."""
    text = subprocess.run(['readelf', '-dW', file], capture_output=True, text=True,
                          check=True).stdout
    return [entry for line in text.splitlines() if '(RUNPATH)' in line or '(RPATH)' in line
            for entry in line[line.index('[') + 1:line.rindex(']')].split(':')]


def wrong_entries(folder, allowed=()):
    """'FILE: [ENTRY]' of all that are linked below the folder, but those that begin with `allowed`."""
    return [f'{file}: [{entry}]' for file in linked_files(folder) for entry in entries(file)
            if not f'{entry}/'.startswith(('$ORIGIN/', *allowed))]


if __name__ == '__main__':
    wrong = wrong_entries(sys.argv[1], ['/usr/', '/opt/'])
    n = len(linked_files(sys.argv[1]))
    print(f'{n} programs and libraries', *wrong, sep='\n')
    sys.exit(1 if wrong or n < 2 else 0)
