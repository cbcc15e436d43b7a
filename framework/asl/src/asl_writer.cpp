#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "viwo/api/status.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/files/delayed_signals.hpp"
#include "viwo/files/files.hpp"
#include "viwo/files/text_writer.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

namespace fs = std::filesystem;

/// Index into kFolders.
enum Table : std::size_t { kWheels, kImu, kFeatures, kTruth, kCalibration, kPoses, kGnss, kTables };
constexpr std::array<const char*, kTables> kFolders = {
    "wheels0", "imu0", "features0", "state_groundtruth_estimate0", "calibration_groundtruth0",
    "poses0",  "gnss0"};

constexpr const char* kData = "data.csv";
constexpr const char* kImages = "data";
constexpr const char* kImuHeader =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
constexpr const char* kTruthHeader =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
    "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";

constexpr const char* kPosesHeader =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z []\n";

constexpr const char* kGnssHeader =
    "timestamp_ns,latitude [deg],longitude [deg],altitude [m],cov_EE [m^2],cov_EN [m^2],"
    "cov_EU [m^2],cov_NE [m^2],cov_NN [m^2],cov_NU [m^2],cov_UE [m^2],cov_UN [m^2],cov_UU [m^2]\n";

/// Velocity and biases of a pose: a reader of states must not take them for zero.
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

/// Says that the folder was written here.
constexpr const char* kMark = "viwo_log.txt";
/// Where a log is written until it is whole.
constexpr const char* kPart = "part";

[[noreturn]] void refuse(const fs::path& folder, const fs::path& stranger) {
  throw InputError(folder.string() + "  already holds " + stranger.string() +
                   ", which is no part of a log written here: choose an empty folder");
}

/// "cam0"
std::string camera_folder(std::size_t camera) { return "cam" + std::to_string(camera); }

bool is_camera_folder(const fs::path& name) {
  for (std::size_t camera = 0; camera <= kMaxCamera; ++camera) {
    if (name == camera_folder(camera)) return true;
  }
  return false;
}

/// Calls `work` with the name of each folder that a log may have.
template <class Work>
void for_each_folder(Work&& work) {
  for (const char* const table : kFolders) work(table);
  for (std::size_t camera = 0; camera <= kMaxCamera; ++camera) work(camera_folder(camera));
}

/// Folder `data` of images in the folder of a camera.
void check_images_are_ours(const fs::path& folder, const fs::path& data) {
  for (const auto& file : fs::directory_iterator(folder / data)) {
    if (file.path().extension() != ".png" || file.is_directory()) {
      refuse(folder, data / file.path().filename());
    }
  }
}

/// Everything in `folder` must come from an earlier log, and that from here: a recording of
/// somebody has the same names.
void check_is_ours(const fs::path& folder, bool is_marked) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if (name == kMark && entry.is_regular_file()) continue;
    if (!is_marked) refuse(folder, name);
    if (name == kPart && entry.is_directory()) {
      check_is_ours(entry.path(), is_marked);
      continue;
    }
    const bool is_camera = is_camera_folder(name);
    const bool is_table = std::find(kFolders.begin(), kFolders.end(), name) != kFolders.end();
    if (!(is_camera || is_table) || !entry.is_directory()) refuse(folder, name);
    for (const auto& file : fs::directory_iterator(entry.path())) {
      if (is_camera && file.path().filename() == kImages && file.is_directory()) {
        check_images_are_ours(folder, name / kImages);
        continue;
      }
      // Of a command that was killed there may be one that is not whole.
      const bool is_ours =
          file.path().filename() == kData || file.path().filename() == std::string(kData) + ".tmp";
      if (!is_ours || file.is_directory()) {
        refuse(folder, name / file.path().filename());
      }
    }
  }
}

template <std::size_t N>
void append(files::TextWriter& out, const std::array<double, N>& values) {
  for (const double value : values) out << "," << value;
}

bool fits_a_field(const std::string& name) {
  return !name.empty() && trim(name) == name && name.find_first_of(",\r\n") == std::string::npos;
}

}  // namespace

struct AslWriter::Tables {
  fs::path folder;  ///< of the log that is not whole yet
  std::array<std::optional<files::TextWriter>, kTables> writers;
  int n_drive = 0;
  int n_steer = 0;
  bool has_poses = false;
  bool has_states = false;

  files::TextWriter& open(Table table, std::string_view header);
  /// Of the truth, which is written for poses and for states.
  files::TextWriter& truth_row(std::int64_t t_ns, const std::array<double, 3>& p,
                               const std::array<double, 4>& q_xyzw);

  void write(const EncoderSample& sample);
  void write(const PoseSample& pose);
  void write_measured(const PoseSample& pose);
  void write(const ImuSample& imu);
  void write(const FeatureSample& image);
  void write(const GnssSample& fix);
  void write(const StateSample& state);
  void write(const CalibrationSample& parameter);
  void write(const ImageSample& image);
  /// False when the measurement is of none of the kinds.
  template <class... Samples>
  bool write_one_of(const Measurement& measurement) {
    return visit_one_of<Samples...>(measurement,
                                    [this](const auto& sample) { this->write(sample); });
  }

  std::vector<std::optional<files::TextWriter>> image_tables;  ///< by camera
  Image pixels;
};

files::TextWriter& AslWriter::Tables::open(Table table, std::string_view header) {
  auto& writer = writers[table];
  if (!writer) {
    files::make_folder(folder / kFolders[table]);
    writer.emplace(folder / kFolders[table] / kData);
    *writer << header;
  }
  return *writer;
}

void AslWriter::Tables::write(const EncoderSample& sample) {
  if (!writers[kWheels]) {
    n_drive = sample.n_drive;
    n_steer = sample.n_steer;
    files::TextWriter& header = open(kWheels, "timestamp_ns");
    for (int i = 1; i <= n_drive; ++i) header << ",drive_" << std::int64_t{i} << " [rad/s]";
    for (int i = 1; i <= n_steer; ++i) header << ",steer_" << std::int64_t{i} << " [rad]";
    header << "\n";
  }
  if (sample.n_drive != n_drive || sample.n_steer != n_steer) {
    throw std::logic_error("encoder samples of one log differ in their number of channels");
  }
  files::TextWriter& out = *writers[kWheels];
  out << sample.t_ns;
  for (int i = 0; i < n_drive; ++i) {
    out << "," << sample.drive_rad_per_s[static_cast<std::size_t>(i)];
  }
  for (int i = 0; i < n_steer; ++i) {
    out << "," << sample.steer_rad[static_cast<std::size_t>(i)];
  }
  out << "\n";
}

files::TextWriter& AslWriter::Tables::truth_row(std::int64_t t_ns, const std::array<double, 3>& p,
                                                const std::array<double, 4>& q_xyzw) {
  if (has_poses && has_states) {
    throw InputError(
        "reference poses and reference states share a table of a log: keep the sensors of one "
        "kind only");
  }
  files::TextWriter& out = open(kTruth, kTruthHeader);
  out << t_ns;
  append(out, p);
  out << "," << q_xyzw[3] << "," << q_xyzw[0] << "," << q_xyzw[1] << "," << q_xyzw[2];
  return out;
}

void AslWriter::Tables::write(const PoseSample& pose) {
  has_poses = true;
  files::TextWriter& out = truth_row(pose.t_ns, pose.p_BinW_m, pose.q_BtoW_xyzw);
  for (int i = 0; i < 9; ++i) out << "," << kNotKnown;
  out << "\n";
}

void AslWriter::Tables::write_measured(const PoseSample& pose) {
  const auto& q = pose.q_BtoW_xyzw;
  files::TextWriter& out = open(kPoses, kPosesHeader);
  out << pose.t_ns;
  append(out, pose.p_BinW_m);
  out << "," << q[3] << "," << q[0] << "," << q[1] << "," << q[2] << "\n";
}

void AslWriter::Tables::write(const StateSample& state) {
  has_states = true;
  files::TextWriter& out = truth_row(state.t_ns, state.p_IinG_m, state.q_ItoG_xyzw);
  append(out, state.v_IinG_m_per_s);
  append(out, state.gyro_bias_rad_per_s);
  append(out, state.accel_bias_m_per_s2);
  out << "\n";
}

void AslWriter::Tables::write(const GnssSample& fix) {
  files::TextWriter& out = open(kGnss, kGnssHeader);
  out << fix.t_ns << "," << fix.latitude_deg << "," << fix.longitude_deg << "," << fix.altitude_m;
  append(out, fix.covariance_ENU_m2);
  out << "\n";
}

void AslWriter::Tables::write(const ImuSample& imu) {
  files::TextWriter& out = open(kImu, kImuHeader);
  out << imu.t_ns;
  append(out, imu.gyro_rad_per_s);
  append(out, imu.accel_m_per_s2);
  out << "\n";
}

void AslWriter::Tables::write(const FeatureSample& image) {
  files::TextWriter& out = open(kFeatures, "timestamp_ns,camera,id,u [px],v [px]\n");
  const std::int64_t camera = image.camera;
  if (image.points.empty()) out << image.t_ns << "," << camera << ",,,\n";
  for (const FeaturePoint& point : image.points) {
    out << image.t_ns << "," << camera << "," << point.id << "," << point.u_px << "," << point.v_px
        << "\n";
  }
}

void AslWriter::Tables::write(const CalibrationSample& parameter) {
  if (!fits_a_field(parameter.name)) {
    throw std::logic_error("the name of a calibration parameter does not fit into a table: " +
                           log::quoted(parameter.name));
  }
  files::TextWriter& out = open(kCalibration, "timestamp_ns,name,value\n");
  out << parameter.t_ns << "," << parameter.name << "," << parameter.value << "\n";
}

void AslWriter::Tables::write(const ImageSample& image) {
  const auto camera = static_cast<std::size_t>(image.camera);
  const fs::path place = folder / camera_folder(camera);
  if (image_tables.size() <= camera) image_tables.resize(camera + 1);
  auto& table = image_tables[camera];
  if (!table) {
    files::make_folder(place / kImages);
    table.emplace(place / kData);
    *table << "#timestamp [ns],filename\n";
  }
  const std::string name = std::to_string(image.t_ns) + ".png";
  image.source->read(pixels);
  const std::vector<std::uint8_t> png = encode_png(pixels);
  files::FileWriter file(place / kImages / name, files::Appears::kAtOnce);
  file.write({reinterpret_cast<const char*>(png.data()), png.size()});
  file.commit();
  *table << image.t_ns << "," << name << "\n";
}

AslWriter::AslWriter(const fs::path& folder)
    : tables_(std::make_unique<Tables>()), folder_(folder) {
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw InputError(folder.string() + "  is a file, not a folder");
  }
  files::make_folder(folder);
  check_is_ours(folder, fs::exists(folder / kMark));
  files::write_text(folder / kMark,
                    "A log of viwo. The next one that is written to this folder replaces it.\n");
  tables_->folder = folder / kPart;
  fs::remove_all(tables_->folder);
  files::make_folder(tables_->folder);
}

AslWriter::~AslWriter() {
  if (state_ == State::kWhole) return;
  tables_.reset();
  try {
    fs::remove_all(folder_ / kPart);
    if (state_ == State::kReplacing) remove_tables();
    const fs::directory_iterator left(folder_);
    if (std::distance(begin(left), end(left)) == 1) fs::remove(folder_ / kMark);
  } catch (...) {
    // Why it is not closed is known; what stays has no table, or not all of them.
  }
}

void AslWriter::remove_tables() const {
  for_each_folder([&](const fs::path& ours) { fs::remove_all(folder_ / ours); });
}

bool AslWriter::write(const Measurement& measurement) {
  return tables_->write_one_of<ImuSample, EncoderSample, FeatureSample, ImageSample, PoseSample,
                               GnssSample, StateSample, CalibrationSample>(measurement);
}

void AslWriter::write_measured(const PoseSample& pose) { tables_->write_measured(pose); }

void AslWriter::close() {
  for (auto& writer : tables_->writers) {
    if (writer) writer->close();
  }
  for (auto& table : tables_->image_tables) {
    if (table) table->close();
  }
  const fs::path part = tables_->folder;
  const files::DelayedSignals until_it_is_there;
  // A table that the new log does not have must not stay behind.
  state_ = State::kReplacing;
  remove_tables();
  for_each_folder([&](const fs::path& ours) {
    if (fs::exists(part / ours)) fs::rename(part / ours, folder_ / ours);
  });
  fs::remove(part);
  state_ = State::kWhole;
}

}  // namespace viwo::log
