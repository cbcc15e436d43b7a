#!/usr/bin/env python3
"""package_documents.py PACKAGE VERSION ROOT BUILD MAINTAINER

Writes what Debian wants to find in /usr/share/doc/PACKAGE below ROOT, and what is in the package:
copyright with the terms of all that is compiled in, changelog, overrides of lintian, and last, of all
files, PACKAGE.spdx.json. cpack runs it (framework/cmake/viwo_cpack_documents.cmake).
"""

import email.utils
import gzip
import json
import os
import pathlib
import subprocess
import sys
import time

import sbom

COPYRIGHT = '''viwo: visual-inertial-wheel odometry
Copyright the viwo authors

Licensed under the Apache License, Version 2.0. You may obtain a copy of it at
http://www.apache.org/licenses/LICENSE-2.0, or, on a Debian system, read it in
/usr/share/common-licenses/Apache-2.0. The software is distributed on an "AS IS" basis,
WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
'''
OVERRIDES = {'': '''# An installation can be moved: each file finds the library relative to where it is itself.
{package}: custom-library-search-path RUNPATH $ORIGIN*
''', 'viwo': '''# The name of the package is that of the program; only its own programs and plugins link the library.
{package}: package-name-doesnt-match-sonames
# A script beside the configuration whose log it writes: an example.
{package}: python3-script-but-no-python3-dep
'''}


def time_of_source(source):
    """Of the last change, so that the same source makes the same package."""
    if 'SOURCE_DATE_EPOCH' in os.environ:
        return int(os.environ['SOURCE_DATE_EPOCH'])
    result = subprocess.run(['git', '-C', source, 'log', '-1', '--format=%ct'],
                            capture_output=True, text=True, check=False)
    return int(result.stdout) if result.returncode == 0 else int(time.time())


def copyright_text(root, build):
    _, compiled_in, folders = sbom.parts(root, build)
    text = COPYRIGHT
    for folder in folders:
        package = json.loads((folder / 'package.json').read_text(encoding='utf-8'))
        text += f'\n==== Contains {package["name"]} {package["version"]} (npm)\n\n'
        text += (folder / 'LICENSE').read_text(encoding='utf-8')
    seen = set()
    for name in compiled_in:
        described, source = sbom.debian_package(name)
        file = pathlib.Path('/usr/share/doc') / described['name'] / 'copyright'
        # The terms of Boost do not ask for a notice in what was compiled; its file has 2 MB.
        free = described['licenseDeclared'] == 'BSL-1.0'
        if source in seen or free or not file.is_file():
            continue
        seen.add(source)
        text += (f'\n==== Has parts of {source} ({described["name"]} {described["versionInfo"]}) '
                 'compiled in, whose terms in Debian are\n\n')
        text += file.read_text(encoding='utf-8', errors='replace')
    return text


def main(package, version, root, build, maintainer):
    root = pathlib.Path(root)
    when = time_of_source(pathlib.Path(__file__).parent)
    folder = root / 'usr/share/doc' / package
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'copyright').write_text(copyright_text(root, build), encoding='utf-8')
    changes = (f'viwo ({version}) unstable; urgency=medium\n\n  * Version {version}.\n\n'
               f' -- {maintainer}  {email.utils.formatdate(when)}\n')
    (folder / 'changelog.Debian.gz').write_bytes(gzip.compress(changes.encode(), 9, mtime=0))
    if any(sbom.is_elf(file) for file in sbom.regular_files(root)):
        overrides = root / 'usr/share/lintian/overrides' / package
        overrides.parent.mkdir(parents=True, exist_ok=True)
        text = OVERRIDES[''] + OVERRIDES.get(package, '')
        overrides.write_text(text.format(package=package), encoding='utf-8')
    described = sbom.document(package, version, root, build, when)
    (root / sbom.document_file(package)).write_text(json.dumps(described, indent=1) + '\n',
                                                   encoding='utf-8')


if __name__ == '__main__':
    if len(sys.argv) != 6:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:])
