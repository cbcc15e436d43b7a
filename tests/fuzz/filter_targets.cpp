// The filter: sequences of measurements of any order, any stamp and any value, into an estimator
// with all updates, as the configurations in tests/fuzz/files make it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../support/sensors_in_memory.hpp"
#include "target.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/run/run.hpp"

namespace viwo::fuzz {
namespace {

/// Reads the bytes as decisions; behind their end all of them are 0.
class Choices {
 public:
  explicit Choices(Bytes bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }

  template <class T>
  T raw() {
    T value{};
    const std::size_t n = std::min(bytes_.size(), sizeof value);
    std::memcpy(&value, bytes_.data(), n);
    bytes_ = bytes_.subspan(n);
    return value;
  }
  std::size_t below(std::size_t count) { return raw<std::uint8_t>() % count; }

  double number(double now) {
    using Limits = std::numeric_limits<double>;
    constexpr double kSpecial[] = {0.,
                                   -1.,
                                   Limits::quiet_NaN(),
                                   Limits::infinity(),
                                   -Limits::infinity(),
                                   Limits::max(),
                                   -Limits::max(),
                                   Limits::denorm_min(),
                                   1e9,
                                   -1e9,
                                   1e18,
                                   1e19};
    switch (below(4)) {
      case 0:
        return kSpecial[below(std::size(kSpecial))];
      case 1:
        return now * 0.1 * raw<std::int8_t>();
      case 2:
        return now + 0.1 * raw<std::int8_t>();
      default:
        return raw<double>();
    }
  }

  std::int64_t stamp(std::int64_t now_ns) {
    using Limits = std::numeric_limits<std::int64_t>;
    constexpr std::int64_t kSpecial[] = {
        0, -1, Limits::min(), Limits::max(), 4'000'000'000'000'000'000, -4'000'000'000'000'000'000};
    switch (below(4)) {
      case 0:
        return kSpecial[below(std::size(kSpecial))];
      case 1:
        return moved(now_ns, raw<std::int8_t>() * std::int64_t{1'000'000});
      case 2:
        return moved(now_ns, raw<std::int16_t>() * std::int64_t{1'000'000'000});
      default:
        return raw<std::int64_t>();
    }
  }

  static std::int64_t moved(std::int64_t t_ns, std::int64_t by_ns) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(t_ns) +
                                     static_cast<std::uint64_t>(by_ns));
  }

 private:
  Bytes bytes_;
};

// What of a sample may be anything.

template <class T>
std::vector<std::int64_t*> stamps(T& sample) {
  return {&sample.t_ns};
}
std::vector<std::int64_t*> stamps(EncoderSample& sample) {
  return {&sample.t_ns, &sample.begin_ns, &sample.end_ns};
}

template <std::size_t kSize>
void add(std::vector<double*>& all, std::array<double, kSize>& values) {
  for (double& value : values) all.push_back(&value);
}

template <class... Array>
std::vector<double*> all_of(Array&... arrays) {
  std::vector<double*> all;
  (add(all, arrays), ...);
  return all;
}

std::vector<double*> numbers(ImuSample& s) { return all_of(s.gyro_rad_per_s, s.accel_m_per_s2); }
std::vector<double*> numbers(EncoderSample& s) { return all_of(s.drive_rad_per_s, s.steer_rad); }
std::vector<double*> numbers(PoseSample& s) { return all_of(s.p_BinW_m, s.q_BtoW_xyzw); }
std::vector<double*> numbers(StateSample& s) {
  return all_of(s.q_ItoG_xyzw, s.p_IinG_m, s.v_IinG_m_per_s, s.gyro_bias_rad_per_s,
                s.accel_bias_m_per_s2);
}
std::vector<double*> numbers(GnssSample& s) {
  std::vector<double*> all = all_of(s.covariance_ENU_m2);
  all.insert(all.end(), {&s.latitude_deg, &s.longitude_deg, &s.altitude_m});
  return all;
}
std::vector<double*> numbers(FeatureSample& s) {
  std::vector<double*> all;
  for (FeaturePoint& point : s.points) all.insert(all.end(), {&point.u_px, &point.v_px});
  return all;
}

/// What else a sensor says that is broken: numbers of cameras, ids, points that are missing.
template <class T>
void spoil_rest(T& /*sample*/, Choices& /*choices*/) {}
void spoil_rest(EncoderSample& sample, Choices& choices) {
  sample.bad_drives = choices.raw<std::uint8_t>();
  sample.bad_steers = choices.raw<std::uint8_t>();
}
void spoil_rest(FeatureSample& sample, Choices& choices) {
  sample.camera = choices.raw<std::int8_t>();
  sample.points.resize(choices.below(64));
  for (FeaturePoint& point : sample.points) {
    if (choices.below(2) == 1) point.id = choices.raw<std::int8_t>();
  }
}

template <class T>
Measurement spoiled(T sample, Choices& choices) {
  switch (choices.below(4)) {
    case 0:
      for (std::int64_t* stamp : stamps(sample)) *stamp = choices.stamp(*stamp);
      break;
    case 1: {
      const auto all = numbers(sample);
      if (!all.empty()) {
        double& number = *all[choices.below(all.size())];
        number = choices.number(number);
      }
      break;
    }
    case 2:
      for (double* number : numbers(sample)) *number = choices.number(*number);
      break;
    default:
      spoil_rest(sample, choices);
  }
  return sample;
}

/// Calls `change` with a copy of the sample, whichever kind it is of.
template <class Change, class... T>
Measurement changed(const Measurement& m, const Change& change) {
  Measurement out = m;
  const auto try_kind = [&]<class Kind>(const Kind* sample) {
    if (sample != nullptr) out = change(*sample);
  };
  (try_kind(m.get_if<T>()), ...);
  return out;
}
template <class Change>
Measurement changed_sample(const Measurement& m, const Change& change) {
  return changed<Change, ImuSample, EncoderSample, PoseSample, StateSample, GnssSample,
                 FeatureSample>(m, change);
}

Measurement moved(const Measurement& m, std::int64_t by_ns) {
  return changed_sample(m, [by_ns](auto sample) {
    for (std::int64_t* stamp : stamps(sample)) *stamp = Choices::moved(*stamp, by_ns);
    return Measurement(sample);
  });
}

/// Where a position is on the Earth, to the centimetre.
GnssSample fix_at(const PoseSample& pose) {
  GnssSample fix;
  fix.t_ns = pose.t_ns;
  fix.latitude_deg = 45. + pose.p_BinW_m[1] / 111'130.;
  fix.longitude_deg = 16. + pose.p_BinW_m[0] / 78'850.;
  fix.altitude_m = 120. + pose.p_BinW_m[2];
  fix.covariance_ENU_m2 = {1e-2, 0., 0., 0., 1e-2, 0., 0., 0., 1e-2};
  return fix;
}

/// What the robot measures when nothing is wrong, in time order; `set`: otherwise than configured.
std::vector<Measurement> measured(const std::vector<std::string>& set) {
  const RunSetup setup = read_run(configuration("robot.yaml", set), registry());
  std::vector<Measurement> all;
  Measurement measurement;
  while (setup.sensors.front().sensor.object->next(measurement) == Status::kOk) {
    all.push_back(measurement);
    if (const auto* pose = measurement.get_if<PoseSample>()) all.emplace_back(fix_at(*pose));
  }
  return all;
}

/// It stands, as long as a start from a rest looks for, and drives off. Points that are seen at the
/// rest would be others than those that follow, with the same numbers.
const std::vector<Measurement>& drive() {
  static const std::vector<Measurement> all = [] {
    std::vector<Measurement> both =
        measured({"sensors.robot.motion=stationary", "sensors.robot.duration_s=0.6",
                  "sensors.robot.start_ns=380000000"});
    std::erase_if(both, [](const Measurement& m) { return m.get_if<FeatureSample>() != nullptr; });
    const std::vector<Measurement> driving = measured({});
    both.insert(both.end(), driving.begin(), driving.end());
    return both;
  }();
  return all;
}

/// The drive as the bytes spoil it: not more than the whole of it has, or an execution takes
/// seconds, and nothing is tried.
std::vector<Measurement> spoiled_drive(Choices& choices, bool rest_follows) {
  constexpr std::size_t kMost = 800;
  const std::vector<Measurement>& all = drive();
  std::vector<Measurement> out;
  std::size_t next = 0;
  std::int64_t offset_ns = 0;
  const auto give = [&](std::size_t count) {
    for (; count > 0 && next < all.size() && out.size() < kMost; --count) {
      out.push_back(moved(all[next++], offset_ns));
    }
  };
  while (!choices.empty() && out.size() < kMost) {
    switch (choices.below(6)) {
      case 0:
        give(1 + choices.below(64));
        break;
      case 1:
        next = std::min(all.size(), next + 1 + choices.below(64));
        break;
      case 2:
        next -= std::min(next, 1 + choices.below(64));
        break;
      case 3:
        offset_ns = choices.stamp(offset_ns);
        break;
      default:
        if (next == all.size()) next = 0;
        out.push_back(changed_sample(moved(all[next++], offset_ns),
                                     [&](const auto& sample) { return spoiled(sample, choices); }));
    }
  }
  if (rest_follows) give(all.size());
  return out;
}

ImuPrior true_start() {
  const auto first = std::find_if(drive().begin(), drive().end(), [](const Measurement& m) {
    return m.get_if<StateSample>() != nullptr;
  });
  const StateSample& truth = *first->get_if<StateSample>();
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  prior.state.R_GtoI = to_quaternion(truth.q_ItoG_xyzw).toRotationMatrix().transpose();
  prior.state.p_IinG = to_vector(truth.p_IinG_m);
  prior.state.v_IinG = to_vector(truth.v_IinG_m_per_s);
  prior.P = 1e-4 * ImuMatrix::Identity();
  return prior;
}

struct Robot {
  const char* file;
  StartMode start;
};
constexpr Robot kRobots[] = {{"robot.yaml", StartMode::kReference},
                             {"robot.yaml", StartMode::kStandstill},
                             {"robot.yaml", StartMode::kMoving},
                             {"camera.yaml", StartMode::kMoving},
                             {"relative.yaml", StartMode::kMoving}};
constexpr std::size_t kWheels = 0, kCamera = 3, kRelative = 4;
/// Of whole runs: the corpus counts by their number.
constexpr std::size_t kRobotsOfRuns = 4;

/// A set-up with updates that have not seen anything yet.
RunSetup fresh_setup(std::size_t robot) {
  static std::array<std::optional<RunSetup>, std::size(kRobots)> read;
  std::optional<RunSetup>& setup = read[robot];
  if (!setup) {
    setup = read_run(configuration(kRobots[robot].file), registry());
    setup->filter->start.mode = kRobots[robot].start;
  }
  RunSetup fresh = *setup;
  for (FilterSetup::Entry& entry : fresh.filter->updates) {
    entry.update = entry.make_again();
    entry.rig = std::make_shared<Rig>(*entry.rig);
  }
  return fresh;
}

void require_finite(const Filter& filter) {
  const ImuState& imu = filter.imu();
  require(imu.R_GtoI.allFinite() && imu.p_IinG.allFinite() && imu.v_IinG.allFinite() &&
              imu.gyro_bias.allFinite() && imu.accel_bias.allFinite(),
          "the estimate is not finite, and the filter says that it is well");
  require(imu.R_GtoI.isUnitary(1e-6), "an orientation that is none");
  require(filter.covariance().allFinite() && filter.imu_covariance().allFinite(),
          "the covariance is not finite, and the filter says that it is well");
  for (const BlockEstimate& entry : calibration_of(filter)) {
    require(std::isfinite(entry.value) && std::isfinite(entry.sigma),
            "calibration that is not finite, and the filter says that it is well");
  }
}

/// What comes as it arrives, from a state that is given.
void estimator(Bytes bytes) {
  Choices choices(bytes);
  const std::size_t head = choices.raw<std::uint8_t>();
  const std::size_t with_wheels = (head & 0x20) != 0 ? kRelative : kWheels;
  const RunSetup setup = fresh_setup(head % 2 == 0 ? with_wheels : kCamera);
  Estimator estimator = make_estimator(*setup.filter, (head & 2) != 0);
  estimator.start(true_start());
  std::int64_t steps = 0;
  const auto step = [&] {
    while (estimator.step()) {
      require(++steps < 20'000, "epochs without end");
      if (estimator.failure().empty()) require_finite(estimator.filter());
    }
  };
  for (const Measurement& m : spoiled_drive(choices, (head & 4) != 0)) {
    if (const auto* imu = m.get_if<ImuSample>()) estimator.add(*imu);
    for (std::size_t i = 0; i < estimator.streams().size(); ++i) {
      if (*estimator.streams()[i].spec().type == m.view().type()) estimator.add(i, m.view());
    }
    step();
  }
  estimator.finish();
  step();
}

/// A whole run, with any of the starts, that begins anew when it diverges.
void whole_run(Bytes bytes) {
  Choices choices(bytes);
  const std::size_t head = choices.raw<std::uint8_t>();
  RunSetup setup = fresh_setup(head % kRobotsOfRuns);
  std::vector<Measurement> fixes, others;
  for (Measurement& m : spoiled_drive(choices, (head & 4) != 0)) {
    (m.get_if<GnssSample>() != nullptr ? fixes : others).push_back(std::move(m));
  }
  const auto source = [](SampleTypes types, std::vector<Measurement>& given) {
    return std::make_shared<testing::InMemory>(std::move(types), std::move(given));
  };
  testing::set_sensors(
      setup, {{"robot", source(sample_types<ImuSample, EncoderSample, PoseSample, StateSample,
                                            FeatureSample, CalibrationSample>(),
                               others)},
              {"fixes", source(sample_types<GnssSample>(), fixes)}});
  const RunData data = collect(setup);
  const RunResult result = run_filter(setup, data);
  require(result.epochs < 20'000, "epochs without end");
  require_well(result);
  if (result.status != RunStatus::kOk) return;
  for (const CalibrationTrack& track : result.calibration) {
    const auto is_finite = [](double value) { return std::isfinite(value); };
    require(std::all_of(track.estimate.begin(), track.estimate.end(), is_finite) &&
                std::all_of(track.sigma.begin(), track.sigma.end(), is_finite),
            "calibration that is not finite, and the run says that it is well");
  }
}

}  // namespace

std::vector<Target> filter_targets() {
  constexpr const char* kSources =
      "framework/estimator/src framework/filter/src framework/wheel/src framework/start/src "
      "plugins/updates plugins/shared/wheel_updates plugins/kinematics/four_wis_wid";
  return {
      {"filter", estimator, kSources},
      {"filter_run", whole_run, std::string(kSources) + " framework/feed/src framework/run/src"}};
}

}  // namespace viwo::fuzz
