// Reading the sensors of a run.
#include <algorithm>
#include <utility>

#include "channels.hpp"
#include "has_next.hpp"
#include "sample_gate.hpp"
#include "viwo/feed/inputs.hpp"
#include "viwo/feed/run_data.hpp"
#include "viwo/math/arrays.hpp"

namespace viwo {
namespace {

StampedPose planar_pose(std::int64_t t_ns, const std::array<double, 3>& p,
                        const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd about_z(yaw(q), Eigen::Vector3d::UnitZ());
  return {t_ns, {p[0], p[1], 0.}, Eigen::Quaterniond(about_z)};
}

void require_channels(const RunSetup& setup, const Recorded& recorded) {
  for (const Recorded::Track& track : recorded.tracks()) {
    const auto samples = recorded.of<EncoderSample>(track.sensor);
    if (!samples.empty()) require_channels(setup, track.sensor, samples.front());
  }
}

/// What was promised has been given. What a stream gives is still to be seen.
void require_what_the_filter_needs(const RunSetup& setup, const RunData& data) {
  const auto fail = [&](const std::string& text) { config::fail(setup.sensors_mark, text); };
  if (data.imu().empty()) fail("no sensor of this run gave IMU samples");
  if (setup.filter->start.mode == StartMode::kReference && data.states().empty()) {
    fail(
        "no sensor of this run gave reference states, which estimator.start: reference needs - "
        "choose start: standstill or moving");
  }
  for (const Route& route : setup.routes.all()) {
    if (route.consumer != Consumer::kStream) continue;
    const SharedStream& stream = setup.filter->streams[route.stream];
    const bool is_stream = std::any_of(data.streams.begin(), data.streams.end(),
                                       [&](const auto& s) { return s.name == route.sensor; });
    // Without images or tracks a filter goes on: there may be darkness from the first second.
    if (is_stream || stream.spec.optional || stream.spec.ends_epochs) continue;
    if (data.recorded.find(route.sensor, *route.type) != nullptr) continue;
    fail("sensor '" + route.sensor + "' gave no " + route.type->name + ", which " + stream.takers +
         " needs");
  }
}

/// Sorts what the sensors of a run give into the data of the run.
class Collector {
 public:
  Collector(const RunSetup& setup, RunData& data) : setup_(setup), data_(data) {
    data.wheels_name = setup.routes.sensor_of(Consumer::kWheels);
  }

  void add(const std::string& sensor, const Measurement& measurement) {
    const SampleView sample = measurement.view();
    bool is_wanted = false;
    setup_.routes.dispatch(sensor, sample.type(), [&](const Route& route) {
      if (route.consumer == Consumer::kReferencePoses) {
        if (gate_.accept(sensor, sample)) add_reference(*sample.get_if<PoseSample>());
      } else if (route.consumer == Consumer::kTrueCalibration) {
        const auto& truth = *sample.get_if<CalibrationSample>();
        data_.calibration[truth.name] = truth.value;
      } else {
        is_wanted = true;
      }
    });
    // What goes to the estimator is looked at there.
    const bool is_measured = setup_.filter && sample.get_if<StateSample>() == nullptr;
    if (is_wanted && (is_measured || gate_.accept(sensor, sample))) {
      data_.recorded.add(sensor, sample);
    }
  }
  void report() const { gate_.append_to(data_.rejections); }

 private:
  void add_reference(const PoseSample& sample) {
    const StampedPose pose = stamped_pose(sample);
    data_.reference.push_back(setup_.filter ? pose
                                            : planar_pose(pose.t_ns, sample.p_BinW_m, pose.q_BtoW));
  }

  const RunSetup& setup_;
  RunData& data_;
  SampleGate gate_;
};

/// Whether a sensor may be read while the filter runs: what else than streams it gives, such as
/// true values, must be known before.
bool gives_only_streams(const RunSetup& setup, const SensorEntry& entry) {
  const auto routes = setup.routes.all();
  return std::all_of(routes.begin(), routes.end(), [&](const Route& route) {
    return route.sensor != entry.name || route.consumer == Consumer::kStream;
  });
}

/// Sensors that can be played have a parameter of this name.
bool is_played(const SensorEntry& entry) {
  const config::Node* const lockstep = entry.sensor.resolved.find("lockstep");
  return lockstep != nullptr && lockstep->is_scalar() && lockstep->scalar() == "true";
}

/// The live sensors of a run and those that work on them, unread.
RunData listen(const RunSetup& setup) {
  RunData data;
  for (const SensorEntry& entry : setup.sensors) {
    const Loaded<Sensor>& sensor = entry.sensor;
    const SensorStream stream{entry.name, sensor.info, sensor.object, entry.input, nullptr};
    if (is_live(entry)) {
      if (!data.live.empty() && is_played(entry) != data.lockstep) {
        config::fail(setup.sensors_mark, "sensor '" + entry.name + "' and '" +
                                             data.live.front().name +
                                             "': lockstep is for all live sensors or for none");
      }
      data.lockstep = is_played(entry);
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
    if (setup.filter && input != nullptr && !inputs.is_input(entry) &&
        gives_only_streams(setup, entry)) {
      data.streams.push_back(
          {entry.name, sensor.info, sensor.object, entry.input, std::move(input)});
      continue;
    }
    Status answer = Status::kOk;
    guarded(sensor.info, "next", [&] {
      Measurement measurement;
      while ((answer = sensor.object->next(measurement)) == Status::kOk) {
        inputs.keep(entry, measurement);
        collector.add(entry.name, measurement);
      }
      std::vector<RejectionCount> rejections;
      sensor.object->rejections(rejections);
      for (RejectionCount& rejection : rejections) {
        data.rejections.emplace_back(entry.name, rejection);
      }
    });
    require_answer(sensor.info, answer);
  }
  collector.report();
  require_channels(setup, data.recorded);
  if (setup.filter) {
    require_what_the_filter_needs(setup, data);
    return data;
  }
  if (data.wheels().empty()) {
    config::fail(setup.sensors_mark, "no sensor of this run gave encoder samples");
  }
  // States are those of the IMU: then it is the reference body.
  if (!data.states().empty() && setup.O_in_I) {
    setup.extrinsics = *setup.O_in_I;
    if (!setup.knows_reference_time_offset) setup.reference_time_offset_s = setup.t_OtoI_s;
  }
  for (const StateSample& state : data.states()) {
    data.reference.push_back(
        planar_pose(state.t_ns, state.p_IinG_m, to_quaternion(state.q_ItoG_xyzw)));
  }
  return data;
}

}  // namespace viwo
