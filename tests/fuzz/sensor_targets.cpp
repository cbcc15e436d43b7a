// Recordings of all formats, read by their sensors as the host makes them.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "target.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::fuzz {
namespace {

struct Reader {
  const char* name;
  const char* file;     ///< that has the bytes
  const char* section;  ///< of the sensor; FILE and FOLDER stand for the file and its folder
  const char* sources;
  std::string (*file_of)(Bytes) = nullptr;  ///< what the bytes become; null: they are the file
};

#ifdef VIWO_FUZZ_ROS2
/// SQLite's sums of a log: over pairs of numbers, from those before.
class LogSums {
 public:
  void add(const std::string& bytes) {
    for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
      first_ += number(bytes, i) + second_;
      second_ += number(bytes, i + 4) + first_;
    }
  }
  std::string text() const { return big_endian(first_) + big_endian(second_); }

  static std::string big_endian(std::uint32_t value) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) text.push_back(static_cast<char>(value >> shift));
    return text;
  }

 private:
  static std::uint32_t number(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      value = value << 8U | static_cast<std::uint8_t>(bytes[at + i]);
    }
    return value;
  }
  std::uint32_t first_ = 0, second_ = 0;
};

/// The log beside a bag whose recorder was killed. Of each page: number, whether a transaction
/// ends, 512 bytes. The sums are as they must be: they are no secret.
std::string sqlite_log(Bytes bytes) {
  constexpr std::size_t kPage = 512;
  const auto u32 = LogSums::big_endian;
  const std::string salt = u32(1) + u32(2);
  std::string log = u32(0x377f0683) + u32(3'007'000) + u32(kPage) + u32(0) + salt;
  LogSums sums;
  sums.add(log);
  log += sums.text();
  while (bytes.size() >= 2) {
    const std::string head = u32(bytes[0]) + u32(bytes[1]);
    const Bytes page = bytes.subspan(2, std::min(kPage, bytes.size() - 2));
    bytes = bytes.subspan(2 + page.size());
    std::string content(page.begin(), page.end());
    content.resize(kPage);
    sums.add(head);
    sums.add(content);
    log += head;
    log += salt + sums.text() + content;
  }
  return log;
}
#endif

// Bad rows are counted, and all that is left is played.
#define ALL "max_rejected_fraction: 1"
#define TABLES "framework/log/src/table_reader.cpp framework/log/src/text_reader.cpp "
#define ASL TABLES "framework/asl/src/asl_reader.cpp plugins/sensors/"
#define TOPICS                                                                       \
  "imu_topic: /imu0, image_topics: [/cam0/image_raw], joint_topic: /joint_states, "  \
  "drive_joints: [drive_1, drive_2], steer_joints: [steer_1], pose_topic: /poses0, " \
  "gnss_topic: /fix, " ALL
#define BAGS "plugins/shared/bags framework/log/src/cells.cpp plugins/sensors/"

constexpr Reader kReaders[] = {
    {"asl_imu", "data.csv", "{type: asl_imu, path: FILE, " ALL "}", ASL "asl_imu"},
    {"asl_encoders", "data.csv", "{type: asl_encoders, path: FILE, " ALL "}", ASL "asl_encoders"},
    {"asl_angles", "data.csv",
     "{type: asl_encoders, path: FILE, drive_input: angle, stride: 2, drive_turn: [6.3, 6.3], "
     "steer_turn: [6.3, 6.3], drive_scale: [-1, 0.15], drive_per_steer: [0.1, 0.1], " ALL "}",
     ASL "asl_encoders framework/log/src/joints.cpp framework/log/src/cells.cpp"},
    {"asl_features", "data.csv", "{type: asl_features, path: FILE, " ALL "}", ASL "asl_features"},
    {"asl_state", "data.csv", "{type: asl_state, path: FILE, " ALL "}", ASL "asl_state"},
    {"asl_pose", "data.csv", "{type: asl_pose, path: FILE, " ALL "}", ASL "asl_pose"},
    {"asl_gnss", "data.csv", "{type: asl_gnss, path: FILE, " ALL "}", ASL "asl_gnss"},
    {"asl_calibration", "data.csv", "{type: asl_calibration, path: FILE, " ALL "}",
     ASL "asl_calibration"},
    {"asl_images", "cam0/data.csv", "{type: asl_images, path: FOLDER/.., " ALL "}",
     TABLES "framework/asl/src/asl_images.cpp plugins/sensors/asl_images"},
    {"gz", "data.csv.gz", "{type: asl_imu, path: FILE, " ALL "}",
     TABLES "framework/log/src/byte_reader.cpp"},
    {"csv_table", "table.csv",
     "{type: csv_table, path: FILE, time_column: t, time_unit: s, drive_columns: [1, b], "
     "steer_columns: [c], "
     "drive_unit: rpm, steer_unit: deg, gyro_columns: [gx, gy, gz], accel_columns: [ax, ay, az], "
     "position_columns: [x, y], yaw_column: yaw, " ALL "}",
     TABLES "plugins/sensors/csv_table"},
    {"csv_table_bare", "table.csv",
     "{type: csv_table, path: FILE, header: false, separator: blank, skip_lines: 1, "
     "decimal_comma: true, time_column: 1, time_unit: us, drive_columns: [2], drive_input: angle, "
     "drive_unit: turn, "
     "position_columns: [3, 4, 5], quaternion_columns: [6, 7, 8, 9], " ALL "}",
     TABLES "plugins/sensors/csv_table"},
    {"vio_csv_imu", "vio/imu.csv",
     "{type: vio_csv, folder: FOLDER, features: false, truth: false, " ALL "}",
     TABLES "plugins/sensors/vio_csv"},
    {"vio_csv_features", "vio/features.csv",
     "{type: vio_csv, folder: FOLDER, imu: false, truth: false, " ALL "}",
     TABLES "plugins/sensors/vio_csv"},
    {"vio_csv_truth", "vio/groundtruth.csv",
     "{type: vio_csv, folder: FOLDER, imu: false, features: false, " ALL "}",
     TABLES "plugins/sensors/vio_csv"},
    {"kaist_imu", "kaist/sensor_data/xsens_imu.csv",
     "{type: kaist_urban, path: FOLDER/.., wheels: false, images: false, reference: false, " ALL
     "}",
     TABLES "plugins/sensors/kaist_urban"},
    {"kaist_wheels", "kaist/sensor_data/encoder.csv",
     "{type: kaist_urban, path: FOLDER/.., imu: false, images: false, reference: false, " ALL "}",
     TABLES "plugins/sensors/kaist_urban"},
    {"kaist_resolution", "kaist/calibration/EncoderParameter.txt",
     "{type: kaist_urban, path: FOLDER/.., imu: false, images: false, reference: false, " ALL "}",
     TABLES "plugins/sensors/kaist_urban"},
    {"kaist_images", "kaist/sensor_data/stereo_stamp.csv",
     "{type: kaist_urban, path: FOLDER/.., imu: false, wheels: false, reference: false, " ALL "}",
     TABLES "plugins/sensors/kaist_urban"},
    {"kaist_poses", "kaist/global_pose.csv",
     "{type: kaist_urban, path: FOLDER, imu: false, wheels: false, images: false, " ALL "}",
     TABLES "plugins/sensors/kaist_urban"},
    {"ros_text_encoders", "joints.csv",
     "{type: ros_text_encoders, path: FILE, drive: [a, b], steer: [c], " ALL "}",
     "framework/log/src/ros_text.cpp plugins/sensors/ros_text_encoders"},
    {"ros_text_velocity", "joints.csv",
     "{type: ros_text_encoders, path: FILE, drive: [a], drive_input: velocity, clock: reception, "
     "reception_utc_offset_h: 2, " ALL "}",
     "framework/log/src/ros_text.cpp plugins/sensors/ros_text_encoders"},
    {"ros_text_pose", "pose.csv", "{type: ros_text_pose, path: FILE, " ALL "}",
     "framework/log/src/ros_text.cpp plugins/sensors/ros_text_pose"},
    {"motion_file", "motion.csv",
     "{type: planar_simulator, robot: {type: four_wis_wid, x_m: [0.1, -0.1], y_m: [0.1, -0.1], "
     "radius_m: 0.05}, motion: file, motion_file: FILE, duration_s: 0.3, rate_hz: 50, "
     "reference_rate_hz: 50}",
     TABLES "framework/sim/src/drive_params.cpp framework/sim/src/quintic_spline.cpp"},
    {"video_stamps", "video/stamps.csv",
     "{type: video, path: FOLDER, videos: [cam0.avi], stamps: [stamps.csv], " ALL "}",
     TABLES "plugins/sensors/video/video.cpp"},
    {"wpilog", "log.wpilog",
     "{type: wpilog, path: FILE, module_entries: [/Modules], wheel_radius_m: 0.05, "
     "gyro_entries: [/gx, /gy, /a/0], accel_entries: [/a/0, /a/1, /a/2], "
     "pose_entries: [/Pose], heading_entry: /Yaw, " ALL "}",
     "plugins/sensors/wpilog"},
    {"wpilog_cycles", "log.wpilog",
     "{type: wpilog, path: FILE, drive_entries: [/d1, /d2], steer_entries: [/s1, /s2], "
     "drive_input: angle, drive_unit: turn, cycle_entry: /t, pose_entries: [/a/0, /a/1, /a/2], " ALL
     "}",
     "plugins/sensors/wpilog"},
#ifdef VIWO_FUZZ_ROS1
    {"ros1_bag", "log.bag", "{type: ros1_bag, path: FILE, " TOPICS "}", BAGS "ros1_bag"},
#endif
#ifdef VIWO_FUZZ_ROS2
    {"mcap", "log.mcap", "{type: ros2_bag, path: FILE, " TOPICS "}", BAGS "ros2_bag"},
    {"sqlite_bag", "log.db3", "{type: ros2_bag, path: FILE, imu_topic: /imu0, " ALL "}",
     BAGS "ros2_bag/database.cpp plugins/sensors/ros2_bag/ros2_file.cpp"},
    {"sqlite_log", "killed/bag.db3-wal",
     "{type: ros2_bag, path: FOLDER/bag.db3, imu_topic: /imu0, " ALL "}",
     "plugins/sensors/ros2_bag/database.cpp", sqlite_log},
    {"ros2_metadata", "bag/metadata.yaml",
     "{type: ros2_bag, path: FOLDER, imu_topic: /imu0, " ALL "}",
     "plugins/sensors/ros2_bag/ros2_bag.cpp plugins/sensors/ros2_bag/ros2_file.cpp"},
#endif
};

std::string section_of(const Reader& reader) {
  const std::filesystem::path file = folder() / reader.file;
  std::string text = reader.section;
  const auto replace = [&text](std::string_view name, const std::string& value) {
    const std::size_t at = text.find(name);
    if (at != std::string::npos) text.replace(at, name.size(), value);
  };
  replace("FILE", file.string());
  replace("FOLDER", file.parent_path().string());
  return text;
}

void read_pixels(const ImageSample& sample) {
  require(sample.source != nullptr, "an image without a source");
  try {
    Image image;
    sample.source->read(image);
    const auto size =
        static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
    require(image.pixels.size() == size, "an image whose pixels are not those of its size");
  } catch (const InputError&) {
  }
}

/// All that a sensor gives must be of its kinds, in time order, with values that can be used.
void play(Sensor& sensor) {
  // A frame that is not in a video opens it anew, and a table names thousands.
  constexpr int kMostImages = 64;
  int images = 0;
  const SampleTypes kinds = sensor.yields();
  Measurement measurement;
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  while (sensor.next(measurement) == Status::kOk) {
    const SampleView view = measurement.view();
    require(std::any_of(kinds.begin(), kinds.end(),
                        [&](const SampleType* kind) { return *kind == view.type(); }),
            "a kind of samples that the sensor does not yield");
    require(view.type().fault(view.data()) == nullptr, "a sample that cannot be used");
    require(view.t_ns() >= last_ns, "a stamp before the last");
    last_ns = view.t_ns();
    const auto* image = measurement.get_if<ImageSample>();
    if (image != nullptr && ++images <= kMostImages) read_pixels(*image);
  }
  std::vector<RejectionCount> counts;
  sensor.rejections(counts);
}

}  // namespace

std::vector<Target> sensor_targets() {
  std::vector<Target> all;
  for (const Reader& reader : kReaders) {
    const auto run = [&reader,
                      section = config::parse(section_of(reader), reader.name)](Bytes bytes) {
      const std::string made = reader.file_of != nullptr ? reader.file_of(bytes) : "";
      write(reader.file, reader.file_of != nullptr ? bytes_of(made) : bytes);
      config::Errors errors;
      const auto sensor = registry().make_sensor(section, "sensor", 1, errors);
      errors.throw_if_any();
      play(*sensor.object);
    };
    all.push_back({reader.name, run, reader.sources});
  }
  return all;
}

}  // namespace viwo::fuzz
