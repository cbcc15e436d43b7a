#include "pose_orientation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "viwo/math/significant.hpp"
#include "viwo/series/lag.hpp"

namespace viwo::inspect {

using Eigen::Vector3d;
using series::RateGrid;
using series::Turn;

namespace {

/// Turns about the vertical if the poses are read otherwise, and how.
struct Reading {
  std::vector<Turn> turns;
  std::string what;
};

/// w, x, y, z that were read as x, y, z, w.
Trajectory with_w_first(Trajectory poses) {
  for (StampedPose& pose : poses) {
    const Eigen::Quaterniond q = pose.q_BtoW;
    pose.q_BtoW = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  }
  return poses;
}

/// The other way round: x, y, z, w that were read as w, x, y, z.
Trajectory with_w_last(Trajectory poses) {
  for (StampedPose& pose : poses) {
    const Eigen::Quaterniond q = pose.q_BtoW;
    pose.q_BtoW = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
  }
  return poses;
}

std::string axis_text(const char* axis) {
  return std::string("they turn about ") + axis +
         " of their world, which then points up: turn the poses so that z does";
}

}  // namespace

std::vector<Turn> turns_about(const Trajectory& poses, const Vector3d& axis) {
  std::vector<Turn> turns = series::turns_of(poses);
  std::size_t k = 0;
  for (Turn& turn : turns) {
    while (k + 1 < poses.size() && poses[k].t_ns < turn.begin_ns) ++k;
    turn.rate = Vector3d(0., 0., axis.dot(poses[k].q_BtoW * turn.rate));
  }
  return turns;
}

bool has_other_orientation(const Trajectory& poses, const std::string& label,
                           const std::vector<Turn>& turns, const std::string& other,
                           Findings& out) {
  if (poses.empty() || turns.empty()) return false;
  if (!are_turned(poses)) {
    constexpr double kTurns_rad_per_s = 0.1;
    const bool turns_there = std::any_of(turns.begin(), turns.end(), [](const Turn& turn) {
      return std::abs(turn.rate.z()) > kTurns_rad_per_s;
    });
    if (!turns_there) return false;
    out.push_back({label,
                   Severity::kNote,
                   "orientation",
                   "its orientation never changes while " + other +
                       " turns: it gives positions alone, and errors of the orientation against "
                       "it mean nothing",
                   {}});
    return true;
  }
  const RateGrid expected(poses.front().t_ns, poses.back().t_ns, turns);
  const auto likeness = [&](const std::vector<Turn>& of_poses) {
    const auto lag = find_lag(expected, RateGrid(poses.front().t_ns, poses.back().t_ns, of_poses));
    return lag ? lag->correlation : 0.;
  };
  // Even those that are turned the other way are read in the right order.
  constexpr double kUnlike = 0.5, kAlike = 0.9;
  if (std::abs(likeness(turns_about(poses))) > kUnlike) return false;
  const std::array<Reading, 4> readings = {
      Reading{turns_about(with_w_first(poses)),
              "with their quaternions read as w, x, y, z: the columns are in another order than "
              "the format says, which is x, y, z, w"},
      Reading{turns_about(with_w_last(poses)),
              "with their quaternions read as x, y, z, w: the columns are in another order than "
              "the format says, which is w, x, y, z"},
      Reading{turns_about(poses, Vector3d::UnitY()), axis_text("y")},
      Reading{turns_about(poses, -Vector3d::UnitY()), axis_text("-y")}};
  const Reading* best = nullptr;
  double most = kAlike;
  for (const Reading& reading : readings) {
    if (const double like = likeness(reading.turns); like > most) {
      most = like;
      best = &reading;
    }
  }
  if (best == nullptr) return false;
  out.push_back({label,
                 Severity::kFault,
                 "orientation",
                 "its orientations are those of " + other + " (correlation " +
                     significant(most, 3) + ") " + best->what,
                 {{"correlation", most, ""}}});
  return true;
}

}  // namespace viwo::inspect
