#include "viwo/results/metrics.hpp"

#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "viwo/eval/accuracy.hpp"
#include "viwo/run/calibration_track.hpp"

namespace viwo {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Of the parameter that scatters most (F-42).
double largest_scatter(const RunResult& run) {
  double most = kNone;
  for (const CalibrationTrack& track : run.calibration) {
    if (is_estimated(run, track)) most = std::fmax(most, track.scatter);
  }
  return most;
}

const Metric kBeforeRpe[] = {
    {"end_m", "end [mm]", 1e3,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->end_m : kNone; }},
    {"end_yaw_abs_rad", "end yaw [mrad]", 1e3,
     [](const RunResult& r) {
       return r.accuracy ? std::abs(r.accuracy->end_yaw_deg) * std::numbers::pi / 180. : kNone;
     }},
    {"ate_m", "ATE [mm]", 1e3,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->ate_m : kNone; }},
    {"ate_deg", "ATE [deg]", 1.,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->ate_deg : kNone; }},
};

const Metric kAfterRpe[] = {
    {"nees_planar", "NEES (3)", 1., [](const RunResult& r) { return r.nees_planar; }, 3.},
    {"nees_pose", "NEES (6)", 1., [](const RunResult& r) { return r.nees.pose; }, 6.},
    {"nees_position", "NEES pos (3)", 1., [](const RunResult& r) { return r.nees.position; }, 3.},
    {"nees_orientation", "NEES ori (3)", 1., [](const RunResult& r) { return r.nees.orientation; },
     3.},
    {"nees_relative", "NEES rel (6)", 1., [](const RunResult& r) { return r.nees.relative; }, 6.},
    {"scatter", "scatter [sigma]", 1., largest_scatter, 1.},
    {"end_sigma_m", "end sigma [mm]", 1e3,
     [](const RunResult& r) { return r.end_sigma.position_m; }},
    {"epoch_ms", "epoch [ms]", 1.,
     [](const RunResult& r) { return r.updates.empty() ? kNone : r.total_ms.mean_ms; }},
};

void add_rpe(double length_m, std::vector<Metric>& metrics) {
  const std::string length = eval::length_text(length_m);
  metrics.push_back({"rpe_" + length + "_m", "RPE " + length + " m [mm]", 1e3,
                     [length_m](const RunResult& r) { return rpe(r, length_m, false); }});
  metrics.push_back({"rpe_" + length + "_deg", "RPE " + length + " m [deg]", 1.,
                     [length_m](const RunResult& r) { return rpe(r, length_m, true); }});
}

}  // namespace

std::set<double> segment_lengths_m(const RunResult& run) {
  std::set<double> lengths_m;
  if (!run.accuracy) return lengths_m;
  for (const auto& segment : run.accuracy->rpe) lengths_m.insert(segment.length_m);
  return lengths_m;
}

double rpe(const RunResult& run, double length_m, bool degrees) {
  if (!run.accuracy) return kNone;
  for (const auto& segment : run.accuracy->rpe) {
    if (segment.length_m == length_m) return degrees ? segment.mean_deg : segment.mean_m;
  }
  return kNone;
}

std::vector<Metric> metrics_over(const std::set<double>& lengths_m) {
  std::vector<Metric> metrics(std::begin(kBeforeRpe), std::end(kBeforeRpe));
  for (const double length_m : lengths_m) add_rpe(length_m, metrics);
  metrics.insert(metrics.end(), std::begin(kAfterRpe), std::end(kAfterRpe));
  return metrics;
}

}  // namespace viwo
