#include "viwo/sim/drive_params.hpp"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "viwo/api/status.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::sim {
namespace {

constexpr double kMargin = 0.5;  // s
/// Beyond this a motion is of other units: m/s and rad/s.
constexpr double kFastest = 100.;

/// The table as a spline whose intervals have four rows each.
PlanarMotion read_motion(const std::filesystem::path& file) {
  log::TableReader table(file);
  const std::size_t time = table.column("time_s");
  const std::size_t columns[] = {table.column("v_x_m_per_s"), table.column("v_y_m_per_s"),
                                 table.column("omega_rad_per_s")};
  std::vector<double> times_s;
  std::vector<Twist> twists;
  while (table.next()) {
    const double t_s = table.number(time);
    if (!std::isfinite(t_s)) table.fail(time, "is not finite");
    if (!times_s.empty() && !(t_s > times_s.back())) {
      table.fail(time, "is not later than that of the row before");
    }
    times_s.push_back(t_s);
    Twist& twist = twists.emplace_back();
    for (int i = 0; i < 3; ++i) {
      twist[i] = table.number(columns[i]);
      if (!std::isfinite(twist[i])) table.fail(columns[i], "is not finite");
      if (std::abs(twist[i]) > kFastest) table.fail(columns[i], "is faster than any robot");
    }
  }
  constexpr std::size_t kFewest = 20;
  if (times_s.size() < kFewest) {
    throw InputError(file.string() + ": a motion needs at least " + std::to_string(kFewest) +
                     " rows, there are " + std::to_string(times_s.size()));
  }
  if (!twists.front().isZero(0.) || !twists.back().isZero(0.)) {
    throw InputError(file.string() +
                     ": a motion begins and ends at rest, its first or its last "
                     "row does not");
  }
  Eigen::Matrix<double, 6, Eigen::Dynamic> values(6, static_cast<Eigen::Index>(twists.size()));
  values.setZero();
  for (std::size_t k = 0; k < twists.size(); ++k) {
    values.col(static_cast<Eigen::Index>(k)).head<3>() = twists[k];
  }
  const double begin_s = times_s.front(), end_s = times_s.back();
  const std::size_t intervals = (times_s.size() - 1) / 4;
  const double spacing_s = (end_s - begin_s) / static_cast<double>(intervals);
  for (std::size_t k = 1; k < times_s.size(); ++k) {
    if (times_s[k] - times_s[k - 1] <= 0.5 * spacing_s) continue;
    throw InputError(file.string() + ": no rows for " +
                     std::to_string(times_s[k] - times_s[k - 1]) + " s after time_s " +
                     std::to_string(times_s[k - 1]) + "; rows are to be evenly spaced");
  }
  const auto spline = std::make_shared<const QuinticSpline>(
      QuinticSpline::fit(times_s, values, {begin_s, end_s, spacing_s, 0.}));
  return {"file", [spline, begin_s, end_s](double t_s) -> Twist {
            if (t_s <= begin_s || t_s >= end_s) return Twist::Zero();
            return spline->at(t_s).value.head<3>();
          }};
}

}  // namespace

PlanarMotion motion_from(const std::string& name, const std::filesystem::path& file,
                         const MotionOptions& options) {
  if (name != "file") {
    if (!file.empty()) throw ParamError("motion_file", "goes with motion: file, not " + name);
    return PlanarMotion(name, options);
  }
  if (file.empty()) throw ParamError("motion_file", "motion: file needs it");
  try {
    return read_motion(file);
  } catch (const InputError& error) {
    throw ParamError("motion_file", error.what());
  }
}

BodyTrajectory drive_from(const DriveParams& params, double end_s, double margin_s,
                          const SidewaysVelocity& sideways) {
  const PlanarMotion motion =
      motion_from(params.motion, params.motion_file,
                  {params.speed_m_per_s, params.yaw_rate_rad_per_s, params.ramp_s, params.pivot_m});
  const bool uneven = params.ground == "uneven";
  const Ground ground =
      uneven ? Ground::uneven(params.ground_amplitude_m, params.ground_wavelength_m) : Ground();
  const double margin = kMargin + margin_s;
  return BodyTrajectory::drive(motion, ground, -margin, end_s + margin, 0.05, sideways);
}

}  // namespace viwo::sim
