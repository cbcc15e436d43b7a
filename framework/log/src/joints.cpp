#include "viwo/log/joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/log/stamp_filter.hpp"

namespace viwo::log {
namespace {

constexpr double kTurn = 2. * std::numbers::pi;

/// A joint that is followed through its turns is where its rate has taken it up to this part of a
/// turn: another turn would be three times as far off.
constexpr double kMostOff = 0.25;
/// No spacing is longer than so many usual ones, and while no rate is known.
constexpr double kLongest = 3.5, kLongestFirst = 2.;

constexpr const char* kScaledTooFar =
    "reading that is not finite any more where it is scaled (drive_scale, steer_scale)";
constexpr const char* kTurnsUnknown =
    "reading that leaves open how many turns a joint has gone (drive_turn, steer_turn)";
constexpr const char* kTurnsLost =
    "reading of a steering whose turns have been lost count of (steer_turn)";
constexpr const char* kSteeringUnknown =
    "reading that leaves open how fast wheels were steered (drive_per_steer)";

/// No drive turns so fast: at the rim of a wheel of 5 cm it is 500 m/s, and motors before their
/// gears reach some thousand rad/s. A reading beyond is none, whatever became of its bytes.
constexpr double kFastest_rad_per_s = 1e4;
/// Stamps may bunch: angles are not taken to be nearer to each other than this.
constexpr double kLeastSpacing_s = 1e-3;
constexpr const char* kTooFast = "drive faster than 1e4 rad/s";

/// Nor is a wheel steered so far, however often it has turned; what is left of an angle by 1e18 is
/// no angle.
constexpr double kFarthest_rad = 1e6;
constexpr const char* kSteersTooFar = "steering beyond 1e6 rad";

bool is_steered_too_far(double steer_rad) { return std::abs(steer_rad) > kFarthest_rad; }

std::string channels_text(int n, const std::string& kind) {
  return std::to_string(n) + " " + kind + (n == 1 ? " channel" : " channels") + " of the log";
}

/// ParamError unless there is one finite number for each of the channels, or none at all.
void check(const char* key, const std::vector<double>& values, int n, const std::string& kind) {
  if (values.empty()) return;
  if (values.size() != static_cast<std::size_t>(n)) {
    throw ParamError(key, "has " + std::to_string(values.size()) +
                              (values.size() == 1 ? " number for " : " numbers for ") +
                              channels_text(n, kind) + ": one for each, in their order");
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    throw ParamError(key, "number " + std::to_string(i + 1) + " is not finite");
  }
}

void check_scale(const char* key, const std::vector<double>& values, int n,
                 const std::string& kind) {
  check(key, values, n, kind);
  const auto zero = std::find(values.begin(), values.end(), 0.);
  if (zero == values.end()) return;
  throw ParamError(key, "number " + std::to_string(zero - values.begin() + 1) +
                            " is 0: nothing of the reading would be left");
}

/// The channels of the model from 0 (-1: none) for those of the log.
std::vector<int> channels_from(const char* key, const std::vector<double>& values, int n,
                               const std::string& kind) {
  check(key, values, n, kind);
  std::vector<int> out;
  for (int i = 0; i < n; ++i) {
    const double number = values.empty() ? i + 1 : values[static_cast<std::size_t>(i)];
    if (!(number >= 0. && number <= n && number == std::floor(number))) {
      throw ParamError(key, "number " + std::to_string(i + 1) + " must be a channel from 1 to " +
                                std::to_string(n) + ", or 0");
    }
    out.push_back(static_cast<int>(number) - 1);
  }
  return out;
}

/// How many channels of the log there are in each of the model; ParamError for one without any.
std::vector<double> members_of(const char* key, const std::vector<int>& channels) {
  const int last = channels.empty() ? -1 : *std::max_element(channels.begin(), channels.end());
  std::vector<double> members(static_cast<std::size_t>(last + 1), 0.);
  for (const int channel : channels) {
    if (channel >= 0) ++members[static_cast<std::size_t>(channel)];
  }
  const auto empty = std::find(members.begin(), members.end(), 0.);
  if (empty == members.end()) return members;
  throw ParamError(key, "names channel " + std::to_string(members.size()) +
                            ", and none is channel " + std::to_string(empty - members.begin() + 1));
}

/// Readings that come round with the joint say where it is however often it has turned.
bool is_whole_turn(double rad) { return std::abs(std::remainder(rad, kTurn)) < 1e-3; }

double at(const std::vector<double>& values, std::size_t i, double fallback) {
  return values.empty() ? fallback : values[i];
}

}  // namespace

void JointParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(drive_scale),
    {.help =
         "what each drive reading is multiplied by to be rad/s (or rad) of its wheel, forward "
         "positive: -1 for a reversed joint, 0.148148 for a gear of 6.75, 0.0174533 for degrees, "
         "0.00153398 for 4096 counts a turn. Like all lists here: one number for each channel "
         "of the log, in its order; [] leaves everything as it is"});
  b(VIWO_PARAM(drive_turn),
    {.min = 0.,
     .help = "angles: after how much a drive reading begins anew (360, 4096, 6.2831853): before "
             "drive_scale, behind drive_unit where the sensor has that; 0: never"});
  b(VIWO_PARAM(drive_channel),
    {.min = 0.,
     .max = kMaxDrives,
     .help = "which drive of the kinematic model each channel of the log is, from 1: [2, 1] for "
             "two that are exchanged, [1, 2, 1, 2] for sides that are means of two wheels; 0 "
             "leaves a channel out"});
  b(VIWO_PARAM(steer_scale),
    {.help = "what each steering reading is multiplied by to be rad of its wheel, "
             "counter-clockwise positive"});
  b(VIWO_PARAM(steer_shift_rad),
    {.unit = "rad", .help = "what is added then, anywhere on the circle"});
  b(VIWO_PARAM(steer_turn),
    {.min = 0.,
     .help = "after how much a steering reading begins anew where that is no whole turn of the "
             "wheel (an encoder before a gear), before steer_scale; 0: whole turns, or never"});
  b(VIWO_PARAM(steer_channel),
    {.min = 0.,
     .max = kMaxSteers,
     .help = "which steering angle of the kinematic model each channel of the log is, from 1; 0 "
             "leaves one out"});
  b(VIWO_PARAM(drive_per_steer),
    {.help = "one number for each wheel of the kinematic model: by how many rad its drive turns, "
             "rolling nowhere, when the wheel is steered by 1 rad; this is taken off"});
}

TurnCounter::Result TurnCounter::add(std::int64_t t_ns, double reading, double turn,
                                     double max_gap_s) {
  const double dt_s = last_ns_ ? seconds_between(*last_ns_, t_ns) : max_gap_s;
  const bool is_gap = !last_ns_ || dt_s > max_gap_s;
  last_ns_ = t_ns;
  // Where several readings are missing, nobody knows what the joint did.
  const double longest = during_s_ > 0. ? kLongest : kLongestFirst;
  const bool is_late = spacing_s_ > 0. && dt_s > longest * spacing_s_;
  if (!is_gap) spacing_s_ += (spacing_s_ > 0. ? 0.05 : 1.) * (dt_s - spacing_s_);
  if (is_gap || !has_started_) {
    has_started_ = true;
    total_ = reading_ = reading;
    turns_ = rate_ = moved_ = during_s_ = 0.;
    return Result::kStarted;
  }
  const double expected = during_s_ > 0. ? moved_ / during_s_ * dt_s : 0.;
  const double read = reading - reading_;
  const double off = std::remainder(read - expected, turn);
  if (is_late || !(std::abs(off) <= kMostOff * turn)) {
    restart();
    return Result::kUnknown;
  }
  turns_ += std::round((expected + off - read) / turn);
  const double before = total_;
  reading_ = reading;
  total_ = reading + turns_ * turn;
  rate_ = (total_ - before) / dt_s;
  // Stamps may bunch: what is expected is the rate of a few steps.
  constexpr double kKept = 0.75;
  moved_ = kKept * moved_ + (total_ - before);
  during_s_ = kKept * during_s_ + dt_s;
  return Result::kCounted;
}

JointMap::JointMap(const JointParams& params, int n_drive, int n_steer, bool drive_is_angle,
                   double max_gap_s)
    : drive_is_angle_(drive_is_angle),
      max_gap_s_(max_gap_s),
      drive_per_steer_(params.drive_per_steer) {
  check_scale("drive_scale", params.drive_scale, n_drive, "drive");
  check("drive_turn", params.drive_turn, n_drive, "drive");
  check_scale("steer_scale", params.steer_scale, n_steer, "steering");
  check("steer_shift_rad", params.steer_shift_rad, n_steer, "steering");
  check("steer_turn", params.steer_turn, n_steer, "steering");
  const auto drives = channels_from("drive_channel", params.drive_channel, n_drive, "drive");
  drive_members_ = members_of("drive_channel", drives);
  if (n_drive > 0 && drive_members_.empty()) {
    throw ParamError("drive_channel", "leaves all drives out");
  }
  const auto steers = channels_from("steer_channel", params.steer_channel, n_steer, "steering");
  steer_members_ = members_of("steer_channel", steers);
  for (std::size_t i = 0; i < steer_members_.size(); ++i) {
    if (steer_members_[i] < 2.) continue;
    throw ParamError("steer_channel", "names channel " + std::to_string(i + 1) +
                                          " twice: there is no mean of steering angles");
  }
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const double turn = at(params.drive_turn, i, 0.);
    if (turn > 0. && !drive_is_angle) {
      throw ParamError("drive_turn", "rates never begin anew: this is for drives that are angles");
    }
    drives_.push_back({.scale = at(params.drive_scale, i, 1.),
                       .turn = turn,
                       .channel = drives[i],
                       .is_counted = turn > 0.});
  }
  for (std::size_t i = 0; i < steers.size(); ++i) {
    const double scale = at(params.steer_scale, i, 1.), turn = at(params.steer_turn, i, 0.);
    const bool is_counted = turn > 0. && !is_whole_turn(scale * turn);
    steers_.push_back({.scale = scale,
                       .offset = at(params.steer_shift_rad, i, 0.),
                       .turn = turn,
                       .channel = steers[i],
                       .is_counted = is_counted,
                       .is_absolute = is_counted});
  }
  const std::size_t n_wheels = drive_members_.size();
  if (!drive_per_steer_.empty() &&
      (drive_per_steer_.size() != n_wheels || steer_members_.size() != n_wheels)) {
    throw ParamError("drive_per_steer", "has " + std::to_string(drive_per_steer_.size()) +
                                            " numbers for wheels with " + std::to_string(n_wheels) +
                                            " drives and " + std::to_string(steer_members_.size()) +
                                            " steering angles: one of each for every wheel");
  }
  check("drive_per_steer", drive_per_steer_, static_cast<int>(drive_per_steer_.size()), "");
  is_identity_ = true;
  for (const auto* list : {&params.drive_scale, &params.drive_turn, &params.drive_channel,
                           &params.steer_scale, &params.steer_shift_rad, &params.steer_turn,
                           &params.steer_channel, &params.drive_per_steer}) {
    is_identity_ = is_identity_ && list->empty();
  }
}

void JointMap::restart() {
  for (auto* joints : {&drives_, &steers_}) {
    for (Joint& joint : *joints) joint.turns.restart();
  }
  for (TurnCounter& steering : steering_) steering.restart();
  before_.reset();
}

const char* JointMap::convert(EncoderReading& reading) {
  if (!is_identity_) {
    if (const char* const why = to_model(reading)) return why;
  }
  if (std::any_of(reading.steer_rad.begin(), reading.steer_rad.end(), is_steered_too_far)) {
    return kSteersTooFar;
  }
  return check_rates(reading);
}

const char* JointMap::to_model(EncoderReading& reading) {
  // All of them: who has been followed so far is not lost for what is wrong with another one.
  const char* const drive =
      to_rad(drives_, drive_members_, reading.t_ns, reading.drive, reading.is_start);
  const char* const steer =
      to_rad(steers_, steer_members_, reading.t_ns, reading.steer_rad, reading.is_start);
  if (drive != nullptr) return drive;
  if (steer != nullptr) return steer;
  reading.n_drive = static_cast<int>(drive_members_.size());
  reading.n_steer = static_cast<int>(steer_members_.size());
  if (const char* const why = take_off_steering(reading)) return why;
  return all_finite(reading.drive) && all_finite(reading.steer_rad) ? nullptr : kScaledTooFar;
}

template <std::size_t kSize>
const char* JointMap::to_rad(std::vector<Joint>& joints, const std::vector<double>& members,
                             std::int64_t t_ns, std::array<double, kSize>& values,
                             bool& is_start) const {
  const char* why = nullptr;
  std::array<double, kSize> out{};
  for (std::size_t i = 0; i < joints.size(); ++i) {
    Joint& joint = joints[i];
    if (joint.channel < 0) continue;
    if (joint.is_counted) {
      if (const char* const found = count(joint, t_ns, values[i], is_start)) why = found;
    }
    out[static_cast<std::size_t>(joint.channel)] +=
        joint.scale * values[i] + joint.offset;  // (J-1)
  }
  for (std::size_t c = 0; c < members.size(); ++c) out[c] /= members[c];  // (J-3)
  values = out;
  return why;
}

/// The reading with its turns.
const char* JointMap::count(Joint& joint, std::int64_t t_ns, double& value, bool& is_start) const {
  switch (joint.turns.add(t_ns, value, joint.turn, max_gap_s_)) {
    case TurnCounter::Result::kUnknown:
      return kTurnsUnknown;
    case TurnCounter::Result::kStarted:
      is_start = true;
      if (joint.is_absolute && joint.has_started) {
        joint.turns.restart();
        return kTurnsLost;
      }
      joint.has_started = true;
      break;
    case TurnCounter::Result::kCounted:
      break;
  }
  value = joint.turns.total();
  return nullptr;
}

const char* JointMap::take_off_steering(EncoderReading& reading) {
  const char* why = nullptr;
  for (std::size_t j = 0; j < drive_per_steer_.size(); ++j) {
    TurnCounter& steering = steering_[j];
    const auto result = steering.add(reading.t_ns, reading.steer_rad[j], kTurn, max_gap_s_);
    if (result == TurnCounter::Result::kUnknown) why = kSteeringUnknown;
    if (result == TurnCounter::Result::kStarted) {
      reading.is_start = true;
      if (!drive_is_angle_) why = kSteeringUnknown;
    }
    reading.drive[j] -=
        drive_per_steer_[j] * (drive_is_angle_ ? steering.total() : steering.rate());  // (J-4)
  }
  return why;
}

/// Of angles that jump nobody knows which are right: where they go on they start anew.
const char* JointMap::check_rates(EncoderReading& reading) {
  std::array<double, kMaxDrives> moved = reading.drive;
  double during_s = 1.;
  if (drive_is_angle_) {
    reading.is_start = std::exchange(was_too_fast_, false) || reading.is_start;
    const auto before = std::exchange(before_, reading);
    if (!before || reading.is_start) return nullptr;
    const double dt_s = seconds_between(before->t_ns, reading.t_ns);
    if (dt_s > max_gap_s_) return nullptr;
    during_s = std::max(dt_s, kLeastSpacing_s);
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] -= before->drive[i];
  }
  for (const double way : moved) {
    if (std::abs(way) <= kFastest_rad_per_s * during_s) continue;
    was_too_fast_ = true;
    return kTooFast;
  }
  return nullptr;
}

void mount_joints(const JointParams& params, std::vector<EncoderSample>& samples,
                  std::vector<RejectionCount>& rejections) {
  if (samples.empty()) return;
  JointMap map(params, samples.front().n_drive, samples.front().n_steer, false,
               std::numeric_limits<double>::infinity());
  Rejections counts;
  std::erase_if(samples, [&](EncoderSample& sample) {
    EncoderReading reading{sample.t_ns, sample.n_drive, sample.n_steer, sample.drive_rad_per_s,
                           sample.steer_rad};
    if (const char* const why = map.convert(reading)) {
      counts.add(why, sample.t_ns);
      return true;
    }
    sample.n_drive = reading.n_drive;
    sample.n_steer = reading.n_steer;
    sample.drive_rad_per_s = reading.drive;
    sample.steer_rad = reading.steer_rad;
    return false;
  });
  counts.append_to(rejections);
}

}  // namespace viwo::log
