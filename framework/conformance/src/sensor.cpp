// Checks of a sensor.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <unistd.h>

#include "checks.hpp"
#include "digest.hpp"

namespace viwo::conformance {
namespace {

namespace fs = std::filesystem;
using config::Node;

/// A sensor may be a device: what it gives is looked at up to here.
constexpr std::int64_t kMost = 500'000;

template <class Values>
bool finite(const Values& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool unit(const std::array<double, 4>& q) {
  double sum = 0.;
  for (const double v : q) sum += v * v;
  return std::abs(sum - 1.) < 1e-3;
}

/// What is wrong with a measurement by itself; "" if nothing.
std::string fault(const EncoderSample& s) {
  if (s.n_drive < 0 || s.n_drive > kMaxDrives || s.n_steer < 0 || s.n_steer > kMaxSteers) {
    return "has " + std::to_string(s.n_drive) + " drive and " + std::to_string(s.n_steer) +
           " steering channels";
  }
  return finite(s.drive_rad_per_s) && finite(s.steer_rad) ? "" : "has values that are not finite";
}
std::string fault(const PoseSample& s) {
  if (!finite(s.p_BinW_m) || !finite(s.q_BtoW_xyzw)) return "has values that are not finite";
  return unit(s.q_BtoW_xyzw) ? "" : "has a quaternion that is not of unit norm";
}
std::string fault(const ImuSample& s) {
  return finite(s.gyro_rad_per_s) && finite(s.accel_m_per_s2) ? ""
                                                              : "has values that are not finite";
}
std::string fault(const FeatureSample& s) {
  if (s.camera < 0) return "is of camera " + std::to_string(s.camera);
  std::set<std::int64_t> ids;
  for (const FeaturePoint& point : s.points) {
    if (!std::isfinite(point.u_px) || !std::isfinite(point.v_px)) {
      return "has values that are not finite";
    }
    if (!ids.insert(point.id).second) return "has the point " + std::to_string(point.id) + " twice";
  }
  return "";
}
std::string fault(const StateSample& s) {
  if (!finite(s.p_IinG_m) || !finite(s.v_IinG_m_per_s) || !finite(s.gyro_bias_rad_per_s) ||
      !finite(s.accel_bias_m_per_s2) || !finite(s.q_ItoG_xyzw)) {
    return "has values that are not finite";
  }
  return unit(s.q_ItoG_xyzw) ? "" : "has a quaternion that is not of unit norm";
}
std::string fault(const CalibrationSample& s) {
  if (s.name.empty()) return "has no name";
  return std::isfinite(s.value) ? "" : "has a value that is not finite";
}

std::string fault(const ImageSample& s) {
  if (s.camera < 0) return "is of camera " + std::to_string(s.camera);
  if (s.source == nullptr) return "has no source of its pixels";
  Image image, again;
  s.source->read(image);
  if (image.width_px <= 0 || image.height_px <= 0 ||
      image.pixels.size() !=
          static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px)) {
    return "has another number of pixels than its size says";
  }
  s.source->read(again);
  return image.pixels == again.pixels ? "" : "has other pixels when read again";
}

/// Of viwo's own kinds all that can be wrong, of others what they say themselves.
std::string fault(const Measurement& measurement) {
  const SampleExtent extent = measurement.view().extent();
  if (extent.begin_ns > extent.t_ns || extent.t_ns > extent.end_ns) {
    return "is for the time from " + std::to_string(extent.begin_ns) + " to " +
           std::to_string(extent.end_ns) + " ns, which does not hold its stamp";
  }
  std::string text;
  if (visit_one_of<EncoderSample, PoseSample, ImuSample, FeatureSample, StateSample,
                   CalibrationSample, ImageSample>(measurement,
                                                   [&](const auto& s) { text = fault(s); })) {
    return text;
  }
  const SampleView view = measurement.view();
  const char* const said = view.type().fault(view.data());
  return said != nullptr ? "has a " + std::string(said) : "";
}

/// What is wrong with a measurement where it stands among the others; "" if nothing.
class Sequence {
 public:
  explicit Sequence(SampleTypes yields) : yields_(std::move(yields)) {}

  std::string fault(const Measurement& measurement) {
    if (measurement.empty()) return "is empty";
    const SampleType& type = measurement.view().type();
    if (std::none_of(yields_.begin(), yields_.end(),
                     [&type](const SampleType* one) { return *one == type; })) {
      return "is of a kind that yields() does not name - it names all that next() may give";
    }
    const SampleExtent extent = measurement.view().extent();
    if (last_ns_ && extent.t_ns < *last_ns_) {
      return "comes after one at " + std::to_string(*last_ns_) +
             " ns - next() gives measurements in time order";
    }
    last_ns_ = extent.t_ns;
    std::string wrong = conformance::fault(measurement);
    if (!wrong.empty() || extent.begin_ns == extent.end_ns) return wrong;
    std::int64_t& end_ns = cell_end_ns_.try_emplace(type.name, extent.begin_ns).first->second;
    if (extent.begin_ns < end_ns) {
      return "begins " + std::to_string(end_ns - extent.begin_ns) +
             " ns before the last one ends - cells must not overlap";
    }
    end_ns = extent.end_ns;
    return "";
  }

 private:
  SampleTypes yields_;
  std::optional<std::int64_t> last_ns_;
  std::map<std::string, std::int64_t> cell_end_ns_;  ///< by kind
};

/// "measurement 12 (imu) at 60000000 ns "
std::string name_of(const Measurement& measurement, std::int64_t count) {
  std::string text = "measurement " + std::to_string(count) + " ";
  if (measurement.empty()) return text;
  return text + "(" + measurement.view().type().name + ") at " +
         std::to_string(measurement.t_ns()) + " ns ";
}

void check_rejections(const Sensor& sensor, Findings& findings) {
  std::vector<RejectionCount> rejections;
  sensor.rejections(rejections);
  for (const RejectionCount& rejection : rejections) {
    if (rejection.reason.empty() || rejection.count <= 0) {
      findings.fail("rejections() gives an entry without reason or count");
    }
    findings.note("rejected: " + std::to_string(rejection.count) + " x " + rejection.reason);
  }
}

void check_measurements(const Subject& subject, Findings& findings) {
  const auto sensor = subject.make<Sensor>().object;
  const SampleTypes yields = sensor->yields();
  if (yields.empty()) return findings.fail("yields() names no kind of samples");
  Sequence sequence(yields);
  Measurement measurement;
  std::int64_t count = 0;
  Status status = Status::kOk;
  while (count < kMost && (status = sensor->next(measurement)) == Status::kOk) {
    const std::string wrong = sequence.fault(measurement);
    if (!wrong.empty()) return findings.fail(name_of(measurement, count) + wrong);
    ++count;
  }
  findings.note(std::to_string(count) + " measurements");
  if (status == Status::kOk) return findings.note("looked at the first ones only");
  if (status != Status::kEnd) findings.fail("next() answers neither kOk nor kEnd");
  if (count == 0) findings.fail("gives no measurement at all - is --config what it needs?");
  for (int i = 0; i < 3; ++i) {
    if (sensor->next(measurement) != Status::kEnd) {
      return findings.fail("next() goes on after kEnd - once at the end it stays there");
    }
  }
  check_rejections(*sensor, findings);
}

std::vector<std::uint64_t> stream_of(Sensor& sensor) {
  std::vector<std::uint64_t> digests;
  Measurement measurement;
  while (static_cast<std::int64_t>(digests.size()) < kMost &&
         sensor.next(measurement) == Status::kOk) {
    digests.push_back(digest_of(measurement));
  }
  return digests;
}

std::string difference(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i] != b[i]) return "measurement " + std::to_string(i) + " differs";
  }
  if (a.size() == b.size()) return "";
  return std::to_string(a.size()) + " measurements the first time, " + std::to_string(b.size()) +
         " then";
}

void check_sensor_repeatable(const Subject& subject, Findings& findings) {
  const auto first = stream_of(*subject.make<Sensor>().object);
  const auto second = stream_of(*subject.make<Sensor>().object);
  const std::string differs = difference(first, second);
  if (differs.empty()) return;
  findings.fail("not the same for the same seed: " + differs +
                " - take random numbers from HostServices::seed, and no clock");
}

void check_sensor_independent(const Subject& subject, Findings& findings) {
  const auto alone = stream_of(*subject.make<Sensor>().object);
  const auto one = subject.make<Sensor>(), two = subject.make<Sensor>(subject.section(), 2);
  std::vector<std::uint64_t> together;
  Measurement measurement;
  while (static_cast<std::int64_t>(together.size()) < kMost &&
         one.object->next(measurement) == Status::kOk) {
    together.push_back(digest_of(measurement));
    two.object->next(measurement);
  }
  const std::string differs = difference(alone, together);
  if (differs.empty()) return;
  findings.fail("two instances that are read in turn see each other: " + differs +
                " - no static variables");
}

/// Reads a section to its end; whether it is answered as a mistake of the user.
bool is_refused(const Subject& subject, const Node& section) {
  try {
    const auto loaded = subject.make<Sensor>(section);
    Measurement measurement;
    for (std::int64_t i = 0; i < kMost; ++i) {
      const Status status =
          guarded(loaded.info, "next", [&] { return loaded.object->next(measurement); });
      if (status != Status::kOk) break;
    }
  } catch (const InputError&) {
    return true;
  }
  return false;
}

/// Where a path of the section is replaced by something else.
void check_files(const Subject& subject, Findings& findings) {
  const fs::path garbage =
      fs::temp_directory_path() / ("viwo_conformance_" + std::to_string(::getpid()));
  constexpr char kGarbage[] = "\x1f\x8b\0not,a\nlog \xff\xfe";
  std::ofstream(garbage, std::ios::binary).write(kGarbage, sizeof kGarbage);
  int paths = 0;
  for (const ParamSpec& spec : subject.info().params) {
    if (spec.type != ParamType::kPath) continue;
    const Node* value = subject.section().find(spec.name);
    if (value == nullptr || !value->is_scalar() || value->scalar().empty()) continue;
    ++paths;
    const std::string name = "parameter '" + spec.name + "'";
    for (const auto& [path, what, must_refuse] :
         {std::tuple(fs::path("/no/such/file.csv"), "a file that does not exist", true),
          std::tuple(garbage, "a file that is something else", true)}) {
      Node section = subject.section();
      section.set(spec.name, Node::scalar_of(path.string(), {}, true));
      try {
        if (is_refused(subject, section) || !must_refuse) continue;
        findings.fail(name + " names " + what +
                      ", and nothing is said - throw InputError with file "
                      "and line");
      } catch (const PluginFailure& failure) {
        findings.fail(name + " names " + what + ": threw '" + failure.text() +
                      "' - throw InputError with file and line");
      }
    }
  }
  fs::remove(garbage);
  if (paths == 0) findings.note("reads no file");
}

}  // namespace

std::vector<NamedCheck> sensor_checks(const Subject& subject) {
  const auto of = [&subject](void (*check)(const Subject&, Findings&)) -> Check {
    return [&subject, check](Findings& findings) { check(subject, findings); };
  };
  return {{"measurements", of(check_measurements)},
          {"repeatable", of(check_sensor_repeatable)},
          {"independent instances", of(check_sensor_independent)},
          {"files", of(check_files)}};
}

}  // namespace viwo::conformance
