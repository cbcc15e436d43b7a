"""Reads the files and the commands out of a tutorial page.

A fenced block after the line `<!-- file: NAME -->` is the file NAME. Blocks of the language sh are
commands, run in order in one shell, each after the files before it. After `<!-- output -->` a block
holds lines that the commands before it print, anywhere in their output. After
`<!-- not run: WHY -->` a block is passed over. Any other block is an error: no code of a page goes
unchecked.
"""

import dataclasses
import re

BLOCK = re.compile(
    r'(?:^<!-- (?P<mark>[^\n]*) -->\n)?^```(?P<language>\w*)\n(?P<text>.*?)^```$', re.M | re.S)
FILE = re.compile(r'file: (\S+)')


@dataclasses.dataclass
class Step:
    kind: str  # 'file', 'commands' or 'output'
    name: str  # of a file
    text: str
    line: int


def steps(page, name='page'):
    """The steps of the page; ValueError with the line of a block that is none."""
    found = []
    for match in BLOCK.finditer(page):
        mark, language, text = match['mark'] or '', match['language'], match['text']
        line = page.count('\n', 0, match.start('text'))
        file = FILE.fullmatch(mark)
        if file:
            found.append(Step('file', file[1], text, line))
        elif mark == 'output':
            found.append(Step('output', '', text, line))
        elif mark.startswith('not run: '):
            continue
        elif mark == '' and language == 'sh':
            found.append(Step('commands', '', text, line))
        else:
            raise ValueError(f'{name}:{line}: a block that is neither a file, nor commands, '
                             'nor output, nor marked as not run')
    # An indented block would be passed over unseen.
    fences = len(re.findall(r'^\s*```', page, re.M))
    if fences != 2 * len(BLOCK.findall(page)):
        raise ValueError(f'{name}: {fences} fences, but {len(BLOCK.findall(page))} blocks')
    return found
