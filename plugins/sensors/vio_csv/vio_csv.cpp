// Sensor vio_csv: inertial measurements, feature tracks and reference states as other
// visual-inertial simulators export them (model.md).
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

struct Params : log::LimitParams {
  std::filesystem::path folder;
  bool imu = true;
  bool features = true;
  bool truth = true;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(folder),
      {.required = true,
       .help = "where imu.csv, features.csv and groundtruth.csv are, plain or gzipped"});
    b(VIWO_PARAM(imu), {.help = "read imu.csv"});
    b(VIWO_PARAM(features), {.help = "read features.csv"});
    b(VIWO_PARAM(truth),
      {.help = "read groundtruth.csv, or init_state.csv where there is no groundtruth.csv"});
    log::LimitParams::bind(b);
  }
};

bool is_there(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

template <std::size_t N>
std::array<std::size_t, N> columns(const log::TableReader& table,
                                   const std::array<const char*, N>& names) {
  std::array<std::size_t, N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = table.column(names[i]);
  return out;
}

template <std::size_t N>
void read_numbers(const log::TableReader& table, const std::array<std::size_t, N>& from,
                  std::array<double, N>& out) {
  for (std::size_t i = 0; i < N; ++i) out[i] = table.number(from[i]);
}

log::ImuRecording read_imu(const fs::path& folder, const LogLimits& limits) {
  log::TableReader table(log::table_in(folder, "imu.csv"));
  const std::size_t t = table.column("t");
  const auto gyro = columns<3>(table, {"wx", "wy", "wz"});
  const auto accel = columns<3>(table, {"ax", "ay", "az"});
  log::ImuCollector collector(limits);
  while (table.next()) {
    ImuSample imu;
    imu.t_ns = table.seconds_ns(t);
    read_numbers(table, gyro, imu.gyro_rad_per_s);
    read_numbers(table, accel, imu.accel_m_per_s2);
    collector.add(imu, table.reader());
  }
  return collector.finish(table.reader());
}

log::FeatureRecording read_features(const fs::path& folder, const LogLimits& limits) {
  log::TableReader table(log::table_in(folder, "features.csv"));
  const std::size_t t = table.column("t");
  const std::size_t camera = table.column("cam_id");
  const std::size_t id = table.column("feat_id");
  const std::size_t u = table.column("u");
  const std::size_t v = table.column("v");
  log::FeatureCollector collector(limits);
  while (table.next()) {
    const FeaturePoint point{table.integer(id), table.number(u), table.number(v)};
    collector.add(table.seconds_ns(t), log::camera_index(table, camera), point, table.reader());
  }
  return collector.finish(table.reader());
}

log::StateRecording read_states(const fs::path& folder, const LogLimits& limits) {
  const fs::path truth = log::table_in(folder, "groundtruth.csv");
  const fs::path start = log::table_in(folder, "init_state.csv");
  log::TableReader table(!is_there(truth) && is_there(start) ? start : truth);
  const std::size_t t = table.column("t");
  const auto q = columns<4>(table, {"qx", "qy", "qz", "qw"});
  const auto p = columns<3>(table, {"px", "py", "pz"});
  const auto v = columns<3>(table, {"vx", "vy", "vz"});
  const auto gyro_bias = columns<3>(table, {"bgx", "bgy", "bgz"});
  const auto accel_bias = columns<3>(table, {"bax", "bay", "baz"});
  log::StateCollector collector(limits);
  while (table.next()) {
    StateSample state;
    state.t_ns = table.seconds_ns(t);
    read_numbers(table, q, state.q_ItoG_xyzw);  // JPL's q_GtoI has the numbers of Hamilton's q_ItoG
    read_numbers(table, p, state.p_IinG_m);
    read_numbers(table, v, state.v_IinG_m_per_s);
    read_numbers(table, gyro_bias, state.gyro_bias_rad_per_s);
    read_numbers(table, accel_bias, state.accel_bias_m_per_s2);
    collector.add(state, table.reader());
  }
  return collector.finish(table.reader());
}

/// A recording and how far it has been played.
template <class Sample>
struct Track {
  log::Recording<Sample> recording;
  std::size_t next = 0;

  bool has_next() const { return next < recording.samples.size(); }
  std::int64_t next_ns() const { return recording.samples[next].t_ns; }
};

class VioCsv final : public Sensor {
 public:
  VioCsv(const Params& params, const HostServices& /*services*/) {
    const fs::path folder = params.folder;
    const LogLimits limits = params.limits();
    if (!params.imu && !params.features && !params.truth) {
      throw ParamError("folder", "nothing to read: imu, features and truth are all false");
    }
    if (params.truth) keep(states_, read_states(folder, limits));
    if (params.imu) keep(imu_, read_imu(folder, limits));
    if (params.features) keep(features_, read_features(folder, limits));
  }

  SampleTypes yields() const override { return yields_; }

  Status next(Measurement& out) override {
    // The first of the earliest: states before inertial measurements before images.
    const bool states_first = !precedes(imu_, states_) && !precedes(features_, states_);
    if (states_.has_next() && states_first) return take(states_, out);
    if (imu_.has_next() && !precedes(features_, imu_)) return take(imu_, out);
    return take(features_, out);
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    const auto append = [&out](const std::vector<RejectionCount>& more) {
      out.insert(out.end(), more.begin(), more.end());
    };
    append(states_.recording.rejections);
    append(imu_.recording.rejections);
    append(features_.recording.rejections);
  }

 private:
  template <class Sample>
  void keep(Track<Sample>& track, log::Recording<Sample> recording) {
    track.recording = std::move(recording);
    yields_.push_back(&sample_type<Sample>());
  }

  template <class A, class B>
  static bool precedes(const Track<A>& a, const Track<B>& b) {
    return a.has_next() && b.has_next() && a.next_ns() < b.next_ns();
  }

  template <class Sample>
  static Status take(Track<Sample>& track, Measurement& out) {
    if (!track.has_next()) return Status::kEnd;
    out = std::move(track.recording.samples[track.next++]);
    return Status::kOk;
  }

  Track<StateSample> states_;
  Track<ImuSample> imu_;
  Track<FeatureSample> features_;
  SampleTypes yields_;
};

VIWO_REGISTER(Sensor, VioCsv, "vio_csv", "1.0.0",
              "inertial measurements, feature tracks and reference states from CSV exports",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
