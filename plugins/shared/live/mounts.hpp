// Where the IMU sits on the robot, by what the robot says of itself: on the body whose pose is
// published, on the wheels' frame and on the cameras.
#pragma once

#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "estimate_messages.hpp"
#include "frame_tree.hpp"
#include "live_params.hpp"
#include "messages.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::live {

/// All calls may come from several threads at a time.
class Mounts {
 public:
  Mounts(const LiveParams& params, const HostServices& services);

  /// Whether the robot is asked for any: for /tf_static and its description.
  bool are_asked_for() const { return !wanted_.empty(); }
  bool are_known() const;
  /// Frames of the messages; nothing while nobody has said where the body is.
  std::optional<OutputFrames> frames() const;

  /// What is found with it is said, as it is written into a configuration; what is of no use, too.
  void take(const std::vector<bag::Transform>& transforms);
  void take_description(const std::string& urdf);
  void say_useless(const std::string& why);
  /// The frames that nobody has told of.
  void say_missing() const;

  /// What is wrong by now: no frame for the body, an estimate of a mount that is not where the
  /// robot says (by three sigmas, and more than a description errs). "": nothing. New ones are
  /// said.
  std::string trouble(const EstimateSample& estimate);

 private:
  enum class Of { kBody, kWheels, kCamera };
  struct Wanted {
    Of of = Of::kBody;
    std::string frame;
    int camera = 0;
    std::optional<FramePose> imu_in_it = std::nullopt;
    bool contradicts = false;  ///< and it was said
  };
  static std::vector<Wanted> wanted_by(const LiveParams& params);
  std::string text(const Wanted& wanted) const;
  std::string nothing_says(const Wanted& wanted) const;
  std::string contradiction(const Wanted& wanted, const EstimateSample& estimate) const;
  void find();
  void say_once(LogLevel level, const std::string& text);

  HostServices services_;
  std::string imu_frame_;
  const OutputFrames frames_;  ///< as they are configured
  mutable std::mutex mutex_;
  FrameTree tree_;
  std::vector<Wanted> wanted_;  ///< of the same frames always: are_asked_for() needs no lock
  std::set<std::string> said_;  ///< what is said again is not worth a line
};

}  // namespace viwo::live
