// An estimator with one update that writes down what it is given, and measurements for it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/estimator.hpp"

namespace viwo::testing {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kStart = 1000 * kMs;

/// What one call of an update was given.
struct Seen {
  std::int64_t begin_ns, end_ns;
  std::vector<ImuSample> imu;
  std::vector<FeatureSample> features;
  std::vector<EncoderSample> encoders;
  std::vector<PoseSample> poses;
  std::vector<std::int64_t> clones;
  bool oldest_leaves;
};

/// Writes down what it is given, then does what the test wants.
class FakeUpdate final : public Update {
 public:
  using Emit = std::function<void(const FilterView&, FactorSink&)>;
  explicit FakeUpdate(Emit emit = {}) : emit_(std::move(emit)) {}
  UpdateKind kind() const override { return UpdateKind::kBody; }
  void start(const UpdateSetup& given) override { setup = given; }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    Seen& now = seen.emplace_back();
    now.begin_ns = data.begin_ns;
    now.end_ns = data.end_ns;
    now.imu.assign(data.imu.begin(), data.imu.end());
    now.features.assign(data.features.begin(), data.features.end());
    now.encoders.assign(data.encoders.begin(), data.encoders.end());
    now.poses.assign(data.poses.begin(), data.poses.end());
    for (const CloneView& clone : filter.clones) now.clones.push_back(clone.t_ns);
    now.oldest_leaves = filter.oldest_leaves;
    if (emit_) emit_(filter, sink);
  }
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"a reason of its own", 3, "there"});
  }

  UpdateSetup setup;
  std::vector<Seen> seen;

 private:
  Emit emit_;
};

/// Readings that are straight lines in time, so that interpolation is exact.
inline ImuSample imu_at(std::int64_t t_ns) {
  const double t = seconds_between(kStart, t_ns);
  return {t_ns, {0.1 * t, -0.2 * t, 0.3 + 0.05 * t}, {0.4 * t, 0.1, 9.81 - 0.2 * t}};
}

inline FeatureSample image_at(std::int64_t t_ns, int camera = 0) {
  return {t_ns, camera, {{7, 100. + camera, 50.}, {9, 200., 60.}}};
}

/// A cell of 10 ms that ends at `end_ns` in the wheel clock.
inline EncoderSample encoder_at(std::int64_t end_ns) {
  EncoderSample sample;
  sample.t_ns = end_ns - 5 * kMs;
  sample.begin_ns = end_ns - 10 * kMs;
  sample.end_ns = end_ns;
  sample.n_drive = 2;
  return sample;
}

/// An estimator with one fake update that sees the encoders, if there are any.
struct Rig {
  std::shared_ptr<FakeUpdate> update;
  Estimator estimator;

  explicit Rig(bool with_wheels = false, const FakeUpdate::Emit& emit = {},
               EstimatorOptions options = {}, double t_OtoI_s = 0.004)
      : update(std::make_shared<FakeUpdate>(emit)),
        estimator(options, {camera_prior()}, wheels(with_wheels, t_OtoI_s),
                  {{"fake", update, with_wheels ? 0 : -1}}) {
    estimator.start(level_prior(kStart));
  }

  static std::vector<WheelsPrior> wheels(bool with_wheels, double t_OtoI_s) {
    if (!with_wheels) return {};
    WheelsPrior prior = wheels_prior();
    prior.wheels.t_OtoI_s = t_OtoI_s;
    return {prior};
  }

  /// IMU samples every 10 ms of (from, to], ms after the start.
  void imu(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t t = from_ms + 10; t <= to_ms; t += 10) {
      estimator.add(imu_at(kStart + t * kMs));
    }
  }
  void image(std::int64_t t_ms, int camera = 0) {
    estimator.add(image_at(kStart + t_ms * kMs, camera));
  }
  int steps() {
    int n = 0;
    while (estimator.step()) ++n;
    return n;
  }
  std::map<std::string, std::int64_t> rejected() const {
    std::map<std::string, std::int64_t> counts;
    for (const RejectionCount& r : estimator.rejections()) counts[r.reason] += r.count;
    counts.erase("fake: a reason of its own");
    return counts;
  }
};

using Counts = std::map<std::string, std::int64_t>;

inline void expect_same(const ImuSample& a, const ImuSample& b, double tolerance) {
  EXPECT_EQ(a.t_ns, b.t_ns);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.gyro_rad_per_s[i], b.gyro_rad_per_s[i], tolerance);
    EXPECT_NEAR(a.accel_m_per_s2[i], b.accel_m_per_s2[i], tolerance);
  }
}

}  // namespace viwo::testing
