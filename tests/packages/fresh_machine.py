#!/usr/bin/env python3
"""fresh_machine.py SOURCE BUILD WORK CMAKE: makes the packages of BUILD, compares each with its SBOM, and
installs them on a minimal Debian of this machine's release, by ../shared/tools/fresh_machine.sh.

They are installed as the Containerfile does it (scripts/install_packages.sh), without a container."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

source, build, work = map(pathlib.Path, sys.argv[1:4])
sys.path.insert(0, str(source / 'scripts'))
import sbom  # noqa: E402

SKIP = 77


def run(*command, **options):
    print('+', *command, flush=True)
    subprocess.run(command, check=True, **options)


def make_packages(folder):
    # Packages of this very machine may be for its processor alone.
    run(pathlib.Path(sys.argv[4]).parent / 'cpack', '-B', folder, '-D', 'CPACK_VIWO_ARCH=', cwd=build)
    packages = sorted(folder.glob('*.deb'))
    names = [package.name.split('_')[0] for package in packages]
    assert names == ['viwo-dev', 'viwo-images', 'viwo-ros', 'viwo-show', 'viwo'], names
    return packages


def check_sbom(package, folder):
    run('dpkg-deb', '-x', package, folder)
    name = package.name.split('_')[0]
    document = json.loads((folder / sbom.document_file(name)).read_text(encoding='utf-8'))
    wrong = sbom.differences(document, folder)
    assert not wrong, wrong
    assert (folder / f'usr/share/doc/{name}/copyright').stat().st_size > 500
    print(f'{name}: {len(document["files"])} files as in its SBOM')


def main():
    fresh_machine = source.parent / 'shared/tools/fresh_machine.sh'
    codename = re.search(r'^VERSION_CODENAME=(\w+)', pathlib.Path('/etc/os-release').read_text(), re.M)
    if os.geteuid() != 0 or not fresh_machine.exists() or not codename:
        print(f'skipped: needs root, a release of Debian and {fresh_machine}')
        return SKIP
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    packages = make_packages(work / 'packed')
    (work / 'unpacked').mkdir()
    for package in packages:
        check_sbom(package, work / 'unpacked' / package.name)
    repository = work / 'repository'
    repository.mkdir()
    for file in (*packages, source / 'scripts/install_packages.sh',
                 source / 'tests/packages/on_fresh_machine.sh'):
        shutil.copy(file, repository)
    git = ('git', '-C', repository, '-c', 'user.name=test', '-c', 'user.email=test@localhost')
    run(*git, 'init', '-q')
    run(*git, 'add', '.')
    run(*git, 'commit', '-q', '-m', 'packages')
    run(fresh_machine, codename[1], repository, 'bash', './on_fresh_machine.sh', '"$PWD"')
    shutil.rmtree(work)
    return 0


if __name__ == '__main__':
    sys.exit(main())
