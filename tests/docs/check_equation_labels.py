#!/usr/bin/env python3
"""Equation labels of the mathematics pages against their citations in the code.

A page (*.md under docs or plugins) defines a label with \\tag{S-2}; a comment of the C++ code
under framework or plugins cites it as (S-2), or as "..., W-9)". Fails when a label is cited but not
defined, defined but never cited in code, defined twice, or when two pages share a prefix.

    check_equation_labels.py [ROOT]
"""
import pathlib
import re
import sys

DEFINITION = re.compile(r"\\tag\{([A-Z]{1,3})-(\d+)\}")
ANY_CITATION = re.compile(r"\(([A-Z]{1,3})-(\d+)\)")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


def files(root, folders, suffixes):
    """Files below root/folder with one of the suffixes, in a fixed order."""
    found = []
    for folder in folders:
        found += [p for p in (root / folder).rglob("*")
                  if p.suffix in suffixes and "node_modules" not in p.parts]
    return sorted(found)


def line_of(text, position):
    return text.count("\n", 0, position) + 1


def label_key(label):
    prefix, number = label.split("-")
    return prefix, int(number)


def read_definitions(root, pages, errors):
    """Returns {label: page}; reports double labels and shared prefixes."""
    defined, owner = {}, {}
    for page in pages:
        name = page.relative_to(root).as_posix()
        text = page.read_text(encoding="utf-8")
        for match in DEFINITION.finditer(text):
            prefix, label = match[1], f"{match[1]}-{match[2]}"
            where = f"{name}:{line_of(text, match.start())}"
            if owner.setdefault(prefix, name) != name:
                errors.append(f"{where}: prefix {prefix} belongs to {owner[prefix]}")
            elif label in defined:
                errors.append(f"{where}: ({label}) is defined twice")
            defined[label] = name
    return defined


def citations(text, prefixes):
    """(label, position) of all citations: (X-1) with any prefix, X-1 with a known one."""
    found = {match.start(1): f"{match[1]}-{match[2]}" for match in ANY_CITATION.finditer(text)}
    if prefixes:
        known = re.compile(rf"(?<![\w{{-])({'|'.join(sorted(prefixes))})-(\d+)(?![\w}}-])")
        for match in known.finditer(text):
            found[match.start(1)] = f"{match[1]}-{match[2]}"
    return [(label, position) for position, label in sorted(found.items())]


def check(root):
    """Returns the errors as lines "file:line: what"."""
    errors = []
    pages = files(root, ["docs", "plugins"], {".md"})
    defined = read_definitions(root, pages, errors)
    prefixes = {label.split("-")[0] for label in defined}
    cited = set()
    for source in files(root, ["framework", "plugins"], {".cpp", ".hpp"}) + pages:
        name = source.relative_to(root).as_posix()
        text = source.read_text(encoding="utf-8")
        is_code = source.suffix != ".md"
        # Blank out what is not to be read, so that line numbers stay right.
        if is_code:
            kept = [" " if c != "\n" else c for c in text]
            for comment in COMMENT.finditer(text):
                kept[comment.start():comment.end()] = comment[0]
            text = "".join(kept)
        for label, position in citations(text, prefixes):
            if label not in defined:
                errors.append(f"{name}:{line_of(text, position)}: ({label}) is cited, "
                              "but no page defines it")
            elif is_code:
                cited.add(label)
    for label in sorted(set(defined) - cited, key=label_key):
        errors.append(f"{defined[label]}: ({label}) is defined, but no code cites it")
    if not defined:
        errors.append(f"{root}: no page defines any label")
    return errors


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    errors = check(root)
    print("\n".join(errors) if errors else "every label is defined and cited")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
