#!/usr/bin/env python3
"""Which module includes which: the arrows of the architecture.

A module of the framework includes headers of its own and of the modules before it; a plugin those
of PLUGIN_MODULES, its tests any module; only plugin_host includes boost/dll. No include climbs out
of its folder.

    check_includes.py [ROOT]
"""
import pathlib
import re
import sys

# Folder below framework/, in the order of the dependencies. Headers of plugin_api are viwo/api/.
MODULES = ["plugin_api", "math", "testing", "config", "image", "log", "plugin_host", "wheel", "camera", "filter", "start",
           "sim", "eval",
           "report", "observability", "view", "experiment", "conformance", "app"]
PLUGIN_MODULES = {"plugin_api", "math", "image", "log", "sim", "wheel", "camera"}
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*["<]([^">\n]+)[">]', re.MULTILINE)
SOURCES = {".cpp", ".hpp", ".h", ".cc"}


def header_module(header):
    """The module of "viwo/<module>/...", or None for headers of others."""
    parts = header.split("/")
    if parts[0] != "viwo" or len(parts) < 3:
        return None
    return "plugin_api" if parts[1] == "api" else parts[1]


def allowed_modules(path):
    """Name of what the file belongs to, and the modules it may include."""
    if path.parts[0] == "plugins":
        is_test = "tests" in path.parts or path.name.startswith("test_")
        return ("a test of a plugin", set(MODULES)) if is_test else ("a plugin", PLUGIN_MODULES)
    module = path.parts[1]
    if module not in MODULES:
        return module, None
    return module, set(MODULES[:MODULES.index(module) + 1])


def check_file(path, text):
    owner, allowed = allowed_modules(path)
    if allowed is None:
        return [f"{path.as_posix()}: module '{owner}' has no place in the order of the modules"]
    errors = []
    for match in INCLUDE.finditer(text):
        header = match[1]
        where = f"{path.as_posix()}:{text.count(chr(10), 0, match.start(1)) + 1}"
        module = header_module(header)
        if module is not None and module not in allowed:
            errors.append(f"{where}: {owner} must not include {header}")
        if header.startswith("boost/dll") and owner != "plugin_host":
            errors.append(f"{where}: only plugin_host includes {header}")
        if ".." in header.split("/"):
            errors.append(f"{where}: {header} climbs out of its folder")
    return errors


def check(root):
    """Returns the errors as lines "file:line: what"."""
    errors, count = [], 0
    for folder in ["framework", "plugins"]:
        for source in sorted((root / folder).rglob("*")):
            if source.suffix not in SOURCES or "node_modules" in source.parts:
                continue
            count += 1
            errors += check_file(source.relative_to(root), source.read_text(encoding="utf-8"))
    if count == 0:
        errors.append(f"{root}: no sources found")
    return errors


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    errors = check(root)
    print("\n".join(errors) if errors else "every include follows the order of the modules")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
