#include "messages.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "viwo/image/image_file.hpp"

namespace viwo::bag {
namespace {

struct Type {
  Kind kind;
  std::string_view name;
  std::string_view ros1_md5;
};

constexpr std::array kTypes{
    Type{Kind::kImu, "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2"},
    Type{Kind::kImage, "sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743"},
    Type{Kind::kCompressedImage, "sensor_msgs/CompressedImage", "8f7a12909da2c9d3332d540a0977563f"},
    Type{Kind::kJoints, "sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd"},
    Type{Kind::kPose, "geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5"},
    Type{Kind::kPoseWithCovariance, "geometry_msgs/PoseWithCovarianceStamped",
         "953b798c0f514ff060a53a3498ce6246"},
    Type{Kind::kOdometry, "nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7"},
    Type{Kind::kNavSatFix, "sensor_msgs/NavSatFix", "2d3a8cd499b9b4a0249fb98fd05cfa48"}};

const Type& type_of(Kind kind) {
  return *std::find_if(kTypes.begin(), kTypes.end(),
                       [kind](const Type& known) { return known.kind == kind; });
}

/// How an encoding becomes grey.
struct Encoding {
  std::string_view name;
  int channels;
  int channel_bytes;
  int conversion;  ///< of OpenCV; negative: the byte of each pixel at -1 - conversion is grey
};

// OpenCV names a Bayer pattern by its second row.
constexpr std::array kEncodings{Encoding{"mono8", 1, 1, -1},
                                Encoding{"8UC1", 1, 1, -1},
                                Encoding{"mono16", 1, 2, -1},
                                Encoding{"16UC1", 1, 2, -1},
                                Encoding{"bgr8", 3, 1, cv::COLOR_BGR2GRAY},
                                Encoding{"8UC3", 3, 1, cv::COLOR_BGR2GRAY},
                                Encoding{"rgb8", 3, 1, cv::COLOR_RGB2GRAY},
                                Encoding{"bgra8", 4, 1, cv::COLOR_BGRA2GRAY},
                                Encoding{"8UC4", 4, 1, cv::COLOR_BGRA2GRAY},
                                Encoding{"rgba8", 4, 1, cv::COLOR_RGBA2GRAY},
                                Encoding{"bayer_rggb8", 1, 1, cv::COLOR_BayerBG2GRAY},
                                Encoding{"bayer_bggr8", 1, 1, cv::COLOR_BayerRG2GRAY},
                                Encoding{"bayer_gbrg8", 1, 1, cv::COLOR_BayerGR2GRAY},
                                Encoding{"bayer_grbg8", 1, 1, cv::COLOR_BayerGB2GRAY},
                                Encoding{"yuv422", 2, 1, -2},
                                Encoding{"yuv422_yuy2", 2, 1, -1}};

const Encoding* find_encoding(std::string_view name) {
  const auto found = std::find_if(kEncodings.begin(), kEncodings.end(),
                                  [name](const Encoding& known) { return known.name == name; });
  return found == kEncodings.end() ? nullptr : &*found;
}

std::array<double, 3> read_vector(FieldReader& in) {
  std::array<double, 3> v{};
  for (double& value : v) value = in.f64();
  return v;
}

void skip(FieldReader& in, int numbers) {
  for (int i = 0; i < numbers; ++i) in.f64();
}

std::vector<double> read_numbers(FieldReader& in) {
  std::vector<double> numbers(in.count(sizeof(double)));
  for (double& number : numbers) number = in.f64();
  return numbers;
}

/// One byte of each pixel.
void pick_bytes(const ImageHead& head, std::span<const std::uint8_t> pixels, std::size_t stride,
                std::size_t offset, Image& out) {
  for (std::size_t v = 0; v < head.height_px; ++v) {
    const std::uint8_t* const from = pixels.data() + v * head.row_bytes + offset;
    std::uint8_t* const to = out.pixels.data() + v * head.width_px;
    if (stride == 1) {
      std::copy_n(from, head.width_px, to);
    } else {
      for (std::size_t u = 0; u < head.width_px; ++u) to[u] = from[u * stride];
    }
  }
}

std::string size_text(const ImageHead& head) {
  return std::to_string(head.width_px) + " x " + std::to_string(head.height_px) + " " +
         head.encoding;
}

}  // namespace

std::optional<Kind> kind_of(std::string_view type) {
  std::string plain(type);
  if (const auto middle = plain.find("/msg/"); middle != std::string::npos) {
    plain.erase(middle, 4);
  }
  for (const Type& known : kTypes) {
    if (known.name == plain) return known.kind;
  }
  return std::nullopt;
}

std::string_view type_name(Kind kind) { return type_of(kind).name; }

std::string_view ros1_md5(Kind kind) { return type_of(kind).ros1_md5; }

ImuSample read_imu(FieldReader& in) {
  ImuSample imu;
  imu.t_ns = in.header();
  skip(in, 4 + 9);  // an orientation, which not every driver knows, and its covariance
  imu.gyro_rad_per_s = read_vector(in);
  skip(in, 9);
  imu.accel_m_per_s2 = read_vector(in);
  return imu;
}

Joints read_joints(FieldReader& in) {
  Joints joints;
  joints.t_ns = in.header();
  // A text takes more memory than its four bytes of a message.
  constexpr std::size_t kMostNames = 10'000, kLongestName = 1000;
  const std::size_t n = in.count(sizeof(std::uint32_t));
  if (n > kMostNames) throw BrokenMessage("it has more than 10000 joints");
  joints.names.resize(n);
  for (std::string& name : joints.names) {
    name = in.text();
    if (name.size() > kLongestName) throw BrokenMessage("a joint has a name of over 1000 bytes");
  }
  joints.positions = read_numbers(in);
  joints.velocities = read_numbers(in);
  return joints;
}

Joints read_twist(FieldReader& in) {
  Joints joints;
  joints.t_ns = in.header();
  in.text();         // child_frame_id
  skip(in, 7 + 36);  // the pose and its covariance
  const double v_x = in.f64();
  const double v_y = in.f64();
  skip(in, 3);
  const double omega_z = in.f64();
  joints.names = {"v_x", "v_y", "omega_z"};
  joints.velocities = {v_x, v_y, omega_z};
  return joints;
}

PoseSample read_pose(Kind kind, FieldReader& in) {
  PoseSample pose;
  pose.t_ns = in.header();
  if (kind == Kind::kOdometry) in.text();  // child_frame_id
  pose.p_BinW_m = read_vector(in);
  for (double& value : pose.q_BtoW_xyzw) value = in.f64();
  return pose;
}

std::optional<GnssSample> read_fix(FieldReader& in) {
  // Of the message's definition.
  constexpr std::int8_t kNoFix = -1;
  constexpr std::uint8_t kUnknown = 0, kDiagonalKnown = 2;
  GnssSample fix;
  fix.t_ns = in.header();
  const auto status = static_cast<std::int8_t>(in.u8());
  in.u16();  // which satellites
  fix.latitude_deg = in.f64();
  fix.longitude_deg = in.f64();
  fix.altitude_m = in.f64();
  for (double& value : fix.covariance_ENU_m2) value = in.f64();
  const std::uint8_t known = in.u8();
  for (std::size_t i = 0; i < fix.covariance_ENU_m2.size(); ++i) {
    const bool is_diagonal = i % 4 == 0;
    if (known == kUnknown || (known == kDiagonalKnown && !is_diagonal)) {
      fix.covariance_ENU_m2[i] = 0.;
    }
  }
  if (status <= kNoFix) return std::nullopt;
  return fix;
}

std::vector<Transform> read_transforms(FieldReader& in) {
  constexpr std::size_t kLeastBytes = 76;  // of one whose frames have no names
  std::vector<Transform> transforms(in.count(kLeastBytes));
  for (Transform& transform : transforms) {
    in.stamp();
    transform.parent = in.text();
    transform.child = in.text();
    transform.p_m = read_vector(in);
    for (double& value : transform.q_xyzw) value = in.f64();
  }
  return transforms;
}

ImageHead read_image_head(FieldReader& in) {
  ImageHead head;
  head.t_ns = in.header();
  head.height_px = in.u32();
  head.width_px = in.u32();
  head.encoding = in.text();
  head.big_endian = in.u8() != 0;
  head.row_bytes = in.u32();
  return head;
}

bool is_known_encoding(std::string_view encoding) { return find_encoding(encoding) != nullptr; }

bool is_depth(std::string_view format) {
  return format.find("compressedDepth") != std::string_view::npos;
}

std::string known_encodings() {
  std::string names;
  for (const Encoding& known : kEncodings) {
    names += (names.empty() ? "" : ", ") + std::string(known.name);
  }
  return names;
}

void to_grey(const ImageHead& head, std::span<const std::uint8_t> pixels, Image& out) {
  const Encoding* const encoding = find_encoding(head.encoding);
  if (encoding == nullptr) throw BrokenMessage("encoding '" + head.encoding + "' is not read");
  if (head.width_px == 0 || head.height_px == 0 || head.width_px > kLongestImageSide ||
      head.height_px > kLongestImageSide ||
      std::uint64_t{head.width_px} * head.height_px > kMostImagePixels) {
    throw BrokenMessage("an image of " + size_text(head));
  }
  const auto pixel_bytes = static_cast<std::size_t>(encoding->channels * encoding->channel_bytes);
  const std::size_t used_bytes = head.width_px * pixel_bytes;
  if (head.row_bytes < used_bytes ||
      pixels.size() < std::size_t{head.row_bytes} * (head.height_px - 1) + used_bytes) {
    throw BrokenMessage("an image of " + size_text(head) + " in rows of " +
                        std::to_string(head.row_bytes) + " bytes has " +
                        std::to_string(pixels.size()) + " bytes of pixels");
  }
  out.width_px = static_cast<int>(head.width_px);
  out.height_px = static_cast<int>(head.height_px);
  out.pixels.resize(std::size_t{head.width_px} * head.height_px);
  if (encoding->conversion < 0) {
    const bool upper_is_second = encoding->channel_bytes == 2 && !head.big_endian;
    const auto offset = static_cast<std::size_t>(-1 - encoding->conversion);
    return pick_bytes(head, pixels, pixel_bytes, offset + (upper_is_second ? 1 : 0), out);
  }
  // OpenCV has no matrix of constant data; it does not write to the source of a conversion.
  const cv::Mat from(out.height_px, out.width_px, CV_8UC(encoding->channels),
                     const_cast<std::uint8_t*>(pixels.data()), head.row_bytes);
  cv::Mat to(out.height_px, out.width_px, CV_8UC1, out.pixels.data());
  try {
    cv::cvtColor(from, to, encoding->conversion);
  } catch (const cv::Exception& error) {  // a Bayer pattern of fewer than three rows
    throw BrokenMessage("an image of " + size_text(head) + ": " + error.err);
  }
}

}  // namespace viwo::bag
