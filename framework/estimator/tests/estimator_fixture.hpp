// An estimator with one update that writes down what it is given, and measurements for it.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "rejections.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo::testing {

/// Ends epochs; of several channels, each with a clock.
struct TickSample {
  std::int64_t t_ns = 0;
  int channel = 0;
  std::vector<double> values;
};

/// Stands for a cell of time, in a clock of its own.
struct CellSample {
  std::int64_t t_ns = 0;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  double rate = 0.;

  const char* fault() const {
    if (!std::isfinite(rate)) return "value that is not finite";
    return end_ns < begin_ns ? "sample that ends before it begins" : nullptr;
  }
};

/// Comes now and then; nothing waits for it.
struct FixSample {
  std::int64_t t_ns = 0;
  double value = 0.;

  const char* fault() const { return std::isfinite(value) ? nullptr : "value that is not finite"; }
};

}  // namespace viwo::testing

VIWO_SAMPLE(viwo::testing::TickSample, "ticks", 1, &viwo::testing::TickSample::t_ns,
            &viwo::testing::TickSample::channel, &viwo::testing::TickSample::values);
VIWO_SAMPLE(viwo::testing::CellSample, "cells", 1, &viwo::testing::CellSample::t_ns,
            &viwo::testing::CellSample::begin_ns, &viwo::testing::CellSample::end_ns,
            &viwo::testing::CellSample::rate);
VIWO_SAMPLE(viwo::testing::FixSample, "fixes", 1, &viwo::testing::FixSample::t_ns,
            &viwo::testing::FixSample::value);

namespace viwo::testing {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kStart = 1000 * kMs;

inline StreamSpec ticks_spec(int per_instant = 1) {
  StreamSpec spec;
  spec.type = &sample_type<TickSample>();
  spec.ends_epochs = true;
  spec.per_instant = per_instant;
  return spec;
}
inline StreamSpec cells_spec(BlockId clock) {
  StreamSpec spec;
  spec.type = &sample_type<CellSample>();
  spec.given = Given::kSinceOldestClone;
  spec.awaited = true;
  spec.clocks = {{0., clock}};
  return spec;
}
inline StreamSpec fixes_spec() {
  StreamSpec spec;
  spec.type = &sample_type<FixSample>();
  return spec;
}

/// What an update of the fixture works with.
struct Wants {
  bool cells = false;  ///< and the blocks `base`
  bool fixes = false;
  int ticks_per_instant = 1;
  double late_s = 0.004;  ///< the clock of the cells
};

/// What one call of an update was given.
struct Seen {
  std::int64_t begin_ns, end_ns;
  std::vector<ImuSample> imu;
  std::vector<TickSample> ticks;
  std::vector<CellSample> cells;
  std::vector<FixSample> fixes;
  std::vector<std::int64_t> clones;
  bool oldest_leaves;
};

/// Writes down what it is given, then does what the test wants.
class FakeUpdate final : public Update {
 public:
  using Emit = std::function<void(const FilterView&, FactorSink&)>;
  explicit FakeUpdate(Emit emit = {}, Wants wants = {}) : emit_(std::move(emit)), wants_(wants) {}
  void declare(Declarations& host) override {
    host.block(arm_mount());
    host.block(arm_numbers());
    if (wants_.cells) {
      host.block(base_mount());
      const BlockId clock = host.block(base_clock(wants_.late_s));
      host.block(base_numbers());
      cells_ = host.stream(cells_spec(clock));
    }
    ticks_ = host.stream(ticks_spec(wants_.ticks_per_instant));
    if (wants_.fixes) fixes_ = host.stream(fixes_spec());
  }
  void start(const UpdateSetup& given) override { setup = given; }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    Seen& now = seen.emplace_back();
    now.begin_ns = data.begin_ns;
    now.end_ns = data.end_ns;
    now.imu.assign(data.imu.begin(), data.imu.end());
    write_down<TickSample>(data, ticks_, now.ticks);
    write_down<CellSample>(data, cells_, now.cells);
    write_down<FixSample>(data, fixes_, now.fixes);
    for (const CloneState& clone : filter.clones) now.clones.push_back(clone.t_ns);
    now.oldest_leaves = filter.oldest_leaves;
    if (emit_) emit_(filter, sink);
  }
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"a reason of its own", 3, "there"});
  }

  UpdateSetup setup;
  std::vector<Seen> seen;

 private:
  template <class T>
  static void write_down(const EpochData& data, StreamId id, std::vector<T>& out) {
    if (id.index < 0) return;
    for (const T& sample : data.samples<T>(id)) out.push_back(sample);
  }

  Emit emit_;
  Wants wants_;
  StreamId ticks_, cells_, fixes_;
};

/// Readings that are straight lines in time, so that interpolation is exact.
inline ImuSample imu_at(std::int64_t t_ns) {
  const double t = seconds_between(kStart, t_ns);
  return {t_ns, {0.1 * t, -0.2 * t, 0.3 + 0.05 * t}, {0.4 * t, 0.1, 9.81 - 0.2 * t}};
}

inline TickSample tick_at(std::int64_t t_ns, int channel = 0) {
  return {t_ns, channel, {100. + channel, 200.}};
}

/// A cell of 10 ms that ends at `end_ns` in its own clock.
inline CellSample cell_at(std::int64_t end_ns) {
  return {end_ns - 5 * kMs, end_ns - 10 * kMs, end_ns, 1.};
}

/// What an estimator has rejected, without what its fake update says of itself.
inline Counts rejected_by(const Estimator& estimator) {
  Counts counts = counts_of(estimator);
  counts.erase("fake: a reason of its own");
  return counts;
}

/// For readings that grow and grow (imu_at).
inline EstimatorOptions any_motion() {
  EstimatorOptions options;
  options.imu.max_gyro_rad_per_s = options.imu.max_accel_m_per_s2 = 1e9;
  options.health.max_speed_m_per_s = 1e9;
  return options;
}

/// An estimator with one fake update.
struct Bench {
  std::shared_ptr<FakeUpdate> update;
  Estimator estimator;
  // Which of the estimator's streams is which; -1: it has none of that kind.
  int ticks, cells, fixes;

  explicit Bench(Wants wants = {}, const FakeUpdate::Emit& emit = {},
                 EstimatorOptions options = any_motion())
      : update(std::make_shared<FakeUpdate>(emit, wants)),
        estimator(options, {{"fake", update, nullptr, ""}}),
        ticks(find(sample_type<TickSample>())),
        cells(find(sample_type<CellSample>())),
        fixes(find(sample_type<FixSample>())) {}

  /// One that has been started at kStart.
  static Bench started(Wants wants = {}, const FakeUpdate::Emit& emit = {},
                       EstimatorOptions options = any_motion()) {
    Bench bench(wants, emit, options);
    bench.estimator.start(level_prior(kStart));
    return bench;
  }

  /// IMU samples every 10 ms of (from, to], ms after the start.
  void imu(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t t = from_ms + 10; t <= to_ms; t += 10) {
      estimator.add(imu_at(kStart + t * kMs));
    }
  }
  void add(const TickSample& tick) { estimator.add(static_cast<std::size_t>(ticks), tick); }
  void add(const CellSample& cell) { estimator.add(static_cast<std::size_t>(cells), cell); }
  void add(const FixSample& fix) { estimator.add(static_cast<std::size_t>(fixes), fix); }
  void tick(std::int64_t t_ms, int channel = 0) { add(tick_at(kStart + t_ms * kMs, channel)); }
  int steps() {
    int n = 0;
    while (estimator.step()) ++n;
    return n;
  }
  Counts rejected() const { return rejected_by(estimator); }

 private:
  int find(const SampleType& type) const {
    for (std::size_t i = 0; i < estimator.streams().size(); ++i) {
      if (*estimator.streams()[i].spec().type == type) return static_cast<int>(i);
    }
    return -1;
  }
};

inline void expect_same(const ImuSample& a, const ImuSample& b, double tolerance) {
  EXPECT_EQ(a.t_ns, b.t_ns);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.gyro_rad_per_s[i], b.gyro_rad_per_s[i], tolerance);
    EXPECT_NEAR(a.accel_m_per_s2[i], b.accel_m_per_s2[i], tolerance);
  }
}

}  // namespace viwo::testing
