#!/usr/bin/env python3
"""The checkers of this folder find what is wrong in small trees made for them."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import check_equation_labels
import check_includes

HERE = pathlib.Path(__file__).resolve().parent


class Tree(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


class EquationLabels(Tree):
    def setUp(self):
        super().setUp()
        self.write("docs/math/wheel.md", "$$ a \\tag{W-1} $$\n\n$$ b \\tag{W-2} $$\n\nSee (W-1).\n")
        self.write("plugins/kinematics/one/model.md", "$$ c \\tag{S-1} $$\nfrom (W-2)\n")
        self.write("framework/wheel/src/a.cpp", "int a;  // (W-1)\n/* page.md,\n   W-2 */\n")
        self.write("plugins/kinematics/one/one.cpp", "int b;  // (S-1) and (W-1)\n")

    def errors(self):
        return check_equation_labels.check(self.root)

    def test_accepts_a_tree_in_which_all_labels_meet(self):
        self.assertEqual(self.errors(), [])

    def test_finds_a_citation_of_a_missing_number(self):
        self.write("framework/wheel/src/b.hpp", "\nint c;  // (W-7): no such thing\n")
        self.assertEqual(self.errors(), [
            "framework/wheel/src/b.hpp:2: (W-7) is cited, but no page defines it"])

    def test_finds_a_citation_of_an_unknown_prefix(self):
        self.write("framework/wheel/src/b.hpp", "int c;  // (Q-1)\n")
        self.assertEqual(self.errors(), [
            "framework/wheel/src/b.hpp:1: (Q-1) is cited, but no page defines it"])

    def test_finds_a_citation_without_its_own_parentheses(self):
        self.write("framework/wheel/src/b.hpp", "int c;  // (wheel.md, W-9)\n")
        self.assertEqual(self.errors(), [
            "framework/wheel/src/b.hpp:1: (W-9) is cited, but no page defines it"])

    def test_finds_a_label_that_no_code_cites(self):
        self.write("docs/math/wheel.md", "$$ a \\tag{W-1} \\tag{W-2} \\tag{W-10} $$ with (W-10)\n")
        self.assertEqual(self.errors(), [
            "docs/math/wheel.md: (W-10) is defined, but no code cites it"])

    def test_takes_only_comments_for_citations(self):
        self.write("plugins/kinematics/one/one.cpp", "int b = f(S-1);\n")
        self.assertEqual(self.errors(), [
            "plugins/kinematics/one/model.md: (S-1) is defined, but no code cites it"])

    def test_finds_a_dangling_reference_between_pages(self):
        self.write("docs/math/other.md", "as in (S-4)\n")
        self.assertEqual(self.errors(), [
            "docs/math/other.md:1: (S-4) is cited, but no page defines it"])

    def test_finds_a_label_defined_twice(self):
        self.write("plugins/kinematics/one/model.md", "\\tag{S-1}\n\\tag{S-1}\n")
        self.assertEqual(self.errors(), [
            "plugins/kinematics/one/model.md:2: (S-1) is defined twice"])

    def test_finds_a_prefix_on_two_pages(self):
        self.write("plugins/kinematics/two/model.md", "\\tag{S-2}\n")
        self.write("plugins/kinematics/two/two.cpp", "// (S-2)\n")
        self.assertEqual(self.errors(), [
            "plugins/kinematics/two/model.md:1: prefix S belongs to "
            "plugins/kinematics/one/model.md"])

    def test_ignores_words_that_only_look_alike(self):
        self.write("framework/wheel/src/b.hpp", "// AVX-512, UTF-8, GSW-1, W-1a, x-W-12, DW-3\n")
        self.assertEqual(self.errors(), [])

    def test_fails_as_a_program_and_says_why(self):
        self.write("framework/wheel/src/b.hpp", "// (W-3)\n")
        run = subprocess.run([sys.executable, HERE / "check_equation_labels.py", self.root],
                             capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertEqual(run.stdout, "framework/wheel/src/b.hpp:1: (W-3) is cited, but no page "
                                     "defines it\n")

    def test_does_not_accept_an_empty_tree(self):
        with tempfile.TemporaryDirectory() as empty:
            self.assertEqual(len(check_equation_labels.check(pathlib.Path(empty))), 1)


class Includes(Tree):
    def setUp(self):
        super().setUp()
        self.write("docs/architecture.md",
                   "| module | for | includes |\n|---|---|---|\n| `plugin_api` | all | - |\n"
                   "| `math` | numbers | - |\n| `config` | text | - |\n"
                   "| `plugin_host` | plugins | - |\n"
                   "| `wheel` | twists | plugin_api, plugin_host |\n| `experiment` | runs | - |\n")
        self.write("framework/wheel/src/a.cpp",
                   '#include <vector>\n#include "viwo/wheel/a.hpp"\n#include "viwo/api/b.hpp"\n'
                   '#include "viwo/plugin_host/c.hpp"\n#include "local.hpp"\n')
        self.write("framework/plugin_host/src/l.cpp", "#include <boost/dll/shared_library.hpp>\n")
        self.write("plugins/kinematics/one/one.cpp",
                   '#include "viwo/sim/a.hpp"\n#include "viwo/log/b.hpp"\n')
        self.write("plugins/sensors/tests/test_one.cpp", '#include "viwo/plugin_host/c.hpp"\n')

    def errors(self):
        return check_includes.check(self.root)

    def test_accepts_a_tree_whose_arrows_point_one_way(self):
        self.assertEqual(self.errors(), [])

    def test_finds_a_module_that_includes_a_later_one(self):
        self.write("framework/math/include/viwo/math/x.hpp", '\n#include "viwo/wheel/a.hpp"\n')
        self.assertEqual(self.errors(), [
            "framework/math/include/viwo/math/x.hpp:2: math must not include viwo/wheel/a.hpp"])

    def test_finds_it_between_angle_brackets_too(self):
        self.write("framework/config/src/x.cpp", "  #  include <viwo/app/a.hpp>\n")
        self.assertEqual(self.errors(), [
            "framework/config/src/x.cpp:1: config must not include viwo/app/a.hpp"])

    def test_finds_a_plugin_that_includes_the_host(self):
        self.write("plugins/kinematics/one/one.cpp", '#include "viwo/plugin_host/registry.hpp"\n')
        self.assertEqual(self.errors(), ["plugins/kinematics/one/one.cpp:1: a plugin must not "
                                         "include viwo/plugin_host/registry.hpp"])

    def test_finds_boost_dll_outside_of_the_plugin_host(self):
        self.write("framework/experiment/src/x.cpp", "#include <boost/dll.hpp>\n")
        self.assertEqual(self.errors(), ["framework/experiment/src/x.cpp:1: only plugin_host "
                                         "includes boost/dll.hpp"])

    def test_finds_an_include_that_climbs(self):
        self.write("plugins/kinematics/one/one.cpp", '#include "../two/two.hpp"\n')
        self.assertEqual(self.errors(), ["plugins/kinematics/one/one.cpp:1: ../two/two.hpp climbs "
                                         "out of its folder"])

    def test_wants_a_place_for_every_module(self):
        self.write("framework/extra/src/x.cpp", "")
        self.assertEqual(self.errors(), ["framework/extra/src/x.cpp: module 'extra' is not in the "
                                         "table of docs/architecture.md"])

    def test_finds_an_arrow_that_is_drawn_and_not_there(self):
        self.write("framework/wheel/src/a.cpp", '#include "viwo/api/b.hpp"\n')
        self.assertEqual(self.errors(), ["docs/architecture.md: wheel -> plugin_host is drawn, but "
                                         "nothing includes it"])

    def test_finds_an_arrow_that_points_down(self):
        page = self.root / "docs/architecture.md"
        self.write("docs/architecture.md", page.read_text().replace("numbers | -", "numbers | wheel"))
        self.write("framework/math/a.hpp", '#include "viwo/wheel/a.hpp"\n')
        self.assertEqual(self.errors(), ["docs/architecture.md: math -> wheel: an arrow to a module "
                                         "that is not above it"])

    def test_fails_as_a_program_and_says_why(self):
        self.write("framework/math/a.hpp", '#include "viwo/eval/a.hpp"\n')
        run = subprocess.run([sys.executable, HERE / "check_includes.py", self.root],
                             capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertEqual(run.stdout,
                         "framework/math/a.hpp:1: math must not include viwo/eval/a.hpp\n")

    def test_does_not_accept_an_empty_tree(self):
        with tempfile.TemporaryDirectory() as empty:
            self.assertEqual(len(check_includes.check(pathlib.Path(empty))), 1)


if __name__ == "__main__":
    unittest.main()
