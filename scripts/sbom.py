#!/usr/bin/env python3
"""What is in a package, as an SPDX 2.3 document (JSON).

    sbom.py PACKAGE VERSION ROOT BUILD    the document of the files below ROOT, on stdout
    sbom.py --check DOCUMENT ROOT         whether it is that of the files below ROOT

PACKAGE is made of each file with its hashes, the Debian packages of the libraries that each program
links, and what is compiled in: headers and static libraries of Debian packages, scripts of npm. All of
that is read from the files, from dpkg and from the build (ninja); nothing is typed in here.
"""

import base64
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid

LICENCE = 'Apache-2.0'
OURS = re.compile(r'libviwo_')
# Of every compiler's own: what they leave in a program is free of conditions.
OF_THE_COMPILER = re.compile(r'(gcc-\d+|glibc|linux)$')
# Names of licences in Debian's copyright files that are others in SPDX.
SPDX_NAMES = {
    'Apache-2': 'Apache-2.0', 'Apache-2.0': 'Apache-2.0', 'BSD-2-clause': 'BSD-2-Clause',
    'BSD-3-clause': 'BSD-3-Clause', 'BSD-3-Clause': 'BSD-3-Clause', 'BSD-4-clause': 'BSD-4-Clause',
    'BSL-1.0': 'BSL-1.0', 'Expat': 'MIT', 'MIT': 'MIT', 'GPL-2': 'GPL-2.0-only',
    'GPL-2+': 'GPL-2.0-or-later', 'GPL-3': 'GPL-3.0-only', 'GPL-3+': 'GPL-3.0-or-later',
    'LGPL-2+': 'LGPL-2.0-or-later', 'LGPL-2.1': 'LGPL-2.1-only', 'LGPL-2.1+': 'LGPL-2.1-or-later',
    'LGPL-3': 'LGPL-3.0-only', 'LGPL-3+': 'LGPL-3.0-or-later', 'MPL-2.0': 'MPL-2.0', 'Zlib': 'Zlib',
    'zlib': 'Zlib'}


def output(*command):
    """Of a command that may find only some of what it is asked for."""
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout


def is_elf(file):
    with open(file, 'rb') as stream:
        return stream.read(4) == b'\x7fELF'


def regular_files(root):
    return [file for file in sorted(root.rglob('*')) if file.is_file() and not file.is_symlink()]


# Debian packages

def packages_of(files):
    """{file: Debian package}; files of no package are left out."""
    paths = {}
    for file in map(str, files):
        real = os.path.realpath(file)
        for path in (file, real, real.removeprefix('/usr')):  # dpkg knows /lib, which is /usr/lib
            paths.setdefault(path, file)
    found = {}
    for line in output('dpkg', '-S', *paths).splitlines():
        package, _, path = line.partition(': ')
        if path in paths and not line.startswith('diversion '):
            found.setdefault(paths[path], package.split(',')[0])
    return found


def debian_package(name):
    """Of an installed package, as SPDX describes one, and its source package as `source`."""
    fields = output('dpkg-query', '-W', '-f', '${Package}\t${Architecture}\t${Version}\t'
                    '${source:Package}\t${Homepage}\n', name).splitlines()[0].split('\t')
    package, architecture, version, source, homepage = fields
    declared, comment = debian_licence(package)
    described = {
        'SPDXID': f'SPDXRef-deb-{re.sub("[^A-Za-z0-9.-]", "-", package)}', 'name': package,
        'versionInfo': version, 'downloadLocation': 'NOASSERTION', 'filesAnalyzed': False,
        'licenseConcluded': 'NOASSERTION', 'licenseDeclared': declared,
        'copyrightText': 'NOASSERTION',
        'externalRefs': [{'referenceCategory': 'PACKAGE-MANAGER', 'referenceType': 'purl',
                          'referenceLocator': f'pkg:deb/debian/{package}@{version}'
                                              f'?arch={architecture}'.replace('+', '%2B')}]}
    if comment:
        described['licenseComments'] = comment
    if homepage:
        described['homepage'] = homepage
    return described, source


def debian_licence(package):
    """(SPDX expression of `Files: *`, all that is named) in the copyright file of the package."""
    file = pathlib.Path('/usr/share/doc') / package / 'copyright'
    text = file.read_text(encoding='utf-8', errors='replace') if file.is_file() else ''
    if not re.match(r'\s*Format', text):
        return 'NOASSERTION', ''
    declared, named = 'NOASSERTION', []
    for paragraph in re.split(r'\n\s*\n', text):
        licence = re.search(r'^License: *(\S.*)$', paragraph, re.M)
        if not licence:
            continue
        named += [licence[1].strip()] if licence[1].strip() not in named else []
        if re.search(r'^Files: *\*', paragraph, re.M):
            words = [SPDX_NAMES.get(word, word.upper() if word in ('and', 'or') else None)
                     for word in licence[1].split()]
            if None not in words:
                declared = ' '.join(words)
    return declared, f'named in its copyright file: {"; ".join(named)}'


# What a program is made of

def needed(file):
    return re.findall(r'\(NEEDED\).*\[(.*)\]', output('readelf', '-dW', file))


def shared_libraries():
    """{soname: file} of this machine, those of its own architecture first."""
    found = {}
    for line in output('/sbin/ldconfig', '-p').splitlines():
        match = re.match(r'\s*(\S+) \(.*\) => (\S+)$', line)
        if match:
            found.setdefault(match[1], match[2])
    return found


def made_as(file):
    """The file that is made from the same sources for any processor (viwo_faster_copies.cmake)."""
    copy = re.fullmatch(r'lib/viwo/(plugins/\w+/)?x86-64-v[34]/(.*)', str(file))
    if not copy:
        return file
    return f'lib/viwo/{copy[1]}{copy[2]}' if copy[1] else f'bin/{copy[2]}'


def build_inputs(build, files):
    """What ninja made the files from: (headers and sources, static libraries, folders of npm)."""
    inputs = output('ninja', '-C', build, '-t', 'inputs', *files).splitlines() if files else []
    objects = [name for name in inputs if name.endswith('.o')]
    sources = set()
    if objects:
        sources = {line.strip() for line in
                   output('ninja', '-C', build, '-t', 'deps', *objects).splitlines()
                   if line.startswith('    /')}
    archives = {name for name in inputs if name.startswith('/') and name.endswith('.a')}
    folders = {(pathlib.Path(build) / name).parent for name in inputs if name.endswith('.min.js')}
    return sources, archives, sorted(folders)


def npm_package(folder):
    package = json.loads((folder / 'package.json').read_text(encoding='utf-8'))
    name, version = package['name'], package['version']
    described = {
        'SPDXID': f'SPDXRef-npm-{re.sub("[^A-Za-z0-9.-]", "-", name)}', 'name': name,
        'versionInfo': version, 'downloadLocation': 'NOASSERTION', 'filesAnalyzed': False,
        'licenseConcluded': package['license'], 'licenseDeclared': package['license'],
        'copyrightText': 'NOASSERTION',
        'externalRefs': [{'referenceCategory': 'PACKAGE-MANAGER', 'referenceType': 'purl',
                          'referenceLocator': f'pkg:npm/{name}@{version}'}]}
    notice = re.search(r'^Copyright.*$', (folder / 'LICENSE').read_text(encoding='utf-8'), re.M)
    if notice:
        described['copyrightText'] = notice[0]
    lock_file = pathlib.Path(__file__).parent.parent / 'framework/report/web/package-lock.json'
    locked = json.loads(lock_file.read_text(encoding='utf-8'))['packages'].get(
        f'node_modules/{name}', {})
    if locked.get('version') == version and locked.get('integrity', '').startswith('sha512-'):
        digest = base64.b64decode(locked['integrity'].removeprefix('sha512-')).hex()
        described['downloadLocation'] = locked.get('resolved', 'NOASSERTION')
        described['checksums'] = [{'algorithm': 'SHA512', 'checksumValue': digest}]
    return described


def parts(root, build):
    """(linked, compiled in, npm): {file: Debian packages}, Debian packages, folders."""
    programs = [file for file in regular_files(root) if is_elf(file)]
    known = shared_libraries()
    sonames = {program: [name for name in needed(program) if not OURS.match(name)]
               for program in programs}
    missing = {name for names in sonames.values() for name in names if name not in known}
    if missing:
        raise SystemExit(f'sbom.py: not on this machine: {", ".join(sorted(missing))}')
    owners = packages_of({known[name] for names in sonames.values() for name in names})
    linked = {program: sorted({owners.get(known[name], name) for name in names})
              for program, names in sonames.items()}
    sources, archives, folders = build_inputs(
        build, [made_as(file.relative_to(root / 'usr')) for file in programs])
    sources_linked = {debian_package(name)[1] for names in linked.values() for name in names}
    compiled_in = set(packages_of(archives).values())
    for name in set(packages_of(sources).values()):
        source = debian_package(name)[1]
        if source not in sources_linked and not OF_THE_COMPILER.match(source):
            compiled_in.add(name)
    return linked, sorted(compiled_in), folders


# The document

def digests(file):
    content = file.read_bytes()
    return {'SHA1': hashlib.sha1(content).hexdigest(),
            'SHA256': hashlib.sha256(content).hexdigest()}


def document_file(package):
    return f'usr/share/doc/{package}/{package}.spdx.json'


def described_files(package, root):
    own = root / document_file(package)
    described = []
    for number, file in enumerate(f for f in regular_files(root) if f != own):
        described.append({
            'SPDXID': f'SPDXRef-file-{number}', 'fileName': f'./{file.relative_to(root)}',
            'checksums': [{'algorithm': name, 'checksumValue': value}
                          for name, value in digests(file).items()],
            'licenseConcluded': LICENCE, 'licenseInfoInFiles': ['NOASSERTION'],
            'copyrightText': 'NOASSERTION'})
    return described


def verification_code(files):
    """As section 7.9 of the specification defines it: of the SHA-1 of all files, sorted."""
    return hashlib.sha1(''.join(sorted(
        checksum['checksumValue'] for file in files for checksum in file['checksums']
        if checksum['algorithm'] == 'SHA1')).encode()).hexdigest()


def document(package, version, root, build, created):
    root = pathlib.Path(root)
    files = described_files(package, root)
    linked, compiled_in, folders = parts(root, build)
    code = verification_code(files)
    own = f'SPDXRef-{package}'
    packages = [{
        'SPDXID': own, 'name': package, 'versionInfo': version,
        'supplier': 'Organization: the viwo authors', 'downloadLocation': 'NOASSERTION',
        'filesAnalyzed': True, 'licenseConcluded': LICENCE, 'licenseDeclared': LICENCE,
        'licenseInfoFromFiles': ['NOASSERTION'], 'copyrightText': 'Copyright the viwo authors',
        'packageVerificationCode': {
            'packageVerificationCodeValue': code,
            'packageVerificationCodeExcludedFiles': [f'./{document_file(package)}']}}]
    debian = {name: debian_package(name)[0]
              for name in sorted({*compiled_in, *(n for names in linked.values() for n in names)})}
    npm = [npm_package(folder) for folder in folders]
    relations = [('SPDXRef-DOCUMENT', 'DESCRIBES', own)]
    relations += [(own, 'CONTAINS', file['SPDXID']) for file in files]
    relations += [(own, 'CONTAINS', part['SPDXID']) for part in npm]
    relations += [(own, 'STATIC_LINK', debian[name]['SPDXID']) for name in compiled_in]
    ids = {file['fileName']: file['SPDXID'] for file in files}
    relations += [(ids[f'./{program.relative_to(root)}'], 'DYNAMIC_LINK', debian[name]['SPDXID'])
                  for program, names in linked.items() for name in names]
    return {
        'spdxVersion': 'SPDX-2.3', 'dataLicense': 'CC0-1.0', 'SPDXID': 'SPDXRef-DOCUMENT',
        'name': f'{package}-{version}',
        'documentNamespace': f'https://spdx.org/spdxdocs/{package}-'
                             f'{uuid.uuid5(uuid.NAMESPACE_URL, f"{package} {version} {code}")}',
        'creationInfo': {
            'created': datetime.datetime.fromtimestamp(created, datetime.timezone.utc)
                       .strftime('%Y-%m-%dT%H:%M:%SZ'),
            'creators': ['Tool: viwo-sbom.py', 'Organization: the viwo authors']},
        'packages': packages + list(debian.values()) + npm, 'files': files,
        'relationships': [{'spdxElementId': a, 'relationshipType': kind, 'relatedSpdxElement': b}
                          for a, kind, b in relations]}


def differences(described, root):
    """Sentences: which files below root are not those of the document."""
    root = pathlib.Path(root)
    package = described['packages'][0]
    excluded = set(package['packageVerificationCode']['packageVerificationCodeExcludedFiles'])
    found = {f'./{file.relative_to(root)}': file for file in regular_files(root)}
    named = {file['fileName']: file for file in described['files']}
    wrong = [f'{name}: not in the document' for name in found.keys() - named.keys() - excluded]
    wrong += [f'{name}: in the document, but not there' for name in named.keys() - found.keys()]
    for name in named.keys() & found.keys():
        expected = {c['algorithm']: c['checksumValue'] for c in named[name]['checksums']}
        if expected != digests(found[name]):
            wrong.append(f'{name}: another hash than in the document')
    code = package['packageVerificationCode']['packageVerificationCodeValue']
    if code != verification_code(described['files']):
        wrong.append('the verification code is not that of the files')
    return sorted(wrong)


def main(arguments):
    if len(arguments) == 3 and arguments[0] == '--check':
        described = json.loads(pathlib.Path(arguments[1]).read_text(encoding='utf-8'))
        wrong = differences(described, arguments[2])
        print('\n'.join(wrong) or 'all files are those of the document')
        return 1 if wrong else 0
    if len(arguments) == 4:
        now = datetime.datetime.now().timestamp()
        print(json.dumps(document(*arguments, now), indent=1))
        return 0
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
