// A differential drive with one mistake, which its name says; without it the model is right.
#include <atomic>
#include <cmath>
#include <csignal>
#include <string>
#include <thread>

#include "viwo/api/plugin.hpp"

/// "broken_<defect>": of the library that this is linked into.
extern const char kPluginName[];

namespace viwo {
namespace {

bool is(std::string_view defect) {
  return std::string_view(kPluginName).substr(std::string_view("broken_").size()) == defect;
}

struct Params {
  double radius_m = 0.05;
  double baseline_m = 0.3;

  void bind(ParamBinder& b) {
    b(is("name_without_unit") ? "radius" : "radius_m", radius_m,
      {.unit = "m", .above = 0., .help = is("no_help") ? "" : "radius of both wheels"});
    b(VIWO_PARAM(baseline_m), {.unit = "m", .above = 0., .help = "distance between the wheels"});
  }
};

double shared_radius_m = 0.;

class Broken final : public KinematicModel {
 public:
  Broken(const Params& params, const HostServices& /*services*/) : params_(params) {
    if (is("throws_at_the_edge") && params_.baseline_m < 1e-6) throw std::logic_error("too narrow");
    if (is("shared") || shared_radius_m == 0.) shared_radius_m = params_.radius_m;
    if (is("first_instance")) params_.baseline_m = 0.3;
  }

  void describe(ModelDescription& out) const override {
    const double r = is("shared") || is("first_instance") ? shared_radius_m : params_.radius_m;
    out.n_drive = 2;
    out.n_rows = 3;
    out.constant_A = true;
    const RowRange baseline_rows = is("row_range") ? RowRange{0, 1} : RowRange{0, 2};
    out.intrinsics = {
        {"r_left", "m", r, 0.001, is("gauge"), {0, 1}},
        {"r_right", is("no_unit") ? "" : "m", r, 0.001, false, {1, 1}},
        {"baseline", "m", params_.baseline_m, is("prior") ? 0. : 0.01, false, baseline_rows}};
    out.noises = {{NoiseKind::kDrive, 0, 0.001, {0, 1}},
                  {NoiseKind::kDrive, is("channel") ? 2 : 1, is("noise") ? -0.001 : 0.001, {1, 1}},
                  {NoiseKind::kSlip, 0, 0.001, {2, 1}}};
    if (is("rows_without_noise")) out.noises.pop_back();
  }

  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool /*A_is_current*/,
              RowSystem& out) const override {
    const auto& drive = y.drive_rad_per_s;
    if (is("crash") && std::isnan(drive[0])) std::raise(SIGSEGV);
    if (is("throws") && !std::isfinite(drive[0])) throw std::domain_error("not a number");
    if (is("endless") && std::isnan(drive[0])) {
      for (;;) std::this_thread::yield();
    }
    double extra = 0.;
    if (is("race")) ++unsynchronised_calls_;  // only the thread sanitizer sees it
    if (is("random")) extra = 1e-12 * ++calls_;
    out.A << 1., 0., left() * x_WI[2], 1., 0., 0.5 * x_WI[2], 0., 1., 0.;
    if (is("constant_A")) out.A(2, 0) = 1e-3 * drive[0];
    out.b << x_WI[0] * drive[0] + extra, x_WI[1] * drive[1], 0.;
    cached_ = out.b[0];
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& /*y*/, const Intrinsics& x_WI,
                             const RowSystem& rows, const RowVector& b, const Twist& xi,
                             const RowVector& e, IntrinsicDerivatives& out) const override {
    const RowVector& signal = is("measured") ? rows.b : b;
    out.J(0, 0) = (is("cache") ? cached_.load() : signal[0]) / x_WI[0];
    out.J(1, 1) = signal[1] / x_WI[1];
    out.J(0, 2) = -left() * xi.z();
    out.J(1, 2) = (is("sign") ? 0.5 : -0.5) * xi.z();
    if (!is("adds")) out.DtE.setZero();
    out.DtE(2, 2) += (is("dte") ? 0.5 : left()) * e[0] + 0.5 * e[1];
  }

  void noise_derivatives(const EncoderSample& /*y*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    out.J(0, 0) = x_WI[0];
    out.J(1, 1) = is("noise_scale") ? 1.01 * x_WI[1] : x_WI[1];
    if (out.J.cols() > 2 && !is("no_slip")) out.J(2, 2) = 1.;
  }

  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& /*slip*/,
                 EncoderSample& y) const override {
    if (std::abs(xi.y()) > 1e-9) return Status::kRejected;
    if (is("rank") && std::abs(xi.z()) > 1e-9) return Status::kRejected;
    const double turn = 0.5 * x_WI[2] * (is("inverse") ? -xi.z() : xi.z());
    y.n_drive = 2;
    y.n_steer = 0;
    y.drive_rad_per_s[0] = (xi.x() - turn) / x_WI[0];
    y.drive_rad_per_s[1] = (xi.x() + turn) / x_WI[1];
    return Status::kOk;
  }

  Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const override {
    if (!is("move_frame")) return Status::kUnsupported;
    x_WI[2] += g[0];
    return Status::kOk;
  }

 private:
  /// Where the left wheel is, in units of the baseline.
  static double left() { return is("rank") ? 0.5 : -0.5; }

  Params params_;
  mutable std::atomic<int> calls_ = 0;
  mutable int unsynchronised_calls_ = 0;
  mutable std::atomic<double> cached_ = 0.;
};

VIWO_REGISTER(KinematicModel, Broken, kPluginName, "1.0.0", "a base with one mistake", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
