"""What the tests of an installation share: where it is, and how to run things in its environment."""

import os
import pathlib
import shutil
import subprocess
import sys
import unittest

from run_paths import wrong_entries


class Installation:
    """Folders of one test; paths from the command line of the test."""
    build = source = work = prefix = None
    cmake = 'cmake'

    @classmethod
    def from_arguments(cls):
        cls.source, cls.build, cls.work, cls.cmake = (
            pathlib.Path(argument) for argument in sys.argv[1:5])
        cls.prefix = cls.work / 'prefix'
        del sys.argv[1:5]


def environment():
    """As a user has it: the installation first, nothing of the build or of other plugins."""
    variables = {name: value for name, value in os.environ.items()
                 if not name.startswith('VIWO_') and name != 'LD_LIBRARY_PATH'}
    bin_folders = [str(Installation.prefix / 'bin'), str(Installation.cmake.parent)]
    variables['PATH'] = os.pathsep.join(bin_folders + [variables.get('PATH', '')])
    variables['CMAKE_PREFIX_PATH'] = str(Installation.prefix)
    if shutil.which('ninja'):
        variables.setdefault('CMAKE_GENERATOR', 'Ninja')
    if shutil.which('ccache'):
        variables['CMAKE_CXX_COMPILER_LAUNCHER'] = 'ccache'
    return variables


class ConsumerTest(unittest.TestCase):
    """Each test has a fresh folder of its name below the work folder."""
    maxDiff = None

    def setUp(self):
        self.folder = Installation.work / self.id().rpartition('.')[2]
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)

    def run_command(self, *command, code=0, cwd=None):
        """Output and errors of a command that must end with `code`."""
        result = subprocess.run(
            [str(word) for word in command], cwd=cwd or self.folder, env=environment(), text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        self.assertEqual(result.returncode, code, f'{command}\n{result.stdout}')
        return result.stdout

    def build_and_test(self, folder):
        """Builds a plugin without a warning and runs its ctest."""
        self.run_command(Installation.cmake, '-S', folder, '-B', folder / 'build')
        output = self.run_command(Installation.cmake, '--build', folder / 'build')
        self.assertNotIn('warning:', output)
        self.assertEqual(wrong_entries(folder / 'build', [f'{Installation.prefix}/lib/']), [])
        return self.run_command(Installation.cmake.parent / 'ctest', '--test-dir', folder / 'build',
                                '--output-on-failure')
