#!/usr/bin/env python3
"""Which module includes which: the arrows of the architecture.

The table of modules in docs/architecture.md draws them. A module of the framework includes headers
of its own and of those that its row names, which stand above it; each arrow that is drawn is there.
A plugin includes those of PLUGIN_MODULES, tests any module; only plugin_host includes boost/dll. No
include climbs out of its folder.

    check_includes.py [ROOT]
"""
import pathlib
import re
import sys

PAGE = "docs/architecture.md"
# | `module` | what it is for | modules that it includes: "a, b", or "-" |
ROW = re.compile(r"^\| `(\w+)` \|[^|]*\| (-|\w+(?:, \w+)*) \|$", re.MULTILINE)
PLUGIN_MODULES = {"plugin_api", "math", "config", "image", "files", "log", "asl", "sim", "rendering", "wheel",
                  "camera"}
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*["<]([^">\n]+)[">]', re.MULTILINE)
SOURCES = {".cpp", ".hpp", ".h", ".cc"}


def header_module(header):
    """The module of "viwo/<module>/...", or None for headers of others."""
    parts = header.split("/")
    if parts[0] != "viwo" or len(parts) < 3:
        return None
    return "plugin_api" if parts[1] == "api" else parts[1]


def read_arrows(root):
    """{module: modules that it includes}, in the order of the page; errors of the page itself."""
    page = root / PAGE
    arrows, errors = {}, []
    for name, cell in ROW.findall(page.read_text(encoding="utf-8") if page.is_file() else ""):
        includes = set(re.findall(r"\w+", cell))
        for other in sorted(includes - set(arrows)):
            errors.append(f"{PAGE}: {name} -> {other}: an arrow to a module that is not above it")
        arrows[name] = includes
    return arrows, errors


def allowed_modules(path, arrows):
    """Name of what the file belongs to, and the modules it may include; None: any."""
    if path.parts[0] == "plugins":
        is_test = "tests" in path.parts or path.name.startswith("test_")
        return ("a test of a plugin", None) if is_test else ("a plugin", PLUGIN_MODULES)
    module = path.parts[1]
    return (f"a test of {module}", None) if "tests" in path.parts else (
        module, arrows[module] | {module})


def check_file(path, text, arrows, seen):
    if path.parts[0] == "framework" and path.parts[1] not in arrows:
        return [f"{path.as_posix()}: module '{path.parts[1]}' is not in the table of {PAGE}"]
    owner, allowed = allowed_modules(path, arrows)
    errors = []
    for match in INCLUDE.finditer(text):
        header = match[1]
        where = f"{path.as_posix()}:{text.count(chr(10), 0, match.start(1)) + 1}"
        module = header_module(header)
        if module is not None and allowed is not None:
            seen.add((owner, module))
            if module not in allowed:
                errors.append(f"{where}: {owner} must not include {header}")
        if header.startswith("boost/dll") and owner != "plugin_host":
            errors.append(f"{where}: only plugin_host includes {header}")
        if ".." in header.split("/"):
            errors.append(f"{where}: {header} climbs out of its folder")
    return errors


def check(root):
    """Returns the errors as lines "file:line: what"."""
    arrows, errors = read_arrows(root)
    count, seen = 0, set()
    for folder in ["framework", "plugins"]:
        for source in sorted((root / folder).rglob("*")):
            if source.suffix not in SOURCES or "node_modules" in source.parts:
                continue
            count += 1
            errors += check_file(source.relative_to(root), source.read_text(encoding="utf-8"),
                                 arrows, seen)
    for module, includes in arrows.items():
        errors += [f"{PAGE}: {module} -> {other} is drawn, but nothing includes it"
                   for other in sorted(includes) if (module, other) not in seen]
    if count == 0:
        errors.append(f"{root}: no sources found")
    return errors


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    errors = check(root)
    print("\n".join(errors) if errors else "every include is an arrow of the architecture, and every arrow an include")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
