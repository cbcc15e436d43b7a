#!/usr/bin/env python3
"""test_packages.py SOURCE BUILD WORK CMAKE: each file is in the package that has what it links, and the
SBOM of a package is that of its files."""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

SOURCE, BUILD, WORK = map(pathlib.Path, sys.argv[1:4])
CMAKE = sys.argv[4]
sys.path.insert(0, str(SOURCE / 'scripts'))
import sbom  # noqa: E402

COMPONENTS = ('viwo', 'images', 'show', 'ros', 'dev')
ROS_OR_DDS = r'ros|cpp_common|fastrtps|fastdds|fastcdr|ddsc|rcl|rmw|tf2|class_loader'
IMAGE_FILES = r'opencv_imgcodecs'
WINDOW = r'opencv_(highgui|videoio)'
# What no file of a package may link, itself or through others.
FORBIDDEN = {'viwo': f'{ROS_OR_DDS}|{IMAGE_FILES}|{WINDOW}', 'images': f'{ROS_OR_DDS}|opencv_highgui',
             'show': ROS_OR_DDS, 'ros': 'opencv_highgui', 'dev': f'{ROS_OR_DDS}|{IMAGE_FILES}|{WINDOW}'}
# What each file of a package links, or it would belong to the package viwo.
REASON = {'images': IMAGE_FILES, 'show': WINDOW, 'ros': f'{ROS_OR_DDS}|sqlite3'}


def libraries(file):
    """All that are loaded with it, and the folder that each is in does not matter."""
    text = subprocess.run(['ldd', file], capture_output=True, text=True, check=True).stdout
    return [line.split()[0] for line in text.splitlines() if line.split()]


def forbidden_libraries(component, file):
    pattern = re.compile(rf'lib({FORBIDDEN[component]})')
    return [name for name in libraries(file) if pattern.match(name)]


def install(component, prefix):
    options = ['--component', component] if component else []
    subprocess.run([CMAKE, '--install', BUILD, '--prefix', prefix, *options], check=True,
                   capture_output=True)
    return {str(file.relative_to(prefix)) for file in prefix.rglob('*') if not file.is_dir()}


class PackagesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        cls.files = {name: install(name, WORK / name / 'usr') for name in COMPONENTS}

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)

    def programs(self, component):
        return [file for file in sbom.regular_files(WORK / component) if sbom.is_elf(file)]

    def test_each_installed_file_is_in_one_package(self):
        everything = install('', WORK / 'all')
        for name in everything:
            with self.subTest(name):
                self.assertEqual(len([c for c in COMPONENTS if name in self.files[c]]), 1)

    def test_no_file_links_what_its_package_does_not_have(self):
        checked = 0
        for component in COMPONENTS:
            for file in self.programs(component):
                with self.subTest(f'{component}: {file.name}'):
                    self.assertEqual(forbidden_libraries(component, file), [])
                    checked += 1
        self.assertGreater(checked, 30)

    def test_a_file_in_the_wrong_package_is_found(self):
        for file in self.programs('ros') + self.programs('images') + self.programs('show'):
            with self.subTest(file.name):
                self.assertNotEqual(forbidden_libraries('viwo', file) + [
                    name for name in libraries(file) if 'sqlite' in name], [])

    def test_what_is_in_another_package_has_a_reason(self):
        for component, pattern in REASON.items():
            for file in self.programs(component):
                names = ' '.join(sbom.needed(file))
                self.assertRegex(names, rf'lib({pattern})', file.name)

    def test_the_message_about_a_missing_plugin_names_its_package(self):
        text = (SOURCE / 'framework/plugin_host/src/registry.cpp').read_text(encoding='utf-8')
        named = {name: package
                 for names, package in re.findall(
                     r'const char\* const own : \{([^}]*)\}.*?return "viwo-(\w+)"', text, re.S)
                 for name in re.findall(r'"(\w+)"', names)}
        here = {match[1]: component for component in ('images', 'ros')
                for file in self.programs(component)
                if (match := re.fullmatch(r'libviwo_sensor_(\w+)\.so', file.name))}
        self.assertGreaterEqual(len(named), len(here))
        for name, component in here.items():  # a build may have left some out
            self.assertEqual(named.get(name), component, name)
        self.assertEqual(set(named.values()), {'images', 'ros'})


class SbomTest(unittest.TestCase):
    """On the SDK: headers, texts, programs."""

    @classmethod
    def setUpClass(cls):
        cls.root = WORK.parent / 'sbom'
        shutil.rmtree(cls.root, ignore_errors=True)
        install('dev', cls.root / 'usr')
        cls.document = sbom.document('viwo-dev', '1.0-1', cls.root, BUILD, 0)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.root, ignore_errors=True)

    def packages(self, relation):
        names = {package['SPDXID']: package['name'] for package in self.document['packages']}
        return {names.get(r['relatedSpdxElement']) for r in self.document['relationships']
                if r['relationshipType'] == relation}

    def test_has_what_the_specification_demands(self):
        document = self.document
        self.assertEqual(json.loads(json.dumps(document)), document)
        self.assertEqual((document['spdxVersion'], document['dataLicense'], document['SPDXID']),
                         ('SPDX-2.3', 'CC0-1.0', 'SPDXRef-DOCUMENT'))
        self.assertRegex(document['documentNamespace'], r'^https://[^#\s]+$')
        self.assertEqual(document['creationInfo']['created'], '1970-01-01T00:00:00Z')
        for creator in document['creationInfo']['creators']:
            self.assertRegex(creator, '^(Tool|Organization|Person): ')
        ids = ['SPDXRef-DOCUMENT']
        for package in document['packages']:
            ids.append(package['SPDXID'])
            for key in ('name', 'versionInfo', 'downloadLocation', 'licenseConcluded',
                        'licenseDeclared', 'copyrightText'):
                self.assertTrue(package[key], (key, package['SPDXID']))
            self.assertEqual('packageVerificationCode' in package, package['filesAnalyzed'])
        for file in document['files']:
            ids.append(file['SPDXID'])
            self.assertRegex(file['fileName'], r'^\./usr/')
            self.assertEqual([(c['algorithm'], len(c['checksumValue'])) for c in file['checksums']],
                             [('SHA1', 40), ('SHA256', 64)])
        self.assertEqual(len(ids), len(set(ids)))
        for name in ids:
            self.assertRegex(name, r'^SPDXRef-[A-Za-z0-9.-]+$')
        for relation in document['relationships']:
            self.assertIn(relation['spdxElementId'], ids)
            self.assertIn(relation['relatedSpdxElement'], ids)

    def test_names_what_is_linked_and_what_is_compiled_in(self):
        if shutil.which('dpkg-query') is None:
            self.skipTest('no dpkg here')
        linked = ' '.join(map(str, self.packages('DYNAMIC_LINK')))
        self.assertIn('libyaml-cpp0', linked)
        self.assertIn('libc6', linked)
        if (BUILD / 'build.ninja').exists() and shutil.which('ninja'):
            self.assertIn('libeigen3-dev', self.packages('STATIC_LINK'))
            folders = sbom.parts(WORK.parent / 'no_such_folder', BUILD)[2]
            self.assertEqual(folders, [])
            scripts = [sbom.npm_package(folder)
                       for folder in sbom.build_inputs(BUILD, ['bin/viwo'])[2]]
            self.assertEqual([(s['name'], s['licenseDeclared']) for s in scripts],
                             [('plotly.js-cartesian-dist-min', 'MIT')])

    def test_the_files_are_those_of_the_document(self):
        self.assertEqual(sbom.differences(self.document, self.root), [])

    def test_one_broken_missing_or_further_file_is_found(self):
        header = self.root / 'usr/include/viwo/api/plugin.hpp'
        content = header.read_bytes()
        name = './usr/include/viwo/api/plugin.hpp'
        header.write_bytes(content.replace(b'v', b'w', 1))
        self.assertEqual(sbom.differences(self.document, self.root),
                         [f'{name}: another hash than in the document'])
        header.unlink()
        self.assertEqual(sbom.differences(self.document, self.root),
                         [f'{name}: in the document, but not there'])
        header.write_bytes(content)
        further = self.root / 'usr/further'
        further.write_text('x')
        self.assertEqual(sbom.differences(self.document, self.root),
                         ['./usr/further: not in the document'])
        further.unlink()
        changed = json.loads(json.dumps(self.document))
        changed['files'][0]['checksums'][0]['checksumValue'] = '0' * 40
        self.assertEqual(len(sbom.differences(changed, self.root)), 2)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
