// Files that are read whole, and messages: everything but the recordings of sensor_targets.cpp.
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <zlib.h>

#include "frame_tree.hpp"
#include "plugin_digest.hpp"
#include "plugin_file.hpp"
#include "run_journal.hpp"
#include "target.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/math/utf8.hpp"
#include "viwo/plan/plan.hpp"
#include "viwo/plugin_host/build_record_check.hpp"
#include "viwo/results/run_record.hpp"
#include "viwo/setup/run_setup.hpp"
#ifdef VIWO_FUZZ_ROS1
#include "ros1_fields.hpp"
#endif
#ifdef VIWO_FUZZ_ROS2
#include "ros2_fields.hpp"
#endif
#if defined(VIWO_FUZZ_ROS1) || defined(VIWO_FUZZ_ROS2)
#include "bag_image.hpp"
#include "messages.hpp"
#endif

namespace viwo::fuzz {
namespace {

namespace fs = std::filesystem;

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void tum(Bytes bytes) {
  const Trajectory read = log::read_tum(write("in.tum", bytes));
  log::write_tum(folder() / "out.tum", read);
  const Trajectory again = log::read_tum(folder() / "out.tum");
  require(again.size() == read.size(), "poses are lost when they are written");
}

void kalibr_cameras(Bytes bytes) { log::read_kalibr_cameras(write("kalibr.yaml", bytes)); }
void kalibr_imu(Bytes bytes) { log::read_kalibr_imu(write("kalibr.yaml", bytes)); }

void image(Bytes bytes) {
  Image image;
  decode_image(bytes, "image", image);
  const auto size =
      static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
  require(image.pixels.size() == size, "an image whose pixels are not those of its size");
}

void yaml(Bytes bytes) {
  const std::string text(text_of(bytes));
  const config::Node node = config::parse(text, "text.yaml");
  if (valid_utf8(text) != text) return;  // what is none is written as U+FFFD
  require(config::parse(config::to_yaml(node), "again.yaml") == node,
          "YAML that reads back otherwise than it was written");
}

/// A run that has been read is written so that it reads back.
void run_configuration(Bytes bytes) {
  const fs::path file = write("run.yaml", bytes);
  const RunSetup setup = read_run(configuration("run.yaml"), registry());
  const std::string resolved = config::to_yaml(setup.resolved);
  try {
    read_run(config::parse(resolved, file.string()), registry());
  } catch (const InputError& error) {
    require(false, std::string("the resolved configuration is refused: ") + error.what());
  }
}

void experiment_file(Bytes bytes) {
  experiment::read_experiment(write("experiment.yaml", bytes), {});
}

/// Its recordings are read, too.
void calibrate(Bytes bytes) {
  calibration::read_calibration_setup(write("calibrate.yaml", bytes), {}, registry());
}

void plan_file(Bytes bytes) { plan::read_plan_setup(write("plan.yaml", bytes), {}, registry()); }

void calibration_file(Bytes bytes) {
  const CalibrationFile read = read_calibration(write("in_calibration.yaml", bytes));
  const std::string text = calibration_text(read, "viwo");
  const CalibrationFile again = read_calibration(write("out_calibration.yaml", bytes_of(text)));
  require(calibration_text(again, "viwo") == text, "a calibration that reads back otherwise");
}

/// The bytes are the record of a run, in CBOR; what stands around them, and the check sum, is as it
/// must be: neither is a secret.
void journal(Bytes bytes) {
  const experiment::RunJournal journal(folder());
  const experiment::RunKey key{"variant", "recording", 1, "configuration"};
  std::string text =
      "\xa5\x6d"
      "configuration\x6d"
      "configuration\x69recording\x69recording\x63run" +
      std::string(text_of(bytes)) + "\x64seed\x01\x67variant\x67variant";
  const auto crc = static_cast<std::uint32_t>(
      crc32(0, bytes_of(text).data(), static_cast<unsigned int>(text.size())));
  for (int shift = 0; shift < 32; shift += 8) text.push_back(static_cast<char>(crc >> shift));
  write("journal/variant,recording,1.cbor", bytes_of(text));
  const auto run = journal.read(key);
  if (!run) throw InputError("no run of this key");
  journal.write(key, *run);
  const auto again = journal.read(key);
  // As bytes: what is not a number equals nothing, and a text may be no UTF-8.
  const auto bytes_of_run = [](const RunResult& of) {
    return nlohmann::json::to_cbor(to_record(of));
  };
  require(again && bytes_of_run(*again) == bytes_of_run(*run), "a run that reads back otherwise");
}

/// Nothing of it is loaded: what is wrong with it must be seen before.
void plugin(Bytes bytes) {
  const auto file = write("libviwo_sensor_fuzz.so", bytes);
  const std::string library = read_library(file).bytes;
  const std::string record = build_record_in(library, file);
  const auto differences = compare_build_records(api_build_record(), record);
  if (!differences.empty()) require(!explain(differences).empty(), "a refusal without a reason");
  require(plugin_digest(library).size() == digest_in(api_build_record()).size(), "no digest");
}

/// Each way between frames is a pose.
void check(const live::FrameTree& tree) {
  const std::vector<std::string> names = tree.names();
  for (const std::string& a : names) {
    const auto pose = tree.find(a, names.front());
    if (!pose) continue;
    require(std::abs(pose->R_AtoB.determinant() - 1.) < 1e-6, "a rotation that is none");
  }
}

void urdf(Bytes bytes) {
  live::FrameTree tree;
  if (const std::string why = tree.add_urdf(std::string(text_of(bytes))); tree.names().empty()) {
    throw InputError(why.empty() ? "no fixed joints" : why);
  }
  check(tree);
}

#if defined(VIWO_FUZZ_ROS1) || defined(VIWO_FUZZ_ROS2)
/// The first byte says what the message is said to be.
template <class Fields>
void message(Bytes bytes) {
  if (bytes.empty()) return;
  Image pixels;
  try {
    Fields in(bytes.subspan(1));
    constexpr int kTwist = 8, kTransforms = 9;
    const int which = bytes[0] % 10;
    if (which == kTwist) bag::read_twist(in);
    if (which == kTransforms) {
      live::FrameTree tree;
      for (const bag::Transform& transform : bag::read_transforms(in)) tree.add(transform);
      check(tree);
    }
    if (which >= kTwist) return;
    switch (const auto kind = static_cast<bag::Kind>(which); kind) {
      case bag::Kind::kImu:
        bag::read_imu(in);
        break;
      case bag::Kind::kImage:
      case bag::Kind::kCompressedImage:
        bag::read_image(in, kind == bag::Kind::kCompressedImage, "message", pixels);
        break;
      case bag::Kind::kJoints:
        bag::read_joints(in);
        break;
      case bag::Kind::kPose:
      case bag::Kind::kPoseWithCovariance:
      case bag::Kind::kOdometry:
        bag::read_pose(kind, in);
        break;
      case bag::Kind::kNavSatFix:
        bag::read_fix(in);
        break;
    }
  } catch (const bag::BrokenMessage& broken) {
    throw InputError(broken.what());
  }
}
#endif

}  // namespace

std::vector<Target> file_targets() {
  return {
    {"tum", tum, "framework/log/src/tum.cpp framework/log/src/text_reader.cpp"},
        {"kalibr_cameras", kalibr_cameras, "framework/log/src/kalibr.cpp"},
        {"kalibr_imu", kalibr_imu, "framework/log/src/kalibr.cpp"},
        {"image", image, "framework/image/src"},
        {"yaml", yaml, "framework/config/src/yaml_read.cpp framework/config/src/node.cpp"},
        {"run", run_configuration, "framework/setup/src framework/config/src"},
        {"experiment", experiment_file, "framework/experiment/src/experiment.cpp"},
        {"calibrate", calibrate, "framework/calibration/src/calibration_setup.cpp"},
        {"plan", plan_file, "framework/plan/src/plan_setup.cpp"},
        {"calibration", calibration_file, "framework/calibration_file/src"},
        {"journal", journal,
         "framework/experiment/src/run_journal.cpp framework/results/src/run_record.cpp"},
        {"plugin", plugin,
         "framework/plugin_host/src/build_record_check.cpp "
         "framework/plugin_host/src/plugin_digest.cpp framework/plugin_host/src/plugin_file.cpp"},
#if VIWO_HAS_TINYXML2
        {"urdf", urdf, "plugins/shared/live/frame_tree.cpp"},
#endif
#ifdef VIWO_FUZZ_ROS1
        {"ros1_message", message<bag::Ros1Fields>,
         "plugins/shared/bags/messages.cpp "
         "plugins/shared/bags/bag_image.cpp"},
#endif
#ifdef VIWO_FUZZ_ROS2
        {"cdr", message<bag::Ros2Fields>,
         "plugins/shared/bags/messages.cpp "
         "plugins/shared/bags/bag_image.cpp"},
#endif
  };
}

}  // namespace viwo::fuzz
