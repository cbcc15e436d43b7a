#include "mcap_output.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "ros2_definitions.hpp"
#include "ros2_messages.hpp"

namespace viwo::live {
namespace {

/// The path so far may be long: it is written once in ten poses of it, which is 5 s.
constexpr int kPathPoses = 10;
/// Of diagnostics that say nothing new, as others publish them.
constexpr double kDiagnosticsPeriod_s = 1.;
/// Of each axis of the angular rate, as of live topics unless a configuration says otherwise.
constexpr double kSigmaRate_rad_per_s = 0.01;

/// Not that of recordings that are made with viwo_bag.
constexpr const char* kLibrary = "viwo run";

/// Throws where a file is there that no run has written: a recording, or a configuration.
std::string that_may_be_written(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return file.string();  // open() says why not
  const bag::Bytes expected = bag::mcap::Writer::head(kLibrary);
  bag::Bytes begin(expected.size());
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(begin.data()), static_cast<std::streamsize>(begin.size()));
  if (!in.is_open() || in.bad() || (in.gcount() > 0 && begin != expected)) {
    throw std::runtime_error(file.string() +
                             "  is there already and was not written by --mcap (of this version): "
                             "choose another name, or remove it");
  }
  return file.string();
}

}  // namespace

McapOutput::McapOutput(const std::filesystem::path& file)
    : out_(that_may_be_written(file), bag::mcap::Compression::kZstd, bag::mcap::Writer::kChunkBytes,
           kLibrary) {}

void McapOutput::put(const std::string& topic, const std::string& type, const bag::Bytes& message) {
  auto known = channels_.find(topic);
  if (known == channels_.end()) {
    known =
        channels_.emplace(topic, out_.add_channel(topic, type, bag::ros2_definition(type))).first;
  }
  out_.write(known->second, t_ns_, t_ns_, message);
}

void McapOutput::write(const EstimateSample& estimate, std::span<const log::SeenImage> images) {
  t_ns_ = estimate.t_ns;
  const Odometry odometry = odometry_of(estimate, {}, kSigmaRate_rad_per_s);
  put("/viwo/odometry", "nav_msgs/msg/Odometry", ros2::odometry_message(odometry));
  put("/tf", "tf2_msgs/msg/TFMessage", ros2::tf_message(odometry));
  put("/viwo/calibration", "sensor_msgs/msg/JointState", ros2::calibration_message(estimate));
  for (const log::SeenImage& image : images) {
    put("/viwo/cam" + std::to_string(image.camera) + "/tracks",
        "foxglove_msgs/msg/ImageAnnotations", ros2::tracks_message(image));
  }
  if (path_.add(odometry.pose, estimate.piece) && path_taken_++ % kPathPoses == 0) put_path();
  Health health;
  health.rejected = -1;
  put_diagnostics(diagnostics_of(estimate, health), false);
}

void McapOutput::put_path() {
  put("/viwo/path", "nav_msgs/msg/Path", ros2::path_message(path_, OutputFrames().world));
}

void McapOutput::put_diagnostics(Diagnostics diagnostics, bool always) {
  diagnostics_ = std::move(diagnostics);
  const double t_s = 1e-9 * static_cast<double>(t_ns_);
  if (!always && diagnostics_.message == diagnosed_ &&
      std::abs(t_s - diagnosed_s_) < kDiagnosticsPeriod_s) {
    return;
  }
  diagnosed_s_ = t_s;
  diagnosed_ = diagnostics_.message;
  put("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray",
      ros2::diagnostics_message(diagnostics_));
}

void McapOutput::close(const std::string& failure, const std::vector<std::string>& warnings) {
  if (!path_.poses().empty()) put_path();
  Diagnostics last = diagnostics_;
  last.t_ns = t_ns_;
  last.fails = !failure.empty();
  if (last.fails) last.message = failure;
  for (const std::string& warning : warnings) {
    last.message = last.warns || last.fails ? last.message + "; " + warning : warning;
    last.warns = true;
  }
  put_diagnostics(std::move(last), true);
  out_.close();
}

}  // namespace viwo::live
