// The kinds of samples that viwo's own sensors yield and its updates take. Plain data; times are
// integer nanoseconds so that a log plays back to the same bits. Others: sample.hpp.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "viwo/api/export.hpp"
#include "viwo/api/sample.hpp"

namespace viwo {

/// Most drive (steering) channels of one encoder sample.
inline constexpr int kMaxDrives = 8;
inline constexpr int kMaxSteers = 8;

/// Seconds between two stamps.
inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

/// Whether all numbers of an array are finite.
template <std::size_t kSize>
bool all_finite(const std::array<double, kSize>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) return false;
  }
  return true;
}

/// One reading of all wheel encoders of a base.
///
/// The sample stands for the time [begin_ns, end_ns]: the reading is the value at `t_ns`, the
/// middle of what was observed, and in the absence of other samples it holds over the whole cell.
/// Cells of one sensor are in time order and do not overlap; a hole between two cells is a gap in
/// the data. Sensors that sample rates at an instant use cells between the mid-points of their
/// stamps; sensors that count angles use the cell between two stamps and the mean rate over it,
/// which is exact.
struct EncoderSample {
  std::int64_t t_ns = 0;                             ///< stamp in the wheel clock
  std::int64_t begin_ns = 0;                         ///< start of the cell, <= t_ns
  std::int64_t end_ns = 0;                           ///< end of the cell, >= t_ns
  int n_drive = 0;                                   ///< channels used in drive_rad_per_s
  int n_steer = 0;                                   ///< channels used in steer_rad
  std::array<double, kMaxDrives> drive_rad_per_s{};  ///< wheel rotation rates, forward positive
  std::array<double, kMaxSteers> steer_rad{};  ///< steering angles, counter-clockwise positive
  /// Channels that are not to be believed, a bit each.
  std::uint32_t bad_drives = 0;
  std::uint32_t bad_steers = 0;

  const char* fault() const {
    if (!all_finite(drive_rad_per_s) || !all_finite(steer_rad)) return "value that is not finite";
    return end_ns < begin_ns ? "sample that ends before it begins" : nullptr;
  }
};

/// One reading of an inertial measurement unit.
struct ImuSample {
  std::int64_t t_ns = 0;                   ///< stamp in the IMU clock, the clock of the filter
  std::array<double, 3> gyro_rad_per_s{};  ///< angular rate of I in I
  std::array<double, 3> accel_m_per_s2{};  ///< specific force in I: R_GtoI (a_I + [0 0 g])

  const char* fault() const {
    const bool finite = all_finite(gyro_rad_per_s) && all_finite(accel_m_per_s2);
    return finite ? nullptr : "value that is not finite";
  }
};

/// One point of an image. The same `id` in later images, and in other cameras, is the same
/// landmark.
struct FeaturePoint {
  std::int64_t id = 0;
  double u_px = 0.;  ///< to the right, as measured (with distortion)
  double v_px = 0.;  ///< down
};

/// All tracked points of one image.
struct FeatureSample {
  std::int64_t t_ns = 0;             ///< stamp in the clock of the camera
  int camera = 0;                    ///< index in the configuration's list of cameras
  std::vector<FeaturePoint> points;  ///< ids are unique within a sample
};

/// A pose of body B in world W: of a reference system (simulator truth, motion capture), or a
/// measurement, for an update that names the sensor; then the stamp must be in the IMU clock.
struct PoseSample {
  std::int64_t t_ns = 0;                              ///< stamp in the clock of the reference
  std::array<double, 3> p_BinW_m{};                   ///< position of B's origin in W
  std::array<double, 4> q_BtoW_xyzw{0., 0., 0., 1.};  ///< Hamilton quaternion, unit norm

  const char* fault() const {
    return all_finite(p_BinW_m) && all_finite(q_BtoW_xyzw) ? nullptr : "value that is not finite";
  }
};

/// How a base is turned, by a gyro that integrates for itself: from an unknown zero, drifting.
struct HeadingSample {
  std::int64_t t_ns = 0;  ///< stamp in the clock of the gyro
  double yaw_rad = 0.;    ///< counter-clockwise positive, seen from above; may wrap or count turns

  const char* fault() const {
    return std::isfinite(yaw_rad) ? nullptr : "value that is not finite";
  }
};

/// Where a satellite receiver says that its antenna is, WGS84.
struct GnssSample {
  std::int64_t t_ns = 0;      ///< stamp in the clock of the receiver
  double latitude_deg = 0.;   ///< north positive
  double longitude_deg = 0.;  ///< east positive
  double altitude_m = 0.;     ///< above the ellipsoid, not above the sea
  /// Row after row, along east, north, up at the antenna. A diagonal that is not positive: unknown.
  std::array<double, 9> covariance_ENU_m2{};

  bool has_covariance() const {
    return covariance_ENU_m2[0] > 0. && covariance_ENU_m2[4] > 0. && covariance_ENU_m2[8] > 0.;
  }
  const char* fault() const {
    if (!std::isfinite(latitude_deg) || !std::isfinite(longitude_deg) ||
        !std::isfinite(altitude_m) || !all_finite(covariance_ENU_m2)) {
      return "value that is not finite";
    }
    return std::abs(latitude_deg) > 90. ? "latitude beyond 90 degrees" : nullptr;
  }
};

/// The whole inertial state from a reference system: true pose of I in G, velocity and biases.
struct StateSample {
  std::int64_t t_ns = 0;                              ///< stamp in the IMU clock
  std::array<double, 4> q_ItoG_xyzw{0., 0., 0., 1.};  ///< Hamilton quaternion, unit norm
  std::array<double, 3> p_IinG_m{};
  std::array<double, 3> v_IinG_m_per_s{};
  std::array<double, 3> gyro_bias_rad_per_s{};
  std::array<double, 3> accel_bias_m_per_s2{};

  const char* fault() const {
    const bool is_finite = all_finite(q_ItoG_xyzw) && all_finite(p_IinG_m) &&
                           all_finite(v_IinG_m_per_s) && all_finite(gyro_bias_rad_per_s) &&
                           all_finite(accel_bias_m_per_s2);
    return is_finite ? nullptr : "value that is not finite";
  }
};

/// True value of one calibration parameter, from a simulator. Names are those of the estimate:
/// "r_1", "p_IinO_x", "t_OtoI", ... (docs/conventions.md).
struct CalibrationSample {
  std::int64_t t_ns = 0;
  std::string name;
  double value = 0.;
};

/// Pixels, 8 bit grey, row after row without padding.
struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> pixels;  ///< width_px * height_px
};

/// Where the pixels of one image come from: a file, a message, a renderer. Images are read when
/// they are needed, so that a whole recording of them fits into memory.
class VIWO_API ImageSource {
 public:
  virtual ~ImageSource();
  /// The pixels, into storage that may be used again; the same bits at every call, which may run
  /// concurrently. Throws InputError when there is no such image or it is broken.
  virtual void read(Image& out) const = 0;
  /// The same of an image of this size. Of another one there are its size and no pixels in `out`:
  /// who knows it before the pixels does not decode them, however many they are.
  virtual void read_of_size(int width_px, int height_px, Image& out) const;
};

/// Images of several cameras whose stamps differ by no more are of one instant.
inline constexpr std::int64_t kSameInstantNs = 3'000'000;

/// One image of a camera.
struct ImageSample {
  std::int64_t t_ns = 0;  ///< stamp in the clock of the camera
  int camera = 0;         ///< index in the configuration's list of cameras
  std::shared_ptr<const ImageSource> source;
};

}  // namespace viwo

VIWO_SAMPLE(viwo::EncoderSample, "encoders", 1, &viwo::EncoderSample::t_ns,
            &viwo::EncoderSample::begin_ns, &viwo::EncoderSample::end_ns,
            &viwo::EncoderSample::n_drive, &viwo::EncoderSample::n_steer,
            &viwo::EncoderSample::drive_rad_per_s, &viwo::EncoderSample::steer_rad);
VIWO_SAMPLE(viwo::ImuSample, "imu", 1, &viwo::ImuSample::t_ns, &viwo::ImuSample::gyro_rad_per_s,
            &viwo::ImuSample::accel_m_per_s2);
VIWO_SAMPLE(viwo::FeatureSample, "tracks", 1, &viwo::FeatureSample::t_ns,
            &viwo::FeatureSample::camera, &viwo::FeatureSample::points);
VIWO_SAMPLE(viwo::PoseSample, "poses", 1, &viwo::PoseSample::t_ns, &viwo::PoseSample::p_BinW_m,
            &viwo::PoseSample::q_BtoW_xyzw);
VIWO_SAMPLE(viwo::HeadingSample, "headings", 1, &viwo::HeadingSample::t_ns,
            &viwo::HeadingSample::yaw_rad);
VIWO_SAMPLE(viwo::GnssSample, "gnss fixes", 1, &viwo::GnssSample::t_ns,
            &viwo::GnssSample::latitude_deg, &viwo::GnssSample::longitude_deg,
            &viwo::GnssSample::altitude_m, &viwo::GnssSample::covariance_ENU_m2);
VIWO_SAMPLE(viwo::StateSample, "reference states", 1, &viwo::StateSample::t_ns,
            &viwo::StateSample::q_ItoG_xyzw, &viwo::StateSample::p_IinG_m,
            &viwo::StateSample::v_IinG_m_per_s, &viwo::StateSample::gyro_bias_rad_per_s,
            &viwo::StateSample::accel_bias_m_per_s2);
VIWO_SAMPLE(viwo::CalibrationSample, "true calibration", 1, &viwo::CalibrationSample::t_ns,
            &viwo::CalibrationSample::name, &viwo::CalibrationSample::value);
VIWO_SAMPLE(viwo::ImageSample, "images", 1, &viwo::ImageSample::t_ns, &viwo::ImageSample::camera,
            &viwo::ImageSample::source);
