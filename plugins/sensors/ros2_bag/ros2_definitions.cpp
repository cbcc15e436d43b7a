#include "ros2_definitions.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace viwo::bag {
namespace {

struct Definition {
  std::string_view type;
  std::string_view fields;
};

constexpr Definition kDefinitions[] = {
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\n"
     "geometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
     "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
     "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/JointState",
     "std_msgs/Header header\n"
     "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"},
    {"sensor_msgs/Image",
     "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
     "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    {"sensor_msgs/NavSatStatus",
     "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 status\n"
     "uint16 SERVICE_GPS=1\nuint16 service\n"},
    {"sensor_msgs/NavSatFix",
     "std_msgs/Header header\nsensor_msgs/NavSatStatus status\n"
     "float64 latitude\nfloat64 longitude\nfloat64 altitude\n"
     "float64[9] position_covariance\n"
     "uint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\n"
     "uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3\n"
     "uint8 position_covariance_type\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\n"
     "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n"},
    {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    {"diagnostic_msgs/DiagnosticStatus",
     "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\n"
     "byte level\nstring name\nstring message\nstring hardware_id\n"
     "diagnostic_msgs/KeyValue[] values\n"},
    {"diagnostic_msgs/DiagnosticArray",
     "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    {"foxglove_msgs/Point2", "float64 x\nfloat64 y\n"},
    {"foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n"},
    {"foxglove_msgs/CircleAnnotation",
     "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\n"
     "float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n"},
    {"foxglove_msgs/PointsAnnotation",
     "builtin_interfaces/Time timestamp\nuint8 UNKNOWN=0\nuint8 POINTS=1\nuint8 LINE_LOOP=2\n"
     "uint8 LINE_STRIP=3\nuint8 LINE_LIST=4\nuint8 type\nfoxglove_msgs/Point2[] points\n"
     "foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\n"
     "foxglove_msgs/Color fill_color\nfloat64 thickness\n"},
    {"foxglove_msgs/TextAnnotation",
     "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\n"
     "float64 font_size\nfoxglove_msgs/Color text_color\n"
     "foxglove_msgs/Color background_color\n"},
    {"foxglove_msgs/ImageAnnotations",
     "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
     "foxglove_msgs/TextAnnotation[] texts\n"}};

const Definition& definition_of(std::string_view type) {
  const auto* const found = std::ranges::find_if(
      kDefinitions, [type](const Definition& one) { return one.type == type; });
  if (found == std::end(kDefinitions)) {
    throw std::logic_error("no definition of " + std::string(type));
  }
  return *found;
}

/// Appends what its fields are made of and is not yet there.
void collect(const Definition& one, std::vector<std::string_view>& used) {
  for (std::string_view rest = one.fields; !rest.empty(); rest.remove_prefix(rest.find('\n') + 1)) {
    const std::string_view type = rest.substr(0, rest.find_first_of(" ["));
    if (type.find('/') == std::string_view::npos) continue;  // "float64"
    if (std::find(used.begin(), used.end(), type) != used.end()) continue;
    used.push_back(type);
    collect(definition_of(type), used);
  }
}

}  // namespace

std::string ros2_definition(const std::string& type) {
  constexpr std::string_view kMiddle = "/msg/";
  std::string plain = type;
  plain.replace(plain.find(kMiddle), kMiddle.size(), "/");
  const Definition& whole = definition_of(plain);
  std::vector<std::string_view> used;
  collect(whole, used);
  std::string out(whole.fields);
  for (const std::string_view part : used) {
    out += std::string(80, '=') + "\nMSG: " + std::string(part) + "\n";
    out += definition_of(part).fields;
  }
  return out;
}

}  // namespace viwo::bag
