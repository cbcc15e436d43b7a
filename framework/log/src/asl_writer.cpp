#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "viwo/api/status.hpp"
#include "viwo/log/asl.hpp"
#include "viwo/log/text_writer.hpp"

namespace viwo::log {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWheels = "wheels0";
constexpr const char* kTruth = "state_groundtruth_estimate0";
constexpr const char* kData = "data.csv";
constexpr const char* kTruthHeader =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
    "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
constexpr const char* kUnknown = ",0,0,0,0,0,0,0,0,0\n";  // velocity and biases

[[noreturn]] void refuse(const fs::path& folder, const fs::path& stranger) {
  throw InputError(folder.string() + "  already holds " + stranger.string() +
                   ", which is no part of a log written here: choose an empty folder");
}

/// Everything in `folder` must come from an earlier log.
void check_is_ours(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if ((name != kWheels && name != kTruth) || !entry.is_directory()) refuse(folder, name);
    for (const auto& file : fs::directory_iterator(entry.path())) {
      if (file.path().filename() != kData || file.is_directory()) {
        refuse(folder, name / file.path().filename());
      }
    }
  }
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw std::runtime_error("cannot create the folder " + folder.string() + ": " +
                             error.message());
  }
}

TextWriter open_table(const fs::path& folder, const char* table) {
  make_folder(folder / table);
  return TextWriter(folder / table / kData);
}

}  // namespace

struct AslWriter::Tables {
  fs::path folder;
  std::optional<TextWriter> wheels;
  std::optional<TextWriter> truth;
  int n_drive = 0;
  int n_steer = 0;

  void write(const EncoderSample& sample);
  void write(const PoseSample& pose);
  template <class Other>
  void write(const Other&) {
    throw std::logic_error("this kind of measurement has no table yet");
  }
};

void AslWriter::Tables::write(const EncoderSample& sample) {
  if (!wheels) {
    wheels.emplace(open_table(folder, kWheels));
    n_drive = sample.n_drive;
    n_steer = sample.n_steer;
    *wheels << "timestamp_ns";
    for (int i = 1; i <= n_drive; ++i) *wheels << ",drive_" << std::int64_t{i} << " [rad/s]";
    for (int i = 1; i <= n_steer; ++i) *wheels << ",steer_" << std::int64_t{i} << " [rad]";
    *wheels << "\n";
  }
  if (sample.n_drive != n_drive || sample.n_steer != n_steer) {
    throw std::logic_error("encoder samples of one log differ in their number of channels");
  }
  *wheels << sample.t_ns;
  for (int i = 0; i < n_drive; ++i) {
    *wheels << "," << sample.drive_rad_per_s[static_cast<std::size_t>(i)];
  }
  for (int i = 0; i < n_steer; ++i) {
    *wheels << "," << sample.steer_rad[static_cast<std::size_t>(i)];
  }
  *wheels << "\n";
}

void AslWriter::Tables::write(const PoseSample& pose) {
  if (!truth) {
    truth.emplace(open_table(folder, kTruth));
    *truth << kTruthHeader;
  }
  *truth << pose.t_ns;
  for (const double value : pose.p_BinW_m) *truth << "," << value;
  const auto& q = pose.q_BtoW_xyzw;
  *truth << "," << q[3] << "," << q[0] << "," << q[1] << "," << q[2] << kUnknown;
}

AslWriter::AslWriter(const fs::path& folder) : tables_(std::make_unique<Tables>()) {
  tables_->folder = folder;
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw InputError(folder.string() + "  is a file, not a folder");
  }
  make_folder(folder);
  check_is_ours(folder);
  // A table that the new log does not have must not stay behind.
  fs::remove_all(folder / kWheels);
  fs::remove_all(folder / kTruth);
}

AslWriter::~AslWriter() = default;

void AslWriter::write(const Measurement& measurement) {
  std::visit([this](const auto& sample) { tables_->write(sample); }, measurement);
}

void AslWriter::close() {
  if (tables_->wheels) tables_->wheels->close();
  if (tables_->truth) tables_->truth->close();
}

}  // namespace viwo::log
