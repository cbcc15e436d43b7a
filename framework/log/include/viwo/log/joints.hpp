// Joints as they are mounted: what a log says of its channels, in its units, becomes what the
// channels of the kinematic model read (docs/conventions.md, J-1 .. J-4).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/log/cells.hpp"

namespace viwo::log {

/// Lists of one number per channel; an empty one leaves everything as it is.
struct JointParams {
  std::vector<double> drive_scale;
  std::vector<double> drive_turn;
  std::vector<double> drive_channel;
  std::vector<double> steer_scale;
  std::vector<double> steer_shift_rad;
  std::vector<double> steer_turn;
  std::vector<double> steer_channel;
  std::vector<double> drive_per_steer;

  void bind(ParamBinder& b);
  const JointParams& joints() const { return *this; }
};

/// Counts the turns of an angle whose reading begins anew after each of them.
class TurnCounter {
 public:
  enum class Result : std::uint8_t {
    kStarted,  ///< the first reading, or the first behind a gap: in the turn that it says
    kCounted,
    kUnknown,  ///< it may as well have gone another turn; the next reading starts
  };

  /// `t_ns` increases; `turn` is in the unit of the readings.
  Result add(std::int64_t t_ns, double reading, double turn, double max_gap_s);  // (J-2)
  void restart() { has_started_ = false; }

  /// The last reading with its turns; how fast it has got there from the one before, per second.
  double total() const { return total_; }
  double rate() const { return rate_; }

 private:
  std::optional<std::int64_t> last_ns_;
  double spacing_s_ = 0.;  ///< mean; whatever is known of the turns
  bool has_started_ = false;
  double reading_ = 0., turns_ = 0., total_ = 0., rate_ = 0.;
  double moved_ = 0., during_s_ = 0.;  ///< of the last steps, fading
};

/// From readings of a log to readings of the model: angles in rad, rates in rad/s.
class JointMap {
 public:
  /// A log with so many channels. Over a spacing longer than `max_gap_s` no turns are counted.
  /// ParamError for a list of another length, and for numbers that cannot be.
  JointMap(const JointParams& params, int n_drive, int n_steer, bool drive_is_angle,
           double max_gap_s);

  /// Makes a reading of the log, whose values are finite and whose stamp is after those before, one
  /// of the model. nullptr, or why it cannot be used: also where a drive turns faster, or a wheel
  /// is steered further, than any is. Allocates nothing.
  const char* convert(EncoderReading& reading);
  /// Forgets what came before, as behind a gap.
  void restart();

 private:
  struct Joint {
    double scale = 1., offset = 0., turn = 0.;
    int channel = 0;           ///< of the model; -1: none
    bool is_counted = false;   ///< by `turns`
    bool is_absolute = false;  ///< its angle is wrong when a turn is missed
    bool has_started = false;
    TurnCounter turns = {};
  };
  template <std::size_t kSize>
  const char* to_rad(std::vector<Joint>& joints, const std::vector<double>& members,
                     std::int64_t t_ns, std::array<double, kSize>& values, bool& is_start) const;
  const char* count(Joint& joint, std::int64_t t_ns, double& value, bool& is_start) const;
  const char* to_model(EncoderReading& reading);
  const char* take_off_steering(EncoderReading& reading);
  const char* check_rates(EncoderReading& reading);

  bool is_identity_, drive_is_angle_;
  double max_gap_s_;
  std::vector<Joint> drives_, steers_;                 ///< of the log
  std::vector<double> drive_members_, steer_members_;  ///< channels of the log in each of the model
  std::vector<double> drive_per_steer_;
  std::array<TurnCounter, kMaxSteers> steering_;  ///< of the model, for drive_per_steer
  std::optional<EncoderReading> before_;          ///< angles, whether or not they could be used
  bool was_too_fast_ = false;                     ///< from those before to them
};

/// Samples of rates that become what a log has whose joints are mounted so: the way out of a
/// simulator, in which joints may be wrong. What is left out is counted.
void mount_joints(const JointParams& params, std::vector<EncoderSample>& samples,
                  std::vector<RejectionCount>& rejections);

}  // namespace viwo::log
