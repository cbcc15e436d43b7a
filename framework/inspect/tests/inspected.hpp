// Recordings to inspect: those of simulated configurations, with one thing done to their samples.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/inspect/inspection.hpp"

namespace viwo::inspect {

/// What is done to the samples of each kind; false drops one.
struct Fault {
  std::function<bool(ImuSample&)> imu = [](ImuSample&) { return true; };
  std::function<bool(EncoderSample&)> wheels = [](EncoderSample&) { return true; };
  std::function<bool(FeatureSample&)> images = [](FeatureSample&) { return true; };
  std::function<bool(PoseSample&)> poses = [](PoseSample&) { return true; };
  std::function<bool(StateSample&)> states = [](StateSample&) { return true; };
};

inline RunSetup setup_of(const std::filesystem::path& file,
                         std::vector<std::string> assignments = {}) {
  return read_run(resolve_placeholders(load_run_configuration(file, assignments)),
                  testing::registry());
}

/// The calibration of a simulated run begins where it is.
inline RunSetup simulated(const std::string& name, std::vector<std::string> assignments = {}) {
  assignments.insert(assignments.begin(), "estimator.calibration_error_scale=0");
  return setup_of(testing::configuration("runs/" + name + ".yaml"), std::move(assignments));
}

inline RunSetup swerve() { return simulated("viwo_swerve", {"sensors.simulator0.duration_s=40"}); }

template <Sample T>
bool change(const Measurement& sample, const std::function<bool(T&)>& fault,
            std::vector<Measurement>& out) {
  const T* typed = sample.get_if<T>();
  if (typed == nullptr) return false;
  T changed = *typed;
  if (fault(changed)) out.emplace_back(changed);
  return true;
}

/// Its sensors become those that play back what they gave, changed: "imu0", "wheels0", "images0",
/// "poses0", "states0".
inline RunSetup changed(RunSetup setup, const Fault& fault) {
  std::map<std::string, std::vector<Measurement>> samples;
  for (SensorEntry& entry : setup.sensors) {
    for (Measurement sample; entry.sensor.object->next(sample) == Status::kOk;) {
      change<ImuSample>(sample, fault.imu, samples["imu0"]) ||
          change<EncoderSample>(sample, fault.wheels, samples["wheels0"]) ||
          change<FeatureSample>(sample, fault.images, samples["images0"]) ||
          change<PoseSample>(sample, fault.poses, samples["poses0"]) ||
          change<StateSample>(sample, fault.states, samples["states0"]);
    }
  }
  std::vector<std::pair<std::string, std::shared_ptr<Sensor>>> sensors;
  const auto add = [&](const std::string& name, const SampleType& type) {
    if (samples[name].empty()) return;
    sensors.emplace_back(
        name, std::make_shared<testing::InMemory>(SampleTypes{&type}, std::move(samples[name])));
  };
  add("imu0", sample_type<ImuSample>());
  add("wheels0", sample_type<EncoderSample>());
  add("images0", sample_type<FeatureSample>());
  add("poses0", sample_type<PoseSample>());
  add("states0", sample_type<StateSample>());
  testing::set_sensors(setup, sensors);
  return setup;
}

inline void scale(std::array<double, 3>& values, double factor) {
  for (double& value : values) value *= factor;
}

inline Inspection inspected(RunSetup setup, const Fault& fault) {
  RunSetup other = changed(std::move(setup), fault);
  return inspect(other);
}

inline Inspection with_wheels(RunSetup setup, const std::function<void(EncoderSample&)>& fault) {
  return inspected(std::move(setup), {.wheels = [&fault](EncoderSample& s) {
                     fault(s);
                     return true;
                   }});
}

/// Two drives on each side, as a base that skids has them.
inline RunSetup four_drives(const std::string& motion = "figure_eight") {
  return simulated("viwo_skid_steer",
                   {"placeholders.motion=" + motion, "sensors.simulator0.duration_s=30",
                    "sensors.simulator0.robot.left_drives=[1, 3]",
                    "sensors.simulator0.robot.right_drives=[2, 4]", "kinematics.left_drives=[1, 3]",
                    "kinematics.right_drives=[2, 4]"});
}

/// "imu0 gravity", ... of what is wrong.
inline std::vector<std::string> faults_of(const Inspection& inspection) {
  std::vector<std::string> faults;
  for (const Finding& finding : inspection.findings) {
    if (finding.severity == Severity::kFault) {
      faults.push_back(finding.sensor + " " + finding.check);
    }
  }
  return faults;
}

/// What a check says of a sensor; an empty one if it says nothing.
inline Finding finding_of(const Inspection& inspection, const std::string& sensor,
                          const std::string& check) {
  for (const Finding& finding : inspection.findings) {
    if (finding.sensor == sensor && finding.check == check) return finding;
  }
  return {};
}

inline double figure_of(const Finding& finding, const std::string& name) {
  for (const Figure& figure : finding.figures) {
    if (figure.name == name) return figure.value;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// The value that is to be written, or "".
inline std::string remedy_of(const Finding& finding, const std::string& key) {
  for (const Remedy& remedy : finding.remedies) {
    if (remedy.key == key) return remedy.value;
  }
  return "";
}

/// Real recordings, where they are.
inline std::filesystem::path shared_data() {
  return std::filesystem::path(VIWO_TEST_SOURCE_DIR) / "../shared/data";
}

/// Of two wheels, without a filter.
inline RunSetup two_drives(const std::vector<std::string>& more = {}) {
  std::vector<std::string> all{"sensors.simulator0.duration_s=30"};
  all.insert(all.end(), more.begin(), more.end());
  RunSetup setup = simulated("viwo_skid_steer", all);
  setup.filter.reset();
  return setup;
}

/// By poses, without an IMU.
inline Inspection by_poses_alone(RunSetup setup, const std::function<void(EncoderSample&)>& fault) {
  return inspected(std::move(setup), {.imu = [](ImuSample&) { return false; },
                                      .wheels =
                                          [&fault](EncoderSample& s) {
                                            fault(s);
                                            return true;
                                          }});
}

}  // namespace viwo::inspect
