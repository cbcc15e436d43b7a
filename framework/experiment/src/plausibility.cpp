#include "plausibility.hpp"

#include <optional>

#include "encoder_check.hpp"
#include "imu_check.hpp"
#include "stereo_check.hpp"
#include "twist_check.hpp"

namespace viwo::experiment {

struct Plausibility::Checks {
  /// A wheel set, and the IMU against it.
  struct WheelsCheck {
    std::string sensor;
    EncoderCheck encoders;
    TwistCheck twist;
    bool has_failed = false;  ///< what its model throws is told by those who need it
  };

  std::string imu_name;
  ImuCheck imu;
  std::vector<WheelsCheck> wheels;
  StereoCheck stereo;
  bool moves = false;  ///< the wheels turn

  void add(WheelsCheck& check, const EncoderSample& sample) {
    try {
      const std::optional<Twist> xi = check.encoders.add(sample);
      constexpr double kLeast = 0.05;  // m/s, rad/s
      moves = xi && xi->norm() > kLeast;
      if (xi) check.twist.add_wheels({sample.t_ns, sample.begin_ns, sample.end_ns}, *xi);
    } catch (const std::exception&) {
      check.has_failed = true;
    }
  }
};

Plausibility::Plausibility(const RunSetup& setup) {
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
             ImuCheck(told(imu, "imu"), filter.options.filter.gravity_m_per_s2),
             {},
             StereoCheck(filter.cameras)});
  for (const WheelSet& set : filter.wheels) {
    std::string sensor = set.prior.sensor;
    if (sensor.empty()) sensor = setup.routes.sensor_of(Consumer::kWheels);
    if (sensor.empty()) continue;
    try {
      checks_->wheels.push_back({sensor, EncoderCheck(told(sensor, "wheels"), set.model, set.prior),
                                 TwistCheck(told(imu, "imu"), told(sensor, "wheels"), set.prior)});
    } catch (const std::exception&) {
      continue;
    }
  }
}

Plausibility::~Plausibility() = default;

void Plausibility::add(const std::string& sensor, SampleView sample) {
  if (!checks_) return;
  if (const auto* imu = sample.get_if<ImuSample>(); imu != nullptr && sensor == checks_->imu_name) {
    checks_->imu.add(*imu, checks_->moves);
    for (auto& wheels : checks_->wheels) wheels.twist.add_imu(*imu);
    constexpr std::int64_t kPeriodNs = 1'000'000'000;
    if (imu->t_ns < next_look_ns_ && imu->t_ns > next_look_ns_ - 2 * kPeriodNs) return;
    next_look_ns_ = imu->t_ns + kPeriodNs;
    look();
  } else if (const auto* encoders = sample.get_if<EncoderSample>()) {
    for (auto& wheels : checks_->wheels) {
      if (wheels.sensor == sensor && !wheels.has_failed) checks_->add(wheels, *encoders);
    }
  } else if (const auto* features = sample.get_if<FeatureSample>()) {
    checks_->stereo.add(sensor, *features);
  }
}

void Plausibility::finish() {
  if (checks_) look();
}

void Plausibility::look() {
  findings_.clear();
  checks_->imu.findings(findings_);
  for (const auto& wheels : checks_->wheels) {
    const std::size_t before = findings_.size();
    wheels.encoders.findings(findings_);
    // Wheels that contradict themselves say nothing of the IMU.
    if (findings_.size() == before) wheels.twist.findings(checks_->imu.up(), findings_);
  }
  checks_->stereo.findings(findings_);
}

}  // namespace viwo::experiment
