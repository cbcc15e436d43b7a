#!/usr/bin/env python3
"""install.py SOURCE BUILD WORK CMAKE: installs into WORK/prefix, by way of another folder.

The tests that follow use an installation that was moved after it was installed: what works there
depends neither on the build folder nor on the prefix that was given.
"""

import shutil
import subprocess
import unittest

from installed import Installation
from run_paths import entries, linked_files, wrong_entries


def dynamic_section(file):
    return subprocess.run(['readelf', '-dW', file], capture_output=True, text=True,
                          check=True).stdout


class Install(unittest.TestCase):
    def test_install_and_move(self):
        work, prefix = Installation.work, Installation.prefix
        shutil.rmtree(work, ignore_errors=True)
        first = work / 'first_place'
        result = subprocess.run(
            [Installation.cmake, '--install', Installation.build, '--prefix', first],
            capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        first.rename(prefix)
        with self.subTest('nothing knows the build folder or the first place'):
            for file in sorted(prefix.rglob('*')):
                if file.is_symlink() or not file.is_file():
                    continue
                if file.suffix in ('.cmake', '.yaml', '.md', '.hpp'):
                    text = file.read_text(encoding='utf-8')
                    self.assertNotIn(str(Installation.build), text, file)
                    self.assertNotIn(str(first), text, file)
        with self.subTest('programs and plugins find the library beside them'):
            paths = {f'bin/{name}': '$ORIGIN/../lib' for name in ('viwo', 'viwo_conformance')}
            for plugin in (prefix / 'lib/viwo/plugins').glob('*/*.so'):
                paths[str(plugin.relative_to(prefix))] = '$ORIGIN/../../..'
            self.assertGreater(len(paths), 15)
            for name, path in paths.items():
                self.assertEqual(entries(prefix / name), [path], name)
                self.assertIn('[libviwo_api.so.11]', dynamic_section(prefix / name), name)
        with self.subTest('no program or library looks for libraries elsewhere'):
            self.assertGreater(len(linked_files(prefix)), 17)
            self.assertEqual(wrong_entries(prefix), [])
        with self.subTest('the library has its name and version'):
            self.assertIn('soname: [libviwo_api.so.11]',
                          dynamic_section(prefix / 'lib/libviwo_api.so'))
        with self.subTest('what people read is there'):
            for name in ('share/doc/viwo/LICENSE', 'share/doc/viwo/NOTICE',
                         'share/doc/viwo/docs/writing_a_plugin.md',
                         'share/doc/viwo/plugins/kinematics/differential/model.md',
                         'share/viwo/configs/runs/viwo_swerve.yaml'):
                self.assertTrue((prefix / name).is_file(), name)


if __name__ == '__main__':
    Installation.from_arguments()
    unittest.main()
