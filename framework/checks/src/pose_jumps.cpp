#include "pose_jumps.hpp"

#include <algorithm>

#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo::inspect {

using series::Poses;

bool has_jumps(const Poses& poses, const std::string& label, Findings& out) {
  constexpr double kMost_m_per_s = 100., kLeast_m = 0.5;
  double jumps = 0., zeros = 0.;
  for (std::size_t i = 1; i < poses.poses.size(); ++i) {
    const double moved_m = (poses.poses[i].p_BinW - poses.poses[i - 1].p_BinW).norm();
    const double dt_s = seconds_between(poses.poses[i - 1].t_ns, poses.poses[i].t_ns);
    if (moved_m < std::max(kLeast_m, kMost_m_per_s * dt_s)) continue;
    jumps += 1.;
    if (poses.poses[i].p_BinW.norm() == 0.) zeros += 1.;
  }
  const double share = jumps / static_cast<double>(poses.poses.size());
  constexpr double kRare = 1e-3, kOften = 0.3;
  if (jumps < 2. || share < kRare) return false;
  const bool may_be_unit = share > kOften && zeros < 0.1 * jumps;
  out.push_back({label,
                 Severity::kFault,
                 "jumps",
                 "its positions jump " + significant(jumps, 6) + " times faster than " +
                     significant(kMost_m_per_s, 3) + " m/s, " + significant(zeros, 6) +
                     " times to exactly zero: " +
                     (may_be_unit ? "their unit (mm for m?), poses of two bodies, or outliers"
                                  : "outliers, or records without a pose"),
                 {{"jumps", jumps, ""}, {"to zero", zeros, ""}, {"share", share, ""}}});
  return true;
}

bool has_flips(const Poses& poses, const std::string& label, Findings& out) {
  constexpr double kMost_rad_per_s = 30., kLeast_rad = 0.5;
  double flips = 0.;
  std::int64_t first_ns = 0;
  for (std::size_t i = 1; i < poses.poses.size(); ++i) {
    const StampedPose& before = poses.poses[i - 1];
    const StampedPose& pose = poses.poses[i];
    const double turned_rad = before.q_BtoW.angularDistance(pose.q_BtoW);
    const double dt_s = seconds_between(before.t_ns, pose.t_ns);
    if (turned_rad < std::max(kLeast_rad, kMost_rad_per_s * dt_s)) continue;
    if (flips++ == 0.) first_ns = pose.t_ns;
  }
  if (flips < 2.) return false;
  // There and back is one pose that is bad, or a few.
  const bool is_once = flips < 3.;
  out.push_back({label,
                 is_once ? Severity::kNote : Severity::kFault,
                 "jumps",
                 "its orientation flips " + significant(flips, 6) +
                     " times from one pose to the next, the first time at " +
                     time_text(first_ns - poses.poses.front().t_ns) +
                     " of it: markers that are taken for each other, a yaw in degrees, or poses of "
                     "two bodies",
                 {{"flips", flips, ""}}});
  return !is_once;
}

}  // namespace viwo::inspect
