#include "sequence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "bayer_image.hpp"
#include "row_reader.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::kaist {
namespace {

namespace fs = std::filesystem;

/// How far R R^T may be off the identity: the file has few digits.
constexpr double kRotationTolerance = 1e-3;
constexpr const char* kNoRotation = "pose whose matrix is no rotation";

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// `path`, which must be there; otherwise an InputError that says what it is for, how to do without
/// it, and what there is instead.
fs::path required(const fs::path& path, const std::string& what, const std::string& without) {
  std::error_code ignored;
  if (fs::exists(path, ignored)) return path;
  std::string text = path.string() + " is missing: " + what + " (" + without + " does without)";
  const fs::path folder = path.parent_path();
  const std::vector<std::string> names = names_in(folder);
  if (!fs::is_directory(folder, ignored)) {
    text += "; there is no folder " + folder.filename().string();
  } else if (names.empty()) {
    text += "; the folder " + folder.filename().string() + " is empty";
  } else {
    text += log::did_you_mean(path.filename().string(), names);
  }
  throw InputError(text);
}

/// The nearest rotation to a matrix with rounded entries; nothing when it is none.
std::optional<Eigen::Matrix3d> rotation_from(const Eigen::Matrix3d& R) {
  if (!R.allFinite()) return std::nullopt;  // maxCoeff() may pass over a NaN
  const double off = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance) || R.determinant() < 0.) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();  // (KU-2)
}

/// The pose of a row of global_pose.csv: stamp, then [R | p] row after row.
std::optional<PoseSample> pose_from(const RowReader& row) {
  Eigen::Matrix3d R;
  PoseSample pose;
  pose.t_ns = row.stamp_ns(0);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      R(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row.number(1 + 4 * i + j);
    }
    pose.p_BinW_m[i] = row.number(4 + 4 * i);
  }
  const auto R_BtoW = rotation_from(R);
  if (!R_BtoW) return std::nullopt;
  const Eigen::Quaterniond q(*R_BtoW);
  pose.q_BtoW_xyzw = {q.x(), q.y(), q.z(), q.w()};
  return pose;
}

}  // namespace

Sequence::Sequence(fs::path folder, const LogLimits& limits)
    : folder_(std::move(folder)), limits_(limits) {}

log::ImuRecording Sequence::imu() const {
  RowReader row(required(folder_ / "sensor_data" / "xsens_imu.csv",
                         "the inertial measurements are in it", "imu: false"),
                "timestamp_ns, quaternion (4), Euler angles (3), angular rate (3), specific force "
                "(3), magnetic field (3)");
  log::ImuCollector collector(limits_);
  while (row.next()) {
    if (row.size() == 8) {
      row.reader().fail(
          "8 fields: the orientation alone, as in the first release of the dataset; angular rate "
          "and specific force are needed (17 fields): take the newer release of this sequence "
          "(imu: false does without)");
    }
    row.require_size(17);
    ImuSample imu;
    imu.t_ns = row.stamp_ns(0);
    for (std::size_t i = 0; i < 3; ++i) {
      imu.gyro_rad_per_s[i] = row.number(8 + i);
      imu.accel_m_per_s2[i] = row.number(11 + i);
    }
    collector.add(imu, row.reader());
  }
  return collector.finish(row.reader());
}

std::int64_t Sequence::encoder_resolution() const {
  constexpr std::string_view kKey = "Encoder resolution:";
  log::TextReader reader(required(folder_ / "calibration" / "EncoderParameter.txt",
                                  "it says how many counts a turn of a wheel has",
                                  "encoder_resolution: N"));
  std::string_view line;
  while (reader.next(line)) {
    line = log::trim(line);
    if (!line.starts_with(kKey)) continue;
    const std::string_view text = log::trim(line.substr(kKey.size()));
    const auto value = log::parse_integer(text);
    if (!value || *value <= 0) reader.fail(log::quoted(text) + " is no number of counts");
    return *value;
  }
  throw InputError(reader.file().string() +
                   "  has no line 'Encoder resolution: N' (encoder_resolution: N does without)");
}

log::EncoderRecording Sequence::wheels(std::int64_t ticks_per_turn,
                                       const log::JointParams& joints) const {
  RowReader row(required(folder_ / "sensor_data" / "encoder.csv",
                         "the counts of the wheel encoders are in it", "wheels: false"),
                "timestamp_ns, left count, right count");
  if (ticks_per_turn == 0) ticks_per_turn = encoder_resolution();
  const double rad_per_tick = 2. * M_PI / static_cast<double>(ticks_per_turn);
  log::EncoderRecordingOptions options;
  options.limits = limits_;
  options.drive_is_angle = true;
  options.joints = joints;
  log::EncoderCollector collector(options, 2, 0);
  log::EncoderReading reading;
  reading.n_drive = 2;
  while (row.next()) {
    row.require_size(3);
    reading.t_ns = row.stamp_ns(0);
    for (std::size_t i = 0; i < 2; ++i) {
      reading.drive[i] = rad_per_tick * static_cast<double>(row.integer(1 + i));  // (KU-1)
    }
    collector.add(reading, row.reader());
  }
  return collector.finish(row.reader());
}

log::PoseRecording Sequence::reference() const {
  RowReader row(
      required(folder_ / "global_pose.csv", "the reference poses are in it", "reference: false"),
      "timestamp_ns, the 3 x 4 matrix [R | p] of the vehicle row after row");
  log::StampFilter filter(limits_);
  log::PoseRecording out;
  while (row.next()) {
    row.require_size(13);
    const std::optional<PoseSample> pose = pose_from(row);
    if (!pose) {
      filter.reject(kNoRotation, row.reader());
    } else if (!std::all_of(pose->p_BinW_m.begin(), pose->p_BinW_m.end(),
                            [](double x) { return std::isfinite(x); })) {
      filter.reject(log::kNotFinite, row.reader());
    } else if (filter.accept(pose->t_ns, row.reader())) {
      out.samples.push_back(*pose);
    }
  }
  filter.finish(row.reader());
  out.rejections = filter.counts();
  return out;
}

log::Recording<ImageSample> Sequence::images(int camera) const {
  const char* const side = camera == 0 ? "stereo_left" : "stereo_right";
  RowReader row(required(folder_ / "sensor_data" / "stereo_stamp.csv",
                         "the stamps of the images are in it", "images: false"),
                "timestamp_ns");
  const fs::path folder = required(
      folder_ / "image" / side,
      std::string("the images of the ") + (camera == 0 ? "left" : "right") + " camera are in it",
      "images: false");
  const std::string missing = std::string("image that is missing in ") + side;
  log::StampFilter filter(limits_);
  log::Recording<ImageSample> out;
  while (row.next()) {
    row.require_size(1);
    const std::int64_t t_ns = row.stamp_ns(0);
    fs::path file = folder / (std::to_string(t_ns) + ".png");
    std::error_code ignored;
    if (!fs::exists(file, ignored)) {
      filter.reject(missing, row.reader());
    } else if (filter.accept(t_ns, row.reader())) {
      out.samples.push_back({t_ns, camera, std::make_shared<const BayerImage>(std::move(file))});
    }
  }
  filter.finish(row.reader());
  out.rejections = filter.counts();
  return out;
}

}  // namespace viwo::kaist
