"""Every C++ file that git tracks is as clang-format would write it.

Exit code 77 (skipped) when clang-format 14 or the git checkout is missing: other versions format
some lines differently.
"""

import pathlib
import re
import shutil
import subprocess
import sys

VERSION = 14
SKIPPED = 77


def find_clang_format():
    for name in (f'clang-format-{VERSION}', 'clang-format'):
        path = shutil.which(name)
        if path is None:
            continue
        text = subprocess.run([path, '--version'], capture_output=True, text=True).stdout
        match = re.search(r'version (\d+)\.', text)
        if match and int(match[1]) == VERSION:
            return path
    return None


def tracked_files(root):
    command = ['git', '-C', root, 'ls-files', '-z', '*.cpp', '*.hpp']
    try:
        names = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    files = [pathlib.Path(root, name) for name in names.split('\0') if name]
    return [str(file) for file in files if file.exists()]


def main():
    root = sys.argv[1]
    clang_format = find_clang_format()
    if clang_format is None:
        print(f'skipped: there is no clang-format {VERSION} here')
        return SKIPPED
    files = tracked_files(root)
    if files is None:
        print('skipped: this is not a git checkout')
        return SKIPPED
    if not files:
        print('git tracks no C++ file here')
        return 1
    result = subprocess.run([clang_format, '--dry-run', '-Werror', '--style=file', *files])
    if result.returncode == 0:
        print(f'{len(files)} files')
    else:
        print(f'to mend: {clang_format} -i FILE...')
    return 1 if result.returncode else 0


sys.exit(main())
