#include "viwo/plausibility/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "encoder_check.hpp"
#include "imu_check.hpp"
#include "stereo_check.hpp"
#include "stream_watch.hpp"
#include "twist_check.hpp"
#include "viwo/math/extent.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/periods.hpp"
#include "viwo/wheel/drive_ranges.hpp"

namespace viwo {

struct Plausibility::Checks {
  /// A wheel set, and the IMU against it.
  struct WheelsCheck {
    std::string sensor;
    EncoderCheck encoders;
    TwistCheck twist, heading;
    bool has_failed = false;  ///< what its model throws is told by those who need it
    WheelsWay way;
  };

  /// What the estimator takes of a sensor.
  struct Watched {
    std::string sensor;
    const SampleType* type;
    StreamWatch watch;

    /// How far its stamps are ahead of those of the IMU, which the estimator's time is.
    double ahead_s(const StreamWatch& imu_watch) const {
      if (!imu_watch.has_begun() || !watch.has_begun()) return 0.;
      return 1e-9 * (static_cast<double>(imu_watch.first_offset_ns()) -
                     static_cast<double>(watch.first_offset_ns()));
    }
  };

  std::string imu_name, heading_name;
  ImuCheck imu;
  std::vector<WheelsCheck> wheels;
  StereoCheck stereo;
  std::vector<Watched> streams;  ///< the IMU's first; without a filter only the wheels'
  bool moves = false;            ///< the wheels turn

  /// Nothing of what it gives is of the time of the run.
  bool is_of_another_clock(const Watched& stream) const {
    constexpr double kFar_s = 10.;
    return std::abs(stream.ahead_s(streams.front().watch)) > kFar_s;
  }

  struct Names {
    SensorName imu, heading, wheels;
  };
  void add(const Names& names, const WheelSet& set, Gyro gyro) {
    wheels.push_back({names.wheels.sensor,
                      EncoderCheck(names.wheels, set),
                      TwistCheck(names.imu, names.wheels, set.model, set.prior, gyro),
                      TwistCheck(names.heading, names.wheels, set.model, set.prior, Gyro::kHeading),
                      false,
                      {}});
  }

  void add(WheelsCheck& check, const EncoderSample& sample) {
    try {
      const std::optional<Twist> xi = check.encoders.add(sample);
      constexpr double kSlowest = 0.05;  // m/s, rad/s
      moves = xi && xi->norm() > kSlowest;
      if (xi) {
        const double dt_s = seconds_between(sample.begin_ns, sample.end_ns);
        check.way.duration_s += dt_s;
        check.way.length_m += xi->head<2>().norm() * dt_s;
        check.twist.add_wheels(sample, *xi, check.encoders.rate_by_prior());
        check.heading.add_wheels(sample, *xi, check.encoders.rate_by_prior());
      }
    } catch (const std::exception&) {
      check.has_failed = true;
    }
  }
};

namespace {

/// What the filter goes on without for a while: the IMU carries it as far as its biases are known,
/// and nothing carries it without the IMU (F-27). What only corrects it now and then, such as a
/// fix, may well be absent.
double least_gap_s(const Route& route, const FilterSetup& filter) {
  if (route.consumer == Consumer::kImu) return 0.2;
  const StreamSpec& spec = filter.streams[route.stream].spec;
  return spec.awaited || spec.ends_epochs ? 1. : 10.;
}

/// The sensor whose measurements those of `name` are made of.
std::string source_of(const std::string& name, const std::vector<SensorEntry>& sensors) {
  for (const SensorEntry& entry : sensors) {
    if (entry.name == name && !entry.input.empty()) return source_of(entry.input, sensors);
  }
  return name;
}

/// As texts call what a sensor gives: by its kind, too, if it gives several.
std::string name_of(const RunSetup& setup, const std::string& sensor, const std::string& kind) {
  for (const SensorEntry& entry : setup.sensors) {
    if (entry.name != sensor) continue;
    SampleTypes kinds =
        guarded(entry.sensor.info, "yields", [&] { return entry.sensor.object->yields(); });
    std::erase_if(kinds,
                  [](const SampleType* t) { return *t == sample_type<CalibrationSample>(); });
    if (kinds.size() > 1) return kind + " of " + sensor;
  }
  return sensor;
}

Finding of_another_clock(const std::string& name, double ahead_s) {
  return {name + " clock",
          name + ": its stamps are " + significant(std::abs(ahead_s), 2) + " s " +
              (ahead_s > 0. ? "ahead of" : "behind") +
              " those of the IMU: of another clock, or of another recording - none of its samples "
              "can be used",
          false,
          {},
          true};
}

}  // namespace

Plausibility::Plausibility(const RunSetup& setup, bool live)
    : live_(live), has_filter_(setup.filter.has_value()) {
  if (!setup.filter) return;
  const FilterSetup& filter = *setup.filter;
  const std::string imu = setup.routes.sensor_of(Consumer::kImu);
  // A simulator is all of them.
  const auto told = [&](const std::string& sensor, const std::string& kind) {
    return sensor == imu && setup.routes.sensor_of(Consumer::kWheels) == imu
               ? kind + " of " + sensor
               : sensor;
  };
  checks_ = std::make_unique<Checks>(
      Checks{imu,
             setup.routes.sensor_of(Consumer::kHeading),
             ImuCheck({told(imu, "imu"), imu}, filter.options.filter.gravity_m_per_s2),
             {},
             StereoCheck(filter.cameras),
             {}});
  watch_streams(setup);
  for (const WheelSet& set : filter.wheels) {
    std::string sensor = set.prior.sensor;
    if (sensor.empty()) sensor = setup.routes.sensor_of(Consumer::kWheels);
    if (sensor.empty()) continue;
    try {
      checks_->add({{told(imu, "imu"), imu},
                    {checks_->heading_name, checks_->heading_name},
                    {told(sensor, "wheels"), sensor}},
                   set, Gyro::kMounted);
    } catch (const std::exception&) {
      continue;
    }
  }
}

/// Of dead reckoning, of whose streams only the unit of the wheels' stamps is looked at, at the
/// end, and which does not say how the IMU is mounted.
void Plausibility::watch_without_filter(const RunSetup& setup, const Eigen::Vector3d& up) {
  const std::string sensor = setup.routes.sensor_of(Consumer::kWheels);
  const std::string imu = setup.routes.sensor_of(Consumer::kImu);
  const std::string heading = setup.routes.sensor_of(Consumer::kHeading);
  has_filter_ = false;
  checks_ = std::make_unique<Checks>(Checks{
      imu,
      heading,
      ImuCheck({name_of(setup, imu, "imu"), imu}, EstimatorOptions{}.filter.gravity_m_per_s2),
      {},
      StereoCheck({}),
      {}});
  if (!setup.model || sensor.empty()) return;
  checks_->streams.push_back(
      {sensor, &sample_type<EncoderSample>(),
       StreamWatch(name_of(setup, sensor, "wheels"), 0., kLongestEncoderPeriod_s)});
  WheelSet set = wheels_alone(setup);
  if (up.norm() > 0.) {
    set.prior.wheels.R_ItoO =
        Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  try {
    checks_->add({{name_of(setup, imu, "imu"), imu},
                  {name_of(setup, heading, "headings"), heading},
                  {name_of(setup, sensor, "wheels"), sensor}},
                 set, Gyro::kLevel);
  } catch (const std::exception&) {
    // What its model throws is told by those who need it.
  }
}

Eigen::Vector3d up_of(std::span<const ImuSample> imu) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) {
    const Eigen::Vector3d f = to_vector(sample.accel_m_per_s2);
    if (f.allFinite() && f.norm() > 0.) sum += f.normalized();
  }
  // One that is turned over and over has no direction.
  constexpr double kSteady = 0.9;
  const auto n = static_cast<double>(imu.size());
  return sum.norm() > kSteady * n && n > 0. ? Eigen::Vector3d(sum.normalized())
                                            : Eigen::Vector3d::Zero();
}

Findings implausible(const RunSetup& setup, const DeadReckoned& data, std::int64_t zero_ns) {
  Plausibility plausibility(setup);
  plausibility.watch_without_filter(setup, up_of(data.imu));
  plausibility.begin_at(zero_ns);
  const std::string imu = setup.routes.sensor_of(Consumer::kImu);
  const std::string wheels = setup.routes.sensor_of(Consumer::kWheels);
  const std::string heading = setup.routes.sensor_of(Consumer::kHeading);
  std::vector<std::pair<const std::string*, SampleView>> all;
  const auto include = [&all](const std::string& sensor, const auto& samples) {
    for (const auto& sample : samples) all.emplace_back(&sensor, sample);
  };
  include(imu, data.imu);
  include(wheels, data.wheels);
  include(heading, data.headings);
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.second.t_ns() < b.second.t_ns(); });
  for (const auto& [sensor, sample] : all) plausibility.add(*sensor, sample);
  plausibility.finish();
  Findings findings = plausibility.findings();
  for (Finding& finding : findings) {
    finding.is_doubt = finding.is_doubt || finding.sensor() == name_of(setup, wheels, "wheels");
  }
  return findings;
}

/// One watch for each kind of each sensor that the estimator takes something from.
void Plausibility::watch_streams(const RunSetup& setup) {
  std::vector<const Route*> taken;
  for (const Route& route : setup.routes.all()) {
    if (route.consumer != Consumer::kImu && route.consumer != Consumer::kStream) continue;
    const bool is_known = std::any_of(taken.begin(), taken.end(), [&](const Route* other) {
      return other->sensor == route.sensor && *other->type == *route.type;
    });
    if (!is_known) taken.push_back(&route);
  }
  std::stable_partition(taken.begin(), taken.end(),
                        [](const Route* route) { return route->consumer == Consumer::kImu; });
  for (const Route* route : taken) {
    std::string name = source_of(route->sensor, setup.sensors);
    const auto of_it = std::count_if(taken.begin(), taken.end(), [&](const Route* other) {
      return source_of(other->sensor, setup.sensors) == name;
    });
    if (of_it > 1) name = std::string(route->type->name) + " of " + name;
    const double longest_s = *route->type == sample_type<EncoderSample>()
                                 ? kLongestEncoderPeriod_s
                                 : std::numeric_limits<double>::infinity();
    checks_->streams.push_back({route->sensor, route->type,
                                StreamWatch(name, least_gap_s(*route, *setup.filter), longest_s)});
  }
}

Plausibility::~Plausibility() = default;

void Plausibility::add(const std::string& sensor, SampleView sample) {
  if (!checks_) return;
  // The estimator refuses such a one; here times would overflow.
  if (fault_of(sample.extent()) != nullptr) return;
  if (const auto* imu = sample.get_if<ImuSample>(); imu != nullptr && sensor == checks_->imu_name) {
    checks_->imu.add(*imu, checks_->moves);
    for (auto& wheels : checks_->wheels) wheels.twist.add_imu(*imu);
  } else if (const auto* heading = sample.get_if<HeadingSample>()) {
    if (sensor != checks_->heading_name) return;
    for (auto& wheels : checks_->wheels) wheels.heading.add_heading(*heading);
  } else if (const auto* encoders = sample.get_if<EncoderSample>()) {
    for (auto& wheels : checks_->wheels) {
      if (wheels.sensor == sensor && !wheels.has_failed) checks_->add(wheels, *encoders);
    }
  } else if (const auto* features = sample.get_if<FeatureSample>()) {
    checks_->stereo.add(sensor, *features);
  }
  watch(sensor, sample);
}

WheelsWay Plausibility::way() const {
  return checks_ && !checks_->wheels.empty() ? checks_->wheels.front().way : WheelsWay();
}

namespace {

bool rests(SampleView sample) {
  const auto* const wheels = sample.get_if<EncoderSample>();
  return wheels != nullptr && fastest_of(*wheels) == 0.;
}

}  // namespace

void Plausibility::watch(const std::string& sensor, SampleView sample) {
  for (Checks::Watched& stream : checks_->streams) {
    if (stream.sensor != sensor || !(*stream.type == sample.type())) continue;
    const std::int64_t t_ns = sample.t_ns();
    // A single stamp is not yet the time of the run: that of the next stream may be.
    const bool is_single = n_watched_ == 1 && !stream.watch.has_begun();
    if (!now_ns_ || is_single) now_ns_ = next_look_ns_ = t_ns;
    if (!zero_ns_ || (is_single && !is_begun_at_)) zero_ns_ = now_ns_;
    ++n_watched_;
    stream.watch.add(t_ns, sample.type().channel(sample.data()), *now_ns_, rests(sample));
    if (stream.watch.has_begun() && !checks_->is_of_another_clock(stream)) {
      now_ns_ = std::max(*now_ns_, stream.watch.newest_ns());
    }
    waited_ns_ = 0;
    if (has_filter_) look_now_and_then();
    return;
  }
}

void Plausibility::wait(double seconds) {
  if (!checks_ || !now_ns_) return;
  waited_ns_ += to_ns(seconds);
  look_now_and_then();
}

void Plausibility::look_now_and_then() {
  constexpr std::int64_t kPeriodNs = 1'000'000'000;
  const std::int64_t now_ns = *now_ns_ + waited_ns_;
  if (now_ns < next_look_ns_ && now_ns > next_look_ns_ - 2 * kPeriodNs) return;
  next_look_ns_ = now_ns + kPeriodNs;
  look(false);
}

void Plausibility::finish() {
  if (!checks_) return;
  for (auto& wheels : checks_->wheels) {
    wheels.twist.finish();
    wheels.heading.finish();
  }
  look(true);
}

void Plausibility::look(bool at_end) {
  findings_.clear();
  if (zero_ns_) checks_->imu.findings(*zero_ns_, findings_);
  for (const auto& wheels : checks_->wheels) {
    const std::size_t before = findings_.size();
    wheels.encoders.findings(zero_ns_.value_or(0), findings_);
    // Wheels that contradict themselves say nothing of the IMU.
    if (findings_.size() != before) continue;
    if (wheels.twist.finds_order(findings_) || wheels.heading.finds_order(findings_)) continue;
    wheels.twist.findings(checks_->imu.up(), zero_ns_.value_or(0), findings_);
    wheels.heading.findings(Eigen::Vector3d::Zero(), zero_ns_.value_or(0), findings_);
  }
  checks_->stereo.findings(findings_);
  if (!now_ns_ || checks_->streams.empty()) return;
  const StreamWatch& imu = checks_->streams.front().watch;
  for (const auto& stream : checks_->streams) {
    const std::size_t before = findings_.size();
    stream.watch.find_unit(findings_);
    // Gaps of wheels that run alone are counted where they are read.
    if (findings_.size() != before || !has_filter_) continue;
    if (checks_->is_of_another_clock(stream)) {
      findings_.push_back(of_another_clock(stream.watch.name(), stream.ahead_s(imu)));
    } else if (at_end) {
      stream.watch.findings(*now_ns_, *zero_ns_, live_ ? "run" : "recording", findings_);
    } else {
      stream.watch.findings(*now_ns_ + waited_ns_, *zero_ns_, findings_);
    }
  }
}

}  // namespace viwo
