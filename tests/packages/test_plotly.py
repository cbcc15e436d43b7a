#!/usr/bin/env python3
"""test_plotly.py SOURCE BUILD WORK CMAKE: where the plot library is in place, building needs no npm."""

import json
import pathlib
import shutil
import subprocess
import sys
import unittest

SOURCE, BUILD, WORK = map(pathlib.Path, sys.argv[1:4])
CMAKE = sys.argv[4]
MODULE = SOURCE / 'framework/report'
VERSION = json.loads((MODULE / 'web/package.json').read_text())['dependencies'][
    'plotly.js-cartesian-dist-min']


class WithoutNpm(unittest.TestCase):
    def setUp(self):
        shutil.rmtree(WORK, ignore_errors=True)
        WORK.mkdir(parents=True)
        (WORK / 'CMakeLists.txt').write_text(
            'cmake_minimum_required(VERSION 3.22)\nproject(p LANGUAGES NONE)\n'
            f'include({MODULE}/plotly.cmake)\nmessage(STATUS "script ${{plotly_js}}")\n')

    def tearDown(self):
        shutil.rmtree(WORK, ignore_errors=True)

    def configure(self, *options):
        """(exit code, what is printed in one line); no program is found, npm neither."""
        result = subprocess.run(
            [CMAKE, '-S', WORK, '-B', WORK / 'build', '-G', 'Unix Makefiles',
             '-DCMAKE_MAKE_PROGRAM=/bin/true', '-DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF',
             '-DCMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF', *options],
            capture_output=True, text=True, check=False)
        return result.returncode, ' '.join((result.stdout + result.stderr).split())

    def place(self, folder, version):
        folder.mkdir(parents=True)
        (folder / 'plotly-cartesian.min.js').write_text('')
        (folder / 'LICENSE').write_text('')
        (folder / 'package.json').write_text(json.dumps({'version': version}))
        return folder

    def test_a_folder_that_has_it_is_enough(self):
        folder = self.place(WORK / 'here', VERSION)
        code, printed = self.configure(f'-DVIWO_PLOTLY_DIR={folder}')
        self.assertEqual(code, 0, printed)
        self.assertIn(f'script {folder}/plotly-cartesian.min.js', printed)

    def test_a_build_folder_that_has_it_is_enough(self):
        self.place(WORK / 'build/web/node_modules/plotly.js-cartesian-dist-min', VERSION)
        code, printed = self.configure()
        self.assertEqual(code, 0, printed)

    def test_another_version_is_refused(self):
        folder = self.place(WORK / 'here', '1.0.0')
        code, printed = self.configure(f'-DVIWO_PLOTLY_DIR={folder}')
        self.assertNotEqual(code, 0)
        self.assertIn(f'VIWO_PLOTLY_DIR: 1.0.0 of plotly.js-cartesian-dist-min in {folder}, but '
                      f'{VERSION} is wanted', printed)

    def test_without_it_npm_is_asked_for(self):
        self.place(WORK / 'build/web/node_modules/plotly.js-cartesian-dist-min', '1.0.0')
        code, printed = self.configure()
        self.assertNotEqual(code, 0)
        self.assertIn('npm is needed', printed)
        self.assertIn('VIWO_PLOTLY_DIR', printed)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
