"""The hashes of message types that ros2_topics says, made here of the definitions that are written into
files, as ROS 2 makes them (REP 2016): SHA-256 of a description in JSON, without constants, defaults and
comments. A definition that is not that of ROS 2 has another hash.

  test_type_hashes.py SOURCES
"""
import hashlib
import json
import pathlib
import re
import sys
import unittest

# What is heard and not written into files; all other definitions are those of the files.
ONLY_HEARD = {
    'geometry_msgs/PoseWithCovarianceStamped':
        'std_msgs/Header header, geometry_msgs/PoseWithCovariance pose',
    'sensor_msgs/CompressedImage': 'std_msgs/Header header, string format, uint8[] data',
    'std_msgs/String': 'string data',
}


def read_definitions(sources):
    """Fields of each type, 'KIND NAME, KIND NAME, ...', without constants and defaults."""
    text = pathlib.Path(sources, 'plugins/sensors/ros2_bag/ros2_definitions.cpp').read_text()
    found = re.findall(r'\{"(\w+/\w+)",\s*((?:"[^"]*\\n"\s*)+)\}', text)
    fields = {name: ''.join(re.findall(r'"([^"]*)"', parts)).split('\\n') for name, parts in found}
    return {name: ', '.join(' '.join(line.split()[:2]) for line in lines if line and '=' not in line)
            for name, lines in fields.items()} | ONLY_HEARD


NESTED = 1
NUMBERS = {'int8': 2, 'uint8': 3, 'uint16': 5, 'int32': 6, 'uint32': 7, 'float64': 11, 'byte': 16,
           'string': 17}
ARRAY, SEQUENCE = 48, 144  # added to the number of what they are of


def full_name(name):
    return name.replace('/', '/msg/')


def field_of(text):
    kind, name = text.split()
    base, is_many, count = re.fullmatch(r'([\w/]+)(\[(\d*)\])?', kind).groups()
    number = NUMBERS.get(base, NESTED)
    if is_many:
        number += ARRAY if count else SEQUENCE
    return {'name': name, 'type': {
        'type_id': number, 'capacity': int(count or 0), 'string_capacity': 0,
        'nested_type_name': full_name(base) if base in DEFINITIONS else ''}}


def description_of(name):
    return {'type_name': full_name(name),
            'fields': [field_of(text) for text in DEFINITIONS[name].split(', ')]}


def used_by(name):
    for base in re.findall(r'\w+/\w+', DEFINITIONS[name]):
        yield base
        yield from used_by(base)


def hash_of(name):
    whole = {'type_description': description_of(name),
             'referenced_type_descriptions': [description_of(one) for one in sorted(set(used_by(name)))]}
    return hashlib.sha256(json.dumps(whole).encode()).hexdigest()


class TypeHashes(unittest.TestCase):
    def test_are_made_as_ros2_makes_them(self):
        # As ROS 2 of Jazzy has it; most others who speak with it write it down, too.
        self.assertEqual(hash_of('std_msgs/String'),
                         'df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18')

    def test_that_are_said_are_those_of_the_definitions(self):
        source = pathlib.Path(SOURCES, 'plugins/sensors/ros2_topics/dds_names.cpp').read_text()
        said = dict(re.findall(r'TypeHash\{"([\w/]+)",\s*"(\w+)"\}', source))
        self.assertEqual(len(said), source.count('TypeHash{'))
        self.assertGreater(len(said), 0)
        self.assertEqual(said, {name: hash_of(name) for name in said})


if __name__ == '__main__':
    SOURCES = sys.argv.pop(1)
    DEFINITIONS = read_definitions(SOURCES)
    unittest.main()
