// viwo_bag: a log folder as a bag of ROS 1 or ROS 2.
// Exit codes: 0 done; 1 writing failed; 2 the input is wrong.
#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "bag_writer.hpp"
#ifdef VIWO_HAS_ROS1
#include "ros1_writer.hpp"
#endif
#ifdef VIWO_HAS_ROS2
#include "ros2_writer.hpp"
#endif
#include "viwo/api/status.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_columns.hpp"
#include "viwo/asl/asl_images.hpp"
#include "viwo/files/delayed_signals.hpp"
#include "viwo/files/files.hpp"
#include "viwo/files/printable_output.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "viwo_bag LOG_FOLDER OUT.bag|OUT.mcap|OUT\n\n"
    "Writes a log folder, as `viwo simulate` makes it, as a bag:\n"
    "  OUT.bag    of ROS 1\n"
    "  OUT.mcap   of ROS 2, one file\n"
    "  OUT        of ROS 2, a folder with metadata.yaml and OUT_0.mcap\n"
    "What of the folder becomes which messages (in ROS 2 their types have /msg/ in them):\n"
    "  imu0                         /imu0             sensor_msgs/Imu\n"
    "  wheels0                      /joint_states     sensor_msgs/JointState, joints drive_1 ..\n"
    "                                                 (velocity) and steer_1 .. (position); NaN "
    "for\n"
    "                                                 their positions and velocities\n"
    "  cam0, cam1, ..               /camN/image_raw   sensor_msgs/Image, mono8\n"
    "  poses0                       /poses0           geometry_msgs/PoseStamped\n"
    "  gnss0                        /fix              sensor_msgs/NavSatFix\n"
    "  state_groundtruth_estimate0  /ground_truth     geometry_msgs/PoseStamped\n"
    "What the folder does not have is left out. Stamps of recording are those of the headers.\n";

struct ImageOnDisk {
  std::int64_t t_ns = 0;
  std::size_t camera = 0;
  fs::path file;
};

struct Log {
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> wheels;
  std::vector<PoseSample> poses;
  std::vector<GnssSample> fixes;
  std::vector<PoseSample> truth;
  std::vector<ImageOnDisk> images;
};

/// What is dropped is said.
template <class Sample>
std::vector<Sample> samples_of(const log::Recording<Sample>& recording, const fs::path& table) {
  for (const RejectionCount& rejection : recording.rejections) {
    std::cerr << table.string() << "  dropped: " << rejection.reason << " (" << rejection.count
              << ", first at " << rejection.first << ")\n";
  }
  return recording.samples;
}

void read_images(const fs::path& folder, std::size_t camera, std::vector<ImageOnDisk>& out) {
  log::TableReader table(folder / "data.csv");
  const std::size_t stamp = log::stamp_column(table);
  const std::size_t name = table.column("filename");
  while (table.next()) {
    out.push_back({table.stamp_ns(stamp), camera, folder / "data" / log::image_name(table, name)});
  }
  if (table.cut_short()) {
    std::cerr << folder.string() << "  dropped: " << log::kLastLineCutShort << "\n";
  }
}

Log read_log(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) throw InputError(folder.string() + "  is no folder");
  const auto has = [&](const fs::path& part) { return fs::exists(folder / part, ignored); };
  // Gaps are nothing that a bag could not hold.
  const LogLimits limits{std::numeric_limits<double>::infinity(), 0.1};
  Log log;
  if (has("imu0")) {
    log.imu = samples_of(log::read_asl_imu(folder / "imu0", limits), folder / "imu0");
  }
  if (has("wheels0")) {
    const auto wheels = log::read_asl_encoders(folder / "wheels0", {limits, false, 1});
    log.wheels = samples_of(wheels, folder / "wheels0");
  }
  if (has("poses0")) {
    log.poses = samples_of(log::read_asl_poses(folder / "poses0", limits), folder / "poses0");
  }
  if (has("gnss0")) {
    log.fixes = samples_of(log::read_asl_gnss(folder / "gnss0", limits.max_rejected_fraction),
                           folder / "gnss0");
  }
  const fs::path truth = folder / "state_groundtruth_estimate0";
  if (fs::exists(truth, ignored)) log.truth = samples_of(log::read_asl_poses(truth, limits), truth);
  for (std::size_t camera = 0; camera <= log::kMaxCamera; ++camera) {
    const std::string name = "cam" + std::to_string(camera);
    if (has(name)) read_images(folder / name, camera, log.images);
  }
  if (log.imu.empty() && log.wheels.empty() && log.poses.empty() && log.truth.empty() &&
      log.images.empty() && log.fixes.empty()) {
    throw InputError(folder.string() +
                     "  is no log folder: it has none of imu0, wheels0, cam0, poses0, "
                     "gnss0, state_groundtruth_estimate0");
  }
  return log;
}

/// A message that is to be written: the `index`-th of its kind.
struct Entry {
  enum Kind : std::uint8_t { kImu, kWheels, kPose, kTruth, kImage, kFix };
  std::int64_t t_ns = 0;
  Kind kind = kImu;
  std::size_t index = 0;
};

/// All messages in time order.
std::vector<Entry> schedule(const Log& log) {
  std::vector<Entry> entries;
  const auto add = [&entries](const auto& samples, Entry::Kind kind) {
    for (std::size_t i = 0; i < samples.size(); ++i) entries.push_back({samples[i].t_ns, kind, i});
  };
  add(log.imu, Entry::kImu);
  add(log.wheels, Entry::kWheels);
  add(log.poses, Entry::kPose);
  add(log.truth, Entry::kTruth);
  add(log.images, Entry::kImage);
  add(log.fixes, Entry::kFix);
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.t_ns < b.t_ns; });
  return entries;
}

void write_wheels(const EncoderSample& sample, const bag::Stamps& stamps, bag::BagWriter& out) {
  // A reader that asks for what the log does not have shall not take it for a wheel that stands.
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> names;
  std::vector<double> positions, velocities;
  for (int i = 0; i < sample.n_drive; ++i) {
    names.push_back("drive_" + std::to_string(i + 1));
    positions.push_back(kUnknown);
    velocities.push_back(sample.drive_rad_per_s[static_cast<std::size_t>(i)]);
  }
  for (int i = 0; i < sample.n_steer; ++i) {
    names.push_back("steer_" + std::to_string(i + 1));
    positions.push_back(sample.steer_rad[static_cast<std::size_t>(i)]);
    velocities.push_back(kUnknown);
  }
  out.write_joints("/joint_states", stamps, names, positions, velocities);
}

void write_image(const ImageOnDisk& image, const bag::Stamps& stamps, bag::BagWriter& out) {
  Image pixels;
  read_image(image.file, pixels);
  const auto width_px = static_cast<std::uint32_t>(pixels.width_px);
  out.write_image("/cam" + std::to_string(image.camera) + "/image_raw", stamps,
                  {width_px, static_cast<std::uint32_t>(pixels.height_px), "mono8", false, width_px,
                   std::move(pixels.pixels)});
}

void write_fix(const GnssSample& fix, const bag::Stamps& stamps, bag::BagWriter& out) {
  constexpr int kUnknown = 0, kKnown = 3;
  out.write_fix("/fix", stamps,
                {0, fix.latitude_deg, fix.longitude_deg, fix.altitude_m, fix.covariance_ENU_m2,
                 fix.has_covariance() ? kKnown : kUnknown});
}

void write(const Log& log, const Entry& entry, bag::BagWriter& out) {
  const bag::Stamps stamps{entry.t_ns, entry.t_ns};
  switch (entry.kind) {
    case Entry::kImu: {
      const ImuSample& imu = log.imu[entry.index];
      return out.write_imu("/imu0", stamps, imu.gyro_rad_per_s, imu.accel_m_per_s2);
    }
    case Entry::kWheels:
      return write_wheels(log.wheels[entry.index], stamps, out);
    case Entry::kPose: {
      const PoseSample& pose = log.poses[entry.index];
      return out.write_pose("/poses0", stamps, pose.p_BinW_m, pose.q_BtoW_xyzw);
    }
    case Entry::kTruth: {
      const PoseSample& pose = log.truth[entry.index];
      return out.write_pose("/ground_truth", stamps, pose.p_BinW_m, pose.q_BtoW_xyzw);
    }
    case Entry::kImage:
      return write_image(log.images[entry.index], stamps, out);
    case Entry::kFix:
      return write_fix(log.fixes[entry.index], stamps, out);
  }
}

enum class Format : std::uint8_t { kRos1, kMcap, kMcapFolder };

/// By what it is to be called; what is no file, such as a device, takes a ROS 1 bag.
Format format_of(const fs::path& out) {
  std::error_code ignored;
  const std::string suffix = out.extension().string();
  if (suffix == ".mcap") return Format::kMcap;
  if (suffix == ".bag" || fs::is_other(out, ignored)) return Format::kRos1;
  if (suffix.empty()) return Format::kMcapFolder;
  throw InputError(out.string() + "  ends with '" + suffix +
                   "': .bag makes a ROS 1 bag, .mcap a file and a name without an end the folder "
                   "of a ROS 2 bag");
}

constexpr const char* kNotOwn = "  exists and is no bag that viwo_bag has written";

/// A file that is no bag is not replaced. True where there is one.
bool check_file(const fs::path& file, std::string_view magic) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) throw InputError(file.string() + "  is a folder");
  if (!fs::is_regular_file(file, ignored) || fs::file_size(file, ignored) == 0) return false;
  std::string begin(magic.size(), '\0');
  std::ifstream(file, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin != magic) throw InputError(file.string() + "  exists and is no bag");
  return true;
}

/// By the header: its lengths, profile and library.
bool is_own_mcap(const fs::path& file) {
  constexpr std::string_view kHeader("\x04\0\0\0ros2\x04\0\0\0viwo", 16);
  std::string begin(64, '\0');
  std::ifstream(file, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin.find(kHeader) != std::string::npos;
}

std::string file_of_folder(const fs::path& out) { return out.filename().string() + "_0.mcap"; }

/// Nor a folder that this program has not written: a recording may be the only one.
void check_folder(const fs::path& out) {
  std::error_code ignored;
  if (!fs::exists(out, ignored)) return;
  bool is_own = fs::is_directory(out, ignored) && !fs::is_symlink(out, ignored);
  if (is_own) {
    for (const auto& entry : fs::directory_iterator(out)) {
      const std::string name = entry.path().filename().string();
      is_own = is_own && (name == "metadata.yaml" || name == file_of_folder(out));
    }
  }
  if (is_own && is_own_mcap(out / file_of_folder(out))) return;
  throw InputError(out.string() + kNotOwn);
}

void check_output(const fs::path& out, Format format) {
  if (format == Format::kMcapFolder) return check_folder(out);
  const bool is_there = check_file(out, format == Format::kRos1 ? "#ROSBAG V" : "\x89MCAP");
  if (is_there && format == Format::kMcap && !is_own_mcap(out)) {
    throw InputError(out.string() + kNotOwn);
  }
}

/// `file` is for ROS 2 a file in any case.
std::unique_ptr<bag::BagWriter> open_bag(const fs::path& file, Format format) {
#ifdef VIWO_HAS_ROS1
  if (format == Format::kRos1) return std::make_unique<bag::Ros1Writer>(file.string());
#endif
#ifdef VIWO_HAS_ROS2
  if (format != Format::kRos1) return std::make_unique<bag::Ros2Writer>(file.string());
#endif
  throw InputError(file.string() + "  cannot be written: this viwo_bag was built without ROS " +
                   (format == Format::kRos1 ? "1" : "2"));
}

void write_messages(const Log& log, const std::vector<Entry>& entries, bag::BagWriter& out) {
  for (const Entry& entry : entries) write(log, entry, out);
  out.close();
}

/// Writes a bag beside `file`, which it replaces when it is complete. What is no regular file is
/// written as it is.
void write_file(const Log& log, const std::vector<Entry>& entries, const fs::path& file,
                Format format) {
  std::error_code ignored;
  const bool in_place = fs::exists(file, ignored) && !fs::is_regular_file(file, ignored);
  // A link stays one.
  const fs::path whole = fs::is_symlink(file, ignored) ? fs::weakly_canonical(file) : file;
  const fs::path part = in_place ? file : fs::path(whole.string() + ".part");
  if (!in_place) check_output(part, format);
  try {
    write_messages(log, entries, *open_bag(part, format));
    if (!in_place) {
      files::sync_to_disk(part);  // rosbag does not
      fs::rename(part, whole);
      files::sync_to_disk(whole.parent_path());
    }
  } catch (...) {
    if (!in_place) fs::remove(part, ignored);  // half a bag is of no use
    throw;
  }
}

/// The same for a folder.
void write_folder([[maybe_unused]] const Log& log,
                  [[maybe_unused]] const std::vector<Entry>& entries, const fs::path& out) {
  const fs::path part = out.string() + ".part", before = out.string() + ".before";
#ifdef VIWO_HAS_ROS2
  if (fs::exists(before)) throw InputError(before.string() + "  exists");
  if (!fs::create_directory(part)) throw InputError(part.string() + "  exists");
  bool is_moved = false;
  try {
    bag::Ros2Writer writer((part / file_of_folder(out)).string());
    write_messages(log, entries, writer);
    writer.write_metadata();  // both are on the disk
    const files::DelayedSignals until_it_is_there;
    if (fs::exists(out)) {
      fs::rename(out, before);
      is_moved = true;
    }
    fs::rename(part, out);
    files::sync_to_disk(out.parent_path());
    if (is_moved) fs::remove_all(before);
  } catch (...) {
    std::error_code ignored;
    if (is_moved && fs::exists(out, ignored)) {
      fs::remove_all(before, ignored);
    } else if (is_moved) {
      fs::rename(before, out, ignored);
    }
    fs::remove_all(part, ignored);
    throw;
  }
#else
  open_bag(out, Format::kMcapFolder);
#endif
}

void convert(const fs::path& folder, const fs::path& out) {
  const Format format = format_of(out);
  const Log log = read_log(folder);
  const std::vector<Entry> entries = schedule(log);
  if (entries.front().t_ns < 0) {
    throw InputError(folder.string() + "  has stamps before 0, which a bag cannot hold");
  }
  check_output(out, format);
  if (format == Format::kMcapFolder) {
    write_folder(log, entries, out);
  } else {
    write_file(log, entries, out, format);
  }
  std::cout << out.string() << ": " << entries.size() << " messages (" << log.imu.size() << " IMU, "
            << log.wheels.size() << " wheels, " << log.images.size() << " images, "
            << log.poses.size() + log.truth.size() << " poses, " << log.fixes.size() << " fixes)\n";
}

int dispatch(const std::vector<std::string>& words) {
  if (words.size() == 1 && (words[0] == "--help" || words[0] == "-h")) {
    std::cout << kHelp;
    return 0;
  }
  if (words.size() != 2 || words[0].starts_with("-") || words[1].starts_with("-")) {
    std::cerr << kHelp;
    return 2;
  }
  const fs::path bag = words[1];
  convert(words[0], bag.has_filename() ? bag : bag.parent_path());  // "folder/"
  return 0;
}

}  // namespace
}  // namespace viwo

int main(int argc, char** argv) {
  // A pipe that nobody reads and a limit of the size of files are errors of writing.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  const viwo::files::PrintableOutput out(std::cout), err(std::cerr);
  try {
    const int code = viwo::dispatch({argv + 1, argv + argc});
    viwo::files::flush_output("viwo_bag");
    return code;
  } catch (const viwo::InputError& error) {
    std::cerr << error.what() << "\n";
    return 2;
  } catch (const std::bad_alloc&) {
    std::cerr << "viwo_bag: there is not enough memory\n";
    return 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
