// Reading the sensors of a run.
#include <algorithm>
#include <utility>

#include "inputs.hpp"
#include "sources.hpp"
#include "viwo/experiment/run.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::experiment {
namespace {

StampedPose planar_pose(std::int64_t t_ns, const std::array<double, 3>& p,
                        const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd about_z(yaw(q), Eigen::Vector3d::UnitZ());
  return {t_ns, {p[0], p[1], 0.}, Eigen::Quaterniond(about_z)};
}

/// A model's complaint about the channels of a sensor, at the position of the model or the sensors.
void require_channels(const WheelModel& model, const config::Mark& mark,
                      const EncoderSample& sample, const std::string& sensor) {
  try {
    model.require_channels(sample, "sensors." + sensor);
  } catch (const InputError& error) {
    config::fail(mark, error.what());
  }
}

/// The same for the first sample of a sensor that gives those of a further wheel set.
void require_channels_of_set(const RunSetup& setup, const EncoderSample& sample,
                             const std::string& sensor) {
  for (const WheelSet& wheels : setup.filter->wheels) {
    if (wheels.sensor != sensor) continue;
    require_channels(*wheels.model, setup.sensors_mark, sample, sensor);
  }
}

/// What every update measures with has been given. What a stream gives is still to be seen.
void require_what_the_updates_need(const RunSetup& setup, const RunData& data) {
  const FilterSetup& filter = *setup.filter;
  for (const FilterSetup::Entry& update : filter.updates) {
    const auto require = [&](const std::string& sensor, bool is_given, const char* what) {
      const bool is_stream = std::any_of(data.streams.begin(), data.streams.end(),
                                         [&](const auto& s) { return s.name == sensor; });
      if (is_given || is_stream) return;
      const std::string who =
          sensor.empty() ? "no sensor of this run gave " : "sensor '" + sensor + "' gave no ";
      config::fail(update.mark, who + what + ", which update " + update.name + " needs");
    };
    if (update.wheels >= 0) {
      const std::string& sensor = filter.wheels[static_cast<std::size_t>(update.wheels)].sensor;
      require(sensor, !encoder_samples(data, sensor).empty(), kEncoderSamples);
    }
    if (update.poses >= 0) {
      const std::string& sensor = filter.pose_sensors[static_cast<std::size_t>(update.poses)];
      require(sensor, !pose_samples(data, sensor).empty(), "poses");
    }
  }
}

void require_what_the_filter_needs(const RunSetup& setup, const RunData& data) {
  if (data.imu.empty()) config::fail(setup.sensors_mark, "no sensor of this run gave IMU samples");
  if (setup.filter->start.mode == StartMode::kReference && data.states.empty()) {
    config::fail(setup.sensors_mark,
                 "no sensor of this run gave reference states, which estimator.start: reference "
                 "needs - choose start: standstill or moving");
  }
  require_what_the_updates_need(setup, data);
}

/// Sorts what the sensors of a run give into the data of the run.
class Collector {
 public:
  Collector(const RunSetup& setup, RunData& data) : setup_(setup), data_(data) {
    if (!setup.filter || setup.filter->wheels.empty()) return;
    const auto& sets = setup.filter->wheels;
    wheels_sensor_ = sets.front().sensor;
    some_set_is_unnamed_ =
        std::any_of(sets.begin(), sets.end(), [](const auto& set) { return set.sensor.empty(); });
  }

  void add(const std::string& sensor, const Measurement& measurement) {
    std::visit([&](const auto& sample) { add(sensor, sample); }, measurement);
  }

 private:
  void claim(std::string& owner, const std::string& sensor, const char* what) const {
    experiment::claim(owner, sensor, what, setup_.sensors_mark);
  }

  void add(const std::string& sensor, const EncoderSample& sample) {
    if (some_set_is_unnamed_) claim(encoders_name_, sensor, kEncoderSamples);
    if (!wheels_sensor_.empty() && sensor != wheels_sensor_) {
      auto& samples = data_.other_wheels[sensor];
      if (samples.empty()) require_channels_of_set(setup_, sample, sensor);
      samples.push_back(sample);
      return;
    }
    claim(data_.wheels_name, sensor, kEncoderSamples);
    if (data_.samples.empty() && setup_.model) {
      require_channels(*setup_.model, setup_.kinematics_mark, sample, sensor);
    }
    data_.samples.push_back(sample);
  }
  void add(const std::string& sensor, const PoseSample& pose) {
    const auto& measured = setup_.measured_poses;
    if (std::find(measured.begin(), measured.end(), sensor) != measured.end()) {
      data_.poses[sensor].push_back(pose);
      return;
    }
    claim(reference_name_, sensor, kReferencePoses);
    const Eigen::Quaterniond q_BtoW = to_quaternion(pose.q_BtoW_xyzw).normalized();
    data_.reference.push_back(setup_.filter
                                  ? StampedPose{pose.t_ns, to_vector(pose.p_BinW_m), q_BtoW}
                                  : planar_pose(pose.t_ns, pose.p_BinW_m, q_BtoW));
  }
  void add(const std::string& sensor, const ImuSample& imu) {
    claim(imu_name_, sensor, kImuSamples);
    data_.imu.push_back(imu);
  }
  void add(const std::string& sensor, const FeatureSample& image) {
    claim(data_.tracks_name, sensor, kTracks);
    data_.images.push_back(image);
  }
  void add(const std::string& sensor, const StateSample& state) {
    claim(reference_name_, sensor, "reference states");
    data_.states.push_back(state);
  }
  void add(const std::string& /*sensor*/, const CalibrationSample& truth) {
    data_.calibration[truth.name] = truth.value;
  }
  void add(const std::string& sensor, const ImageSample& image) {
    claim(pixels_name_, sensor, "the pixels of images");
    data_.pixels.push_back(image);
  }

  const RunSetup& setup_;
  RunData& data_;
  std::string wheels_sensor_, encoders_name_, reference_name_, imu_name_, pixels_name_;
  bool some_set_is_unnamed_ = false;  ///< then only one sensor gives encoder samples
};

/// The live sensors of a run and those that work on them, unread.
RunData listen(const RunSetup& setup) {
  RunData data;
  for (const SensorEntry& entry : setup.sensors) {
    const Loaded<Sensor>& sensor = entry.sensor;
    const SensorStream stream{entry.name, sensor.info, sensor.object, entry.input, nullptr};
    if (is_live(entry)) {
      data.live.push_back(stream);
      continue;
    }
    const bool works_on_live = std::any_of(data.live.begin(), data.live.end(),
                                           [&](const auto& s) { return s.name == entry.input; });
    if (!works_on_live) {
      config::fail(setup.sensors_mark, "sensor '" + entry.name + "' plays something back, but '" +
                                           data.live.front().name +
                                           "' is live: the two do not go together");
    }
    data.streams.push_back(stream);
  }
  if (!setup.filter) {
    config::fail(setup.sensors_mark, "sensor '" + data.live.front().name +
                                         "' is live, which needs the filter (a section 'updates')");
  }
  if (setup.filter->start.mode == StartMode::kReference) {
    config::fail(setup.sensors_mark, "sensor '" + data.live.front().name +
                                         "' is live: choose estimator.start: standstill or moving");
  }
  return data;
}

}  // namespace

RunData collect(RunSetup& setup, LiveSensors live) {
  // Behind the live ones, whichever was written first.
  std::stable_partition(setup.sensors.begin(), setup.sensors.end(), is_live);
  if (live == LiveSensors::kAllowed && !setup.sensors.empty() && is_live(setup.sensors.front())) {
    return listen(setup);
  }
  RunData data;
  Collector collector(setup, data);
  Inputs inputs(setup.sensors);
  for (const SensorEntry& entry : setup.sensors) {
    require_no_live_sensor(setup, entry);
    const Loaded<Sensor>& sensor = entry.sensor;
    auto input = inputs.connect(entry);
    if (setup.filter && input != nullptr && !inputs.is_input(entry)) {
      data.streams.push_back(
          {entry.name, sensor.info, sensor.object, entry.input, std::move(input)});
      continue;
    }
    guarded(sensor.info, "next", [&] {
      Measurement measurement;
      while (sensor.object->next(measurement) == Status::kOk) {
        inputs.keep(entry, measurement);
        collector.add(entry.name, measurement);
      }
      std::vector<RejectionCount> rejections;
      sensor.object->rejections(rejections);
      for (RejectionCount& rejection : rejections) {
        data.rejections.emplace_back(entry.name, rejection);
      }
    });
  }
  // Of a sensor that also knows the states, poses are measurements, here without an update.
  if (!data.states.empty()) data.reference.clear();
  if (setup.filter) {
    require_what_the_filter_needs(setup, data);
    return data;
  }
  if (data.samples.empty()) {
    config::fail(setup.sensors_mark, "no sensor of this run gave encoder samples");
  }
  // States are those of the IMU: then it is the reference body.
  if (!data.states.empty() && setup.O_in_I) setup.extrinsics = *setup.O_in_I;
  for (const StateSample& state : data.states) {
    data.reference.push_back(
        planar_pose(state.t_ns, state.p_IinG_m, to_quaternion(state.q_ItoG_xyzw)));
  }
  return data;
}

}  // namespace viwo::experiment
