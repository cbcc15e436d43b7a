#include "viwo/log/kalibr.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/text_reader.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::log {
namespace {

using config::Errors;
using config::Node;

constexpr double kRotationTolerance = 1e-3;
constexpr double kExactRotation = 1e-12;

/// The YAML tree; OpenCV's "%YAML:1.0" is no YAML directive and is blanked out.
Node load(const std::filesystem::path& file) {
  TextReader reader(file);
  std::string text;
  std::string_view line;
  // What goes beyond the limit is not read; the parser refuses it.
  while (text.size() <= config::kMaxYamlBytes && reader.next(line)) {
    if (reader.line_number() != 1 || !line.starts_with("%YAML:")) text += line;
    text += '\n';
  }
  return config::parse(text, file.string());
}

/// Reads the values of one section; what is wrong goes to `errors`, with the path of the key.
class Section {
 public:
  Section(const Node& node, std::string path, Errors& errors)
      : node_(node), path_(std::move(path)), errors_(errors) {}

  void error(const Node& at, std::string_view key, const std::string& text) const {
    errors_.add(at.mark(), full(key) + ": " + text);
  }

  const Node* find(std::string_view key) const { return node_.find(key); }

  const Node* required(const std::string& key) const {
    const Node* const found = node_.find(key);
    if (found != nullptr) return found;
    std::vector<std::string> keys;
    for (const Node::Entry& entry : node_.entries()) keys.push_back(entry.key);
    const std::string near = config::nearest(key, keys);
    errors_.add(node_.mark(),
                (path_.empty() ? std::string() : path_ + ": ") + "missing key '" + key + "'" +
                    (near.empty() ? std::string() : " - is '" + near + "' a misspelling of it?"));
    return nullptr;
  }

  std::optional<double> number(const Node& node, std::string_view key) const {
    if (!node.is_scalar()) {
      error(node, key, "expected a number, got " + std::string(node.kind_text()));
      return std::nullopt;
    }
    const auto value = parse_number(node.scalar());
    constexpr double kMost = 1e9;  // of a line delay in ns, too
    if (value && std::abs(*value) <= kMost) return value;
    error(node, key,
          log::quoted(node.scalar()) + (!value                  ? " is not a number"
                                        : std::isfinite(*value) ? " is beyond 1e9"
                                                                : " is not finite"));
    return std::nullopt;
  }

  /// A list of `n` numbers; `meaning` says which.
  std::optional<std::vector<double>> numbers(const Node& node, std::string_view key, std::size_t n,
                                             const char* meaning) const {
    if (!node.is_list() || node.items().size() != n) {
      error(node, key,
            "expected " + std::to_string(n) + " numbers " + meaning + ", got " +
                (node.is_list() ? std::to_string(node.items().size())
                                : std::string(node.kind_text())));
      return std::nullopt;
    }
    std::vector<double> values;
    for (const Node& item : node.items()) {
      if (const auto value = number(item, key)) values.push_back(*value);
    }
    if (values.size() != n) return std::nullopt;
    return values;
  }

  /// Which of `choices` the text at `key` is.
  std::optional<std::size_t> choice(const std::string& key,
                                    const std::vector<std::string>& choices) const {
    const Node* const node = required(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_scalar()) {
      error(*node, key, "expected a name, got " + std::string(node->kind_text()));
      return std::nullopt;
    }
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (choices[i] == node->scalar()) return i;
    }
    error(*node, key,
          log::quoted(node->scalar()) + " is not supported" +
              config::did_you_mean(node->scalar(), choices));
    return std::nullopt;
  }

  /// A rigid transform given as a list of four rows.
  std::optional<Eigen::Isometry3d> transform(const Node& node, std::string_view key) const;

 private:
  std::string full(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }

  const Node& node_;
  std::string path_;
  Errors& errors_;
};

std::optional<Eigen::Isometry3d> Section::transform(const Node& node, std::string_view key) const {
  if (!node.is_list() || node.items().size() != 4) {
    error(
        node, key,
        "expected a matrix of 4 rows, got " +
            (node.is_list() ? std::to_string(node.items().size()) : std::string(node.kind_text())));
    return std::nullopt;
  }
  Eigen::Matrix4d T;
  for (int i = 0; i < 4; ++i) {
    const auto row = numbers(node.items()[static_cast<std::size_t>(i)], key, 4, "in a row");
    if (!row) return std::nullopt;
    T.row(i) = Eigen::Map<const Eigen::RowVector4d>(row->data());
  }
  const Eigen::RowVector4d last(0., 0., 0., 1.);
  if (T.row(3) != last) {
    error(node.items()[3], key, "the last row must be [0, 0, 0, 1]");
    return std::nullopt;
  }
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance)) {
    error(node, key, "not a rotation: R R^T differs from the identity by " + number_text(off));
    return std::nullopt;
  }
  if (R.determinant() < 0.) {
    error(node, key, "not a rotation but a reflection: the determinant of R is -1");
    return std::nullopt;
  }
  Eigen::Isometry3d out(T);
  if (off > kExactRotation) {  // the nearest rotation
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
    out.linear() = svd.matrixU() * svd.matrixV().transpose();
  }
  return out;
}

/// T_CfromI from whichever way the file has it; `previous` is that of the camera before.
std::optional<Eigen::Isometry3d> read_place(const Section& section, const Node& at,
                                            const std::optional<Eigen::Isometry3d>& previous,
                                            bool first) {
  const Node* const cam_imu = section.find("T_cam_imu");
  const Node* const imu_cam = section.find("T_imu_cam");
  if (cam_imu != nullptr && imu_cam != nullptr) {
    section.error(*imu_cam, "T_imu_cam", "T_cam_imu is given, too: keep one of them");
    return std::nullopt;
  }
  if (cam_imu != nullptr) return section.transform(*cam_imu, "T_cam_imu");
  if (imu_cam != nullptr) {
    const auto T = section.transform(*imu_cam, "T_imu_cam");
    if (!T) return std::nullopt;
    return T->inverse();
  }
  const Node* const chained = section.find("T_cn_cnm1");
  if (chained != nullptr && !first) {
    const auto T = section.transform(*chained, "T_cn_cnm1");
    if (!T || !previous) return std::nullopt;  // the camera before has its own message
    return *T * *previous;
  }
  section.error(at, "T_cam_imu",
                std::string("missing; T_imu_cam") + (first ? "" : " or T_cn_cnm1") +
                    " would do, too (Kalibr writes it in the camera chain of its camera-IMU "
                    "calibration)");
  return std::nullopt;
}

void read_intrinsics(const Section& section, bool is_distorted, CameraView& camera) {
  const Node* node = section.required("intrinsics");
  if (node != nullptr) {
    if (const auto f = section.numbers(*node, "intrinsics", 4, "[fx, fy, cx, cy]")) {
      camera.intrinsics.head<4>() = Eigen::Map<const Eigen::Vector4d>(f->data());
      if ((*f)[0] <= 0. || (*f)[1] <= 0.) {
        section.error(*node, "intrinsics", "the focal lengths fx and fy must be positive");
      }
    }
  }
  if (!is_distorted) {
    node = section.find("distortion_coeffs");
    if (node != nullptr && !node->items().empty()) {
      section.error(*node, "distortion_coeffs", "distortion_model: none has none");
    }
    return;
  }
  node = section.required("distortion_coeffs");
  if (node == nullptr) return;
  if (const auto d = section.numbers(*node, "distortion_coeffs", 4,
                                     "(radtan: k1, k2, p1, p2; equidistant: k1 .. k4)")) {
    camera.intrinsics.tail<4>() = Eigen::Map<const Eigen::Vector4d>(d->data());
  }
}

void read_resolution(const Section& section, CameraView& camera) {
  constexpr double kLargest = 32'768., kMostPixels = 33'554'432.;  // as of an image file
  const Node* const node = section.required("resolution");
  if (node == nullptr) return;
  const auto size = section.numbers(*node, "resolution", 2, "[width, height]");
  if (!size) return;
  for (const double pixels : *size) {
    if (pixels != std::floor(pixels) || pixels < 1. || pixels > kLargest) {
      section.error(*node, "resolution",
                    number_text(pixels) + " is no number of pixels (1 to 32768)");
      return;
    }
  }
  if ((*size)[0] * (*size)[1] > kMostPixels) {
    section.error(*node, "resolution", "an image of more than 2^25 pixels");
    return;
  }
  camera.width_px = static_cast<int>((*size)[0]);
  camera.height_px = static_cast<int>((*size)[1]);
}

/// Kalibr's calibration of rolling shutters prints it; other programs read it under this name.
void read_line_delay(const Section& section, CameraView& camera) {
  constexpr double kSlowestReadout_s = 0.5;
  const Node* const node = section.find("line_delay_nanoseconds");
  if (node == nullptr) return;
  const auto delay_ns = section.number(*node, "line_delay_nanoseconds");
  if (!delay_ns) return;
  const double delay_s = 1e-9 * *delay_ns;
  if (delay_s >= 0. && delay_s * camera.height_px <= kSlowestReadout_s) {
    camera.line_delay_s = delay_s;
    return;
  }
  section.error(*node, "line_delay_nanoseconds",
                delay_s < 0. ? number_text(*delay_ns) + " is negative"
                             : number_text(*delay_ns) + " from row to row would be " +
                                   number_text(delay_s * camera.height_px) + " s for an image");
}

CameraView read_camera(const Section& section) {
  CameraView camera;
  section.choice("camera_model", {"pinhole"});
  const auto model = section.choice("distortion_model", {"radtan", "equidistant", "none"});
  camera.distortion = model == 1U ? CameraDistortion::kEquidistant : CameraDistortion::kRadtan;
  read_intrinsics(section, model != 2U, camera);  // none: radtan of zeros
  read_resolution(section, camera);
  if (const Node* shift = section.find("timeshift_cam_imu")) {
    if (const auto s = section.number(*shift, "timeshift_cam_imu")) camera.t_CtoI_s = *s;
  }
  read_line_delay(section, camera);
  return camera;
}

constexpr std::size_t kMostCameras = 64;

/// "cam" and a number.
bool is_camera_key(const std::string& key) {
  return key.size() > 3 && key.starts_with("cam") &&
         key.find_first_not_of("0123456789", 3) == std::string::npos;
}

/// All cameras of the file must be among the first `n`.
void check_numbering(const Node& root, std::size_t n, Errors& errors) {
  const std::string missing = "cam" + std::to_string(n);
  bool stranded = false;
  for (const Node::Entry& entry : root.entries()) {
    if (!is_camera_key(entry.key)) continue;
    const auto number = parse_integer(entry.key.substr(3));
    if (number && static_cast<std::size_t>(*number) < n) continue;
    errors.add(entry.key_mark, entry.key + ": there is no " + missing +
                                   " before it; cameras are counted from cam0 without gaps");
    stranded = true;
  }
  if (n > 0 || stranded) return;
  std::vector<std::string> keys;
  for (const Node::Entry& entry : root.entries()) keys.push_back(entry.key);
  errors.add(root.mark(), "no camera 'cam0'" + config::did_you_mean("cam0", keys));
}

void read_noise(const Section& section, const std::string& key, bool zero_is_possible,
                double& value) {
  const Node* const node = section.required(key);
  if (node == nullptr) return;
  const auto number = section.number(*node, key);
  if (!number) return;
  if (*number < 0. || (*number == 0. && !zero_is_possible)) {
    section.error(*node, key,
                  number_text(*number) + (zero_is_possible ? " is negative" : " is not positive"));
  }
  value = *number;
}

}  // namespace

std::vector<CameraView> read_kalibr_cameras(const std::filesystem::path& file) {
  const Node root = load(file);
  Errors errors;
  std::vector<CameraView> cameras;
  std::optional<Eigen::Isometry3d> place;
  for (const Node* node = root.find("cam0"); node != nullptr;
       node = root.find("cam" + std::to_string(cameras.size()))) {
    const std::string name = "cam" + std::to_string(cameras.size());
    if (cameras.size() == kMostCameras) {
      config::fail(node->mark(), name + ": more than " + std::to_string(kMostCameras) + " cameras");
    }
    const Section section(*node, name, errors);
    place = read_place(section, *node, place, cameras.empty());
    cameras.push_back(read_camera(section));
    if (!place) continue;
    cameras.back().R_ItoC = place->linear();
    cameras.back().p_IinC = place->translation();
  }
  check_numbering(root, cameras.size(), errors);
  errors.throw_if_any();
  return cameras;
}

ImuNoise read_kalibr_imu(const std::filesystem::path& file) {
  const Node root = load(file);
  Errors errors;
  const Node* const below = root.find("imu0");
  const Section section(below != nullptr ? *below : root, below != nullptr ? "imu0" : "", errors);
  ImuNoise noise;
  read_noise(section, "gyroscope_noise_density", false, noise.gyro_rad_per_s_sqrt_hz);
  read_noise(section, "accelerometer_noise_density", false, noise.accel_m_per_s2_sqrt_hz);
  read_noise(section, "gyroscope_random_walk", true, noise.gyro_walk_rad_per_s2_sqrt_hz);
  read_noise(section, "accelerometer_random_walk", true, noise.accel_walk_m_per_s3_sqrt_hz);
  errors.throw_if_any();
  return noise;
}

}  // namespace viwo::log
