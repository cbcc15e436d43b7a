#include "viwo/series/rate_grid.hpp"

#include <algorithm>
#include <limits>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/heading_jumps.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/heading_rate.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo::series {
namespace {

std::size_t cells_between(std::int64_t begin_ns, std::int64_t end_ns) {
  constexpr std::int64_t kMostCells = 2'880'000;  // eight hours; each takes tens of bytes
  const std::int64_t cells = (end_ns - begin_ns) / RateGrid::kCellNs;
  return static_cast<std::size_t>(std::clamp<std::int64_t>(cells, 0, kMostCells));
}

}  // namespace

RateGrid::RateGrid(std::int64_t begin_ns, std::int64_t end_ns, std::span<const Turn> turns)
    : begin_ns_(begin_ns), rates_(cells_between(begin_ns, end_ns), Eigen::Vector3d::Zero()) {
  std::vector<std::int64_t> covered(rates_.size());
  // What is longer is a gap: of sensors that are slow by nature, some of their periods.
  constexpr double kLongest_s = 0.2, kPeriods = 2.5;
  const double longest_s = std::max(kLongest_s, kPeriods * period_of(turns));
  for (const Turn& turn : turns) {
    const double length_s = seconds_between(turn.begin_ns, turn.end_ns);
    if (length_s <= 0. || length_s > longest_s) continue;
    const std::int64_t first = std::max<std::int64_t>(0, (turn.begin_ns - begin_ns) / kCellNs);
    for (std::int64_t i = first; begin_ns + i * kCellNs < turn.end_ns; ++i) {
      if (static_cast<std::size_t>(i) >= rates_.size()) break;
      const std::int64_t from = std::max(turn.begin_ns, begin_ns + i * kCellNs);
      const std::int64_t part = std::min(turn.end_ns, begin_ns + (i + 1) * kCellNs) - from;
      if (part <= 0) continue;
      covered[static_cast<std::size_t>(i)] += part;
      rates_[static_cast<std::size_t>(i)] += static_cast<double>(part) * turn.rate;
    }
  }
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    if (10 * covered[i] >= 9 * kCellNs) {
      rates_[i] /= static_cast<double>(covered[i]);
    } else {
      rates_[i].setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
}

double period_of(std::span<const Turn> turns) {
  std::vector<double> periods_s;
  periods_s.reserve(turns.size());
  for (const Turn& turn : turns) periods_s.push_back(seconds_between(turn.begin_ns, turn.end_ns));
  return periods_s.empty() ? 0. : eval::median(periods_s);
}

std::vector<Turn> turns_of(std::span<const ImuSample> imu) {
  std::vector<Turn> turns;
  turns.reserve(imu.size());
  for (std::size_t i = 1; i < imu.size(); ++i) {
    turns.push_back(
        {imu[i - 1].t_ns, imu[i].t_ns,
         0.5 * (to_vector(imu[i - 1].gyro_rad_per_s) + to_vector(imu[i].gyro_rad_per_s))});
  }
  return turns;
}

std::vector<Turn> turns_of(std::span<const HeadingSample> headings) {
  const std::vector<std::size_t> jumps = heading_jumps(headings);
  std::vector<Turn> turns;
  for (std::size_t i = 1; i < headings.size(); ++i) {
    if (std::binary_search(jumps.begin(), jumps.end(), i)) continue;
    const auto rate = yaw_rate_between(headings[i - 1], headings[i]);
    if (rate) turns.push_back({headings[i - 1].t_ns, headings[i].t_ns, {0., 0., *rate}});
  }
  return turns;
}

std::vector<Turn> turns_of(const Trajectory& poses) {
  std::vector<Turn> turns;
  turns.reserve(poses.size());
  // Stamps of reception come in pairs: what is next to nothing in time is one instant.
  constexpr double kShortest_s = 2e-3;
  std::size_t before = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const double dt_s = seconds_between(poses[before].t_ns, poses[i].t_ns);
    if (dt_s < kShortest_s) continue;
    const Eigen::Quaterniond turn = poses[before].q_BtoW.conjugate() * poses[i].q_BtoW;
    turns.push_back({poses[before].t_ns, poses[i].t_ns, log_so3(turn.toRotationMatrix()) / dt_s});
    before = i;
  }
  return turns;
}

std::vector<Turn> twists_of(const Wheels& wheels) {
  std::vector<Turn> turns;
  turns.reserve(wheels.samples.size());
  TwistSolver solver(wheels.model, {});
  solver.set_intrinsics(wheels.prior.wheels.x_WI);
  TwistSolution solution;
  const auto clock_ns = to_ns(wheels.prior.wheels.t_OtoI_s);
  for (const EncoderSample& sample : wheels.samples) {
    if (solver.solve(sample, solution) != Status::kOk || solution.rank_deficient) continue;
    turns.push_back({sample.begin_ns + clock_ns, sample.end_ns + clock_ns, solution.xi});
  }
  return turns;
}

std::vector<Turn> turns_of(const Wheels& wheels) {
  return about(twists_of(wheels), Eigen::Vector3d::UnitZ());
}

std::vector<Turn> rotated(std::vector<Turn> turns, const Eigen::Matrix3d& R) {
  for (Turn& turn : turns) turn.rate = R * turn.rate;
  return turns;
}

std::vector<Turn> about(std::vector<Turn> turns, const Eigen::Vector3d& axis) {
  for (Turn& turn : turns) turn.rate = axis.dot(turn.rate) * Eigen::Vector3d::UnitZ();
  return turns;
}

std::vector<Turn> shifted(std::vector<Turn> turns, double seconds) {
  const auto shift_ns = to_ns(seconds);
  for (Turn& turn : turns) {
    turn.begin_ns += shift_ns;
    turn.end_ns += shift_ns;
  }
  return turns;
}

std::vector<YawRates> yaw_rates_of(const Recording& recording, const WheelsPrior& prior) {
  std::vector<YawRates> all;
  if (!recording.imu.empty()) {
    const Eigen::Vector3d up = up_of(recording.imu);
    const Eigen::Vector3d axis = up.norm() > 0. ? up : Eigen::Vector3d(prior.wheels.R_ItoO.row(2));
    all.push_back(
        {recording.label<ImuSample>(recording.imu_sensor), about(turns_of(recording.imu), axis)});
  }
  for (const Headings& other : recording.headings) {
    all.push_back({recording.label<HeadingSample>(other.sensor), turns_of(other.samples)});
  }
  return all;
}

Span span_of(const Recording& recording) {
  Span span;
  if (!recording.imu.empty()) {
    span = {recording.imu.front().t_ns, recording.imu.back().t_ns};
  } else {
    const auto first = std::find_if(recording.wheels.begin(), recording.wheels.end(),
                                    [](const Wheels& wheels) { return !wheels.samples.empty(); });
    if (first != recording.wheels.end()) {
      span = {first->samples.front().begin_ns, first->samples.back().end_ns};
    }
  }
  return span.begin_ns < span.end_ns ? span : Span{};
}

}  // namespace viwo::series
