"""The hashes of message types that ros2_topics says, made here of the definitions as ROS 2 makes them (REP
2016): SHA-256 of a description in JSON, without constants, defaults and comments.

  test_type_hashes.py SOURCES
"""
import hashlib
import json
import pathlib
import re
import sys
import unittest

DEFINITIONS = {
    'builtin_interfaces/Time': 'int32 sec, uint32 nanosec',
    'diagnostic_msgs/DiagnosticArray':
        'std_msgs/Header header, diagnostic_msgs/DiagnosticStatus[] status',
    'diagnostic_msgs/DiagnosticStatus':
        'byte level, string name, string message, string hardware_id, diagnostic_msgs/KeyValue[] values',
    'diagnostic_msgs/KeyValue': 'string key, string value',
    'geometry_msgs/Point': 'float64 x, float64 y, float64 z',
    'geometry_msgs/Pose': 'geometry_msgs/Point position, geometry_msgs/Quaternion orientation',
    'geometry_msgs/PoseStamped': 'std_msgs/Header header, geometry_msgs/Pose pose',
    'geometry_msgs/PoseWithCovariance': 'geometry_msgs/Pose pose, float64[36] covariance',
    'geometry_msgs/PoseWithCovarianceStamped':
        'std_msgs/Header header, geometry_msgs/PoseWithCovariance pose',
    'geometry_msgs/Quaternion': 'float64 x, float64 y, float64 z, float64 w',
    'geometry_msgs/Transform': 'geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation',
    'geometry_msgs/TransformStamped':
        'std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform',
    'geometry_msgs/Twist': 'geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular',
    'geometry_msgs/TwistWithCovariance': 'geometry_msgs/Twist twist, float64[36] covariance',
    'geometry_msgs/Vector3': 'float64 x, float64 y, float64 z',
    'nav_msgs/Odometry':
        'std_msgs/Header header, string child_frame_id, geometry_msgs/PoseWithCovariance pose, '
        'geometry_msgs/TwistWithCovariance twist',
    'nav_msgs/Path': 'std_msgs/Header header, geometry_msgs/PoseStamped[] poses',
    'sensor_msgs/CompressedImage': 'std_msgs/Header header, string format, uint8[] data',
    'sensor_msgs/Image':
        'std_msgs/Header header, uint32 height, uint32 width, string encoding, uint8 is_bigendian, '
        'uint32 step, uint8[] data',
    'sensor_msgs/Imu':
        'std_msgs/Header header, geometry_msgs/Quaternion orientation, '
        'float64[9] orientation_covariance, geometry_msgs/Vector3 angular_velocity, '
        'float64[9] angular_velocity_covariance, geometry_msgs/Vector3 linear_acceleration, '
        'float64[9] linear_acceleration_covariance',
    'sensor_msgs/JointState':
        'std_msgs/Header header, string[] name, float64[] position, float64[] velocity, '
        'float64[] effort',
    'sensor_msgs/NavSatFix':
        'std_msgs/Header header, sensor_msgs/NavSatStatus status, float64 latitude, '
        'float64 longitude, float64 altitude, float64[9] position_covariance, '
        'uint8 position_covariance_type',
    'sensor_msgs/NavSatStatus': 'int8 status, uint16 service',
    'std_msgs/Header': 'builtin_interfaces/Time stamp, string frame_id',
    'std_msgs/String': 'string data',
    'tf2_msgs/TFMessage': 'geometry_msgs/TransformStamped[] transforms',
}
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
    unittest.main()
