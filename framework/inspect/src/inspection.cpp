#include "viwo/inspect/inspection.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "plots.hpp"
#include "remedies.hpp"
#include "viwo/checks/checks.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::gather;
using series::Headings;
using series::Poses;
using series::Recording;
using series::Wheels;

namespace {

using Checks = std::span<const std::string_view>;

/// Of a text "wheels0: turn 57.3 ..." with the key "imu0 rate".
Finding of_plausibility(const viwo::Finding& found) {
  Finding finding;
  finding.sensor = found.sensor();
  finding.what = found.text.substr(std::min(found.text.size(), finding.sensor.size() + 2));
  // Sensors have no spaces in their names; "imu of simulator0" does.
  std::string key = found.key;
  const std::size_t of = key.find(" of ");
  key = key.substr(key.find(' ', of == std::string::npos ? 0 : of + 4) + 1);
  finding.check = key;
  finding.severity = Severity::kFault;
  finding.remedies = found.remedies;
  return finding;
}

bool is_fault_of(const Findings& findings, std::string_view sensor, Checks checks) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
    return f.severity == Severity::kFault && f.sensor == sensor &&
           std::find(checks.begin(), checks.end(), f.check) != checks.end();
  });
}

/// What is the fault itself of a wheel or an IMU, and what follows from it: a sensor with a wrong
/// unit, sign, order or zero disagrees in all that it is compared with.
constexpr std::array<std::string_view, 6> kWheelCauses = {"order",   "turn", "steering",
                                                          "channel", "rate", "steer offsets"};
/// What the wheels alone, or poses, say of the wheels: why they turn otherwise than the gyro.
constexpr std::array<std::string_view, 9> kNotOfGyro = {
    "order", "turn", "steering", "channel", "steer offsets", "parity", "speed", "heading", "zeros"};
constexpr std::array<std::string_view, 2> kOrder = {"order", "steering"};
constexpr std::array<std::string_view, 2> kContradicted = {"contradicted", "steer lag"};
/// What no noise is the remedy of.
constexpr std::array<std::string_view, 6> kNoNoise = {"contradicted", "parity", "speed",
                                                      "heading",      "slip",   "steer lag"};
/// Likewise, of the gyro: another scale of the drives.
constexpr std::array<std::string_view, 1> kRate = {"rate"};
constexpr std::array<std::string_view, 6> kImuCauses = {"gravity", "rate",    "up",
                                                        "tilt",    "channel", "columns"};
/// What exchanged columns look like besides.
constexpr std::array<std::string_view, 1> kColumns = {"columns"};
constexpr std::array<std::string_view, 3> kOfColumns = {"rate", "up", "tilt"};
/// Of Plausibility: by check_wheel_clocks(), check_order(), check_stamps() and check_slip().
constexpr std::array<std::string_view, 4> kToldWithMore = {"lag", "yaw order", "unit", "slip"};
bool is_one_of(const std::string& check, Checks checks) {
  return std::find(checks.begin(), checks.end(), check) != checks.end();
}
bool is_of_stamps(const std::string& check) {
  constexpr std::array<std::string_view, 7> kStamps = {"stamps",   "gaps",     "end",  "none",
                                                       "rejected", "readable", "clock"};
  return is_one_of(check, kStamps);
}

void demote(Finding& finding, const std::string& cause) {
  if (finding.severity == Severity::kFits) return;
  finding.severity = Severity::kNote;
  finding.what += " (look again when what is wrong with " + cause + " is mended)";
  finding.remedies.clear();
}

/// Of plausibility: "stuck drive_2".
bool has_stuck_channel(const Findings& findings, const std::string& sensor) {
  return std::any_of(findings.begin(), findings.end(), [&](const Finding& f) {
    return f.sensor == sensor && f.severity == Severity::kFault && f.check.starts_with("stuck ");
  });
}

/// The sensor whose fault, among all, a finding follows from; "" for none. `gyro`: that whose unit
/// or axes are wrong; "" for none.
std::string cause_of(const Finding& finding, const Findings& all, const std::string& imu,
                     const std::string& gyro) {
  const std::string& check = finding.check;
  const std::string& sensor = finding.sensor;
  const bool is_noise = check.starts_with("sigma_");
  const auto follows = [&](Checks causes) {
    return !is_one_of(check, causes) && is_fault_of(all, sensor, causes);
  };
  if (check == "steer offsets" && is_fault_of(all, sensor, kOrder)) return sensor;
  // Whatever else is wrong with wheels is why they turn otherwise.
  if (check == "yaw" && std::ranges::any_of(all, [&](const Finding& other) {
        return other.severity == Severity::kFault && other.sensor == sensor && other.check != check;
      })) {
    return sensor;
  }
  if (sensor != imu && follows(kWheelCauses)) {
    return is_of_stamps(check) && check != "clock" ? "" : sensor;
  }
  if (is_noise && is_fault_of(all, sensor, kNoNoise)) return sensor;
  if (is_noise && is_fault_of(all, imu, kRate)) return imu;
  if (is_noise && has_stuck_channel(all, sensor)) return sensor;
  const bool compares = check == "parity" || check == "speed" || check == "clock";
  if (compares && follows(kContradicted)) return sensor;
  if (gyro.empty()) return "";
  if (check == "clock" || check == "turns" || check == "yaw") return gyro;
  const bool shows = sensor == gyro && check != "axes";
  return shows && !is_one_of(check, kImuCauses) && !is_of_stamps(check) ? gyro : "";
}

void demote_consequences(const Recording& recording, Findings& findings) {
  const std::string imu =
      recording.imu_sensor.empty() ? "" : recording.label<ImuSample>(recording.imu_sensor);
  std::vector<std::string> gyros = {imu};
  for (const Headings& other : recording.headings) {
    gyros.push_back(recording.label<HeadingSample>(other.sensor));
  }
  std::string wheels, in_disorder;
  for (const Wheels& set : recording.wheels) {
    const std::string label = recording.label<EncoderSample>(set.sensor);
    if (is_fault_of(findings, label, kNotOfGyro)) wheels = label;
    if (is_fault_of(findings, label, kOrder)) in_disorder = label;
  }
  const auto is_of_poses = [&](const std::string& sensor) {
    return std::any_of(recording.poses.begin(), recording.poses.end(),
                       [&](const Poses& poses) { return recording.label(poses) == sensor; });
  };
  for (Finding& finding : findings) {
    const bool is_of_gyro = std::find(gyros.begin(), gyros.end(), finding.sensor) != gyros.end();
    if (is_of_gyro && finding.check == "rate" && !wheels.empty()) {
      demote(finding, wheels);
    } else if (finding.check == "clock" && !in_disorder.empty() && is_of_poses(finding.sensor)) {
      demote(finding, in_disorder);  // which is compared with those wheels
    } else if (is_one_of(finding.check, kOfColumns) &&
               is_fault_of(findings, finding.sensor, kColumns)) {
      demote(finding, finding.sensor);
    }
  }
  const Findings all = findings;
  const auto wrong = std::find_if(gyros.begin(), gyros.end(), [&](const std::string& one) {
    return is_fault_of(all, one, kImuCauses);
  });
  const std::string gyro = wrong != gyros.end() ? *wrong : "";
  for (Finding& finding : findings) {
    if (finding.severity != Severity::kFault) continue;
    if (const std::string cause = cause_of(finding, all, imu, gyro); !cause.empty()) {
      demote(finding, cause);
    }
  }
}

}  // namespace

bool Inspection::has_faults() const {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& f) { return f.severity == Severity::kFault; });
}

Inspection inspect(RunSetup& setup) {
  const Recording recording = gather(setup);
  Inspection inspection;
  inspection.name = setup.name;
  Findings& findings = inspection.findings;
  check_stamps(recording, findings);
  check_imu(recording, findings);
  check_tilt(recording, findings);
  check_imu_noise(recording, findings);
  check_still_channels(recording, findings);
  check_wheels(recording, findings);
  check_headings(recording, findings);
  check_turns(recording, findings);
  check_order(recording, findings);
  check_slip(recording, findings);
  check_steer_offsets(recording, findings);
  check_steer_lag(recording, findings);
  check_wheel_clocks(recording, findings);
  check_camera_clocks(recording, findings);
  check_poses(recording, findings);
  check_references(recording, findings);
  for (const viwo::Finding& found : recording.implausible) {
    Finding finding = of_plausibility(found);
    const bool is_told = is_one_of(finding.check, kToldWithMore) ||
                         (finding.check == "order" && is_fault(findings, finding.sensor, "order"));
    if (!is_told) {
      findings.push_back(std::move(finding));
    }
  }
  for (Finding& finding : findings) put_into(setup.resolved, finding.remedies);
  demote_consequences(recording, findings);
  std::vector<std::string> sensors;
  for (const Finding& finding : findings) {
    if (std::find(sensors.begin(), sensors.end(), finding.sensor) == sensors.end()) {
      sensors.push_back(finding.sensor);
    }
  }
  // Of each sensor what is the cause first.
  const auto place = [&](const Finding& f) {
    const bool is_cause = is_one_of(f.check, kWheelCauses) || is_one_of(f.check, kImuCauses);
    return 2 * (std::find(sensors.begin(), sensors.end(), f.sensor) - sensors.begin()) +
           (is_cause && f.severity == Severity::kFault ? 0 : 1);
  };
  std::stable_sort(findings.begin(), findings.end(),
                   [&](const Finding& a, const Finding& b) { return place(a) < place(b); });
  inspection.plots = plots_of(recording);
  return inspection;
}

}  // namespace viwo::inspect
