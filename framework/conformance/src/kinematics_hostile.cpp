// Input that no robot gives, but a broken log does.
#include <cmath>
#include <functional>
#include <limits>

#include "kinematics.hpp"

namespace viwo::conformance {

using robot::Answer;
using robot::Bench;
using robot::Probe;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

struct Value {
  const char* name;
  double value;
};
constexpr Value kNotFinite[] = {{"NaN", kNan}, {"inf", kInf}, {"-inf", -kInf}, {"1e300", 1e300}};
constexpr Value kAbsurd[] = {{"1e6", 1e6}, {"-1e6", -1e6}, {"5e-324", 5e-324}};

/// Calls, and turns what is thrown into a failure; a crash ends the process, which says so itself.
void expect_answer(const std::string& what, const std::function<void()>& call, Findings& findings) {
  try {
    call();
  } catch (const PluginFailure& error) {
    findings.fail(what + ": threw '" + error.text() + "' - answer Status::kRejected");
  }
}

bool is_finite(const Answer& a) {
  return a.rows.A.allFinite() && a.rows.b.allFinite() && a.by_x.J.allFinite() &&
         a.by_x.DtE.allFinite() && a.by_n.J.allFinite() && a.by_n.DtE.allFinite();
}

/// One channel of a reading on an arc replaced.
void try_channels(const Bench& bench, const Probe& good, const Value& value, bool must_be_finite,
                  Findings& findings) {
  const int n_drive = bench.description().n_drive;
  for (int i = 0; i < n_drive + bench.description().n_steer; ++i) {
    Probe probe = good;
    const bool drives = i < n_drive;
    const int channel = drives ? i : i - n_drive;
    auto& values = drives ? probe.y.drive_rad_per_s : probe.y.steer_rad;
    values[static_cast<std::size_t>(channel)] = value.value;
    const std::string what = std::string(drives ? "drive " : "steering ") +
                             std::to_string(channel) + " reads " + value.name;
    expect_answer(
        what,
        [&] {
          const Answer answer = bench.answer(probe);
          if (answer.status != Status::kOk || !must_be_finite || is_finite(answer)) return;
          findings.fail(what +
                        ": the answer is kOk with numbers that are not finite - answer "
                        "Status::kRejected");
        },
        findings);
  }
}

}  // namespace

void check_hostile_readings(const Bench& bench, Findings& findings) {
  std::mt19937_64 rng(2);
  Probe good;
  good.x_WI = bench.nominal();
  good.xi = Twist(0.5, 0., 0.6);
  good.y = bench.zero_reading();
  good.e = RowVector::Constant(bench.description().n_rows, 0.1);
  bench.follow(good.x_WI, good.xi, good.y);
  for (const Value& value : kNotFinite) try_channels(bench, good, value, false, findings);
  for (const Value& value : kAbsurd) try_channels(bench, good, value, true, findings);
  for (const int channels : {0, 1, kMaxDrives}) {
    Probe probe = good;
    probe.y.n_drive = channels;
    probe.y.n_steer = std::min(channels, kMaxSteers);
    expect_answer(
        "a reading with " + std::to_string(channels) + " channels", [&] { bench.answer(probe); },
        findings);
  }
}

void check_hostile_arguments(const Bench& bench, Findings& findings) {
  Probe good;
  good.x_WI = bench.nominal();
  good.xi = Twist(0.5, 0., 0.6);
  good.y = bench.zero_reading();
  good.e = RowVector::Constant(bench.description().n_rows, 0.1);
  const RowVector no_slip = RowVector::Zero(bench.description().n_rows);
  for (const Value& value : {Value{"NaN", kNan}, Value{"inf", kInf}, Value{"0", 0.}}) {
    for (int k = 0; k < bench.n_x(); ++k) {
      Probe probe = good;
      probe.x_WI[k] = value.value;
      const std::string& name = bench.description().intrinsics[static_cast<std::size_t>(k)].name;
      expect_answer(
          "intrinsic '" + name + "' is " + value.name, [&] { bench.answer(probe); }, findings);
    }
    for (int j = 0; j < 3; ++j) {
      Probe probe = good;
      probe.xi[j] = value.value;
      EncoderSample y = probe.y;
      const std::string what = "entry " + std::to_string(j) + " of ";
      expect_answer(
          what + "the twist is " + value.name, [&] { bench.answer(probe); }, findings);
      expect_answer(
          what + "the twist of inverse() is " + value.name,
          [&] { bench.model().inverse(probe.xi, probe.x_WI, no_slip, y); }, findings);
      Eigen::Vector3d g = Eigen::Vector3d::Zero();
      g[j] = value.value;
      Intrinsics x_WI = good.x_WI;
      expect_answer(
          what + "the frame of move_frame() is " + value.name,
          [&] { bench.model().move_frame(g, x_WI); }, findings);
    }
  }
}

}  // namespace viwo::conformance
