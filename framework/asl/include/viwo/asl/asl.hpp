// Log folders in the layout of the EuRoC/ASL datasets, extended by wheels, features, fixes of
// satellite receivers, calibration:
//   imu0/data.csv                          the EuRoC columns
//   wheels0/data.csv                       timestamp_ns, drive_1..N [rad/s], steer_1..M [rad]
//   features0/data.csv                     timestamp_ns, camera, id, u [px], v [px]; a row with
//                                          empty id, u and v is an image (maybe without points)
//   gnss0/data.csv                         timestamp_ns, latitude [deg], longitude [deg],
//                                          altitude [m], cov_EE, cov_EN, .., cov_UU [m^2]
//   state_groundtruth_estimate0/data.csv   the EuRoC columns; nan for what is not known
//   calibration_groundtruth0/data.csv      timestamp_ns, name, value
//   camN/data.csv, camN/data/*.png         timestamp_ns, file name; the images of camera N
// Readers take a table as the file or as the folder of its data.csv, plain or gzipped. The stamp
// column is `timestamp_ns`, `timestamp [ns]` or `timestamp`. InputError for what is wrong with it.
#pragma once

#include <filesystem>
#include <memory>

#include "viwo/api/measurement.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::log {

/// Drive channels are in rad/s, or in rad with drive_is_angle; where the joints have a scale, in
/// any unit. ParamError for joints that the table does not have.
EncoderRecording read_asl_encoders(const std::filesystem::path& path,
                                   const EncoderRecordingOptions& options);

/// Stamps, positions and quaternions of a ground truth table.
PoseRecording read_asl_poses(const std::filesystem::path& path, const LogLimits& limits);

/// All columns of a ground truth table.
StateRecording read_asl_states(const std::filesystem::path& path, const LogLimits& limits);

ImuRecording read_asl_imu(const std::filesystem::path& path, const LogLimits& limits);

/// Gaps are not counted.
GnssRecording read_asl_gnss(const std::filesystem::path& path, double max_rejected_fraction);

/// One sample for each camera and time.
FeatureRecording read_asl_features(const std::filesystem::path& path, const LogLimits& limits);

/// True values of calibration parameters; several may have the same stamp. Gaps are not counted.
CalibrationRecording read_asl_calibration(const std::filesystem::path& path,
                                          double max_rejected_fraction);

/// Highest index of a camera in a log.
inline constexpr int kMaxCamera = 63;

/// The camera's index in a field; InputError when it is none.
int camera_index(const TableReader& table, std::size_t column);

/// Writes measurements into a log folder that the readers above read back to the same bits (but for
/// the cells of encoder samples, which follow from the stamps as make_cells() has it).
class AslWriter {
 public:
  /// Creates the folder. An earlier log in it is replaced once this one is whole, in close();
  /// InputError when it holds anything else.
  explicit AslWriter(const std::filesystem::path& folder);
  ~AslWriter();
  AslWriter(const AslWriter&) = delete;
  AslWriter& operator=(const AslWriter&) = delete;

  /// Appends to the table of its kind. False for a kind that has no table, nothing is written then:
  /// the caller counts it. std::runtime_error when writing fails; std::logic_error when encoder
  /// samples change their number of channels, or for a name that a table cannot hold; InputError
  /// when poses and states, which share a table, are both to be written.
  [[nodiscard]] bool write(const Measurement& measurement);
  /// A pose that is a measurement and no reference: into poses0, which asl_pose reads.
  void write_measured(const PoseSample& pose);
  /// Must be called at the end: the last bytes may fail, too. A log that is not closed is removed:
  /// some of its tables would look like all of it.
  void close();

 private:
  struct Tables;
  enum class State { kWriting, kReplacing, kWhole };

  /// Those of a whole log.
  void remove_tables() const;

  std::unique_ptr<Tables> tables_;
  std::filesystem::path folder_;
  State state_ = State::kWriting;
};

}  // namespace viwo::log
