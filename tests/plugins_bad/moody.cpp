// A good plugin (a base with one drive channel that sees v_x), as long as its mood is fine.
#include <new>
#include <stdexcept>
#include <string>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

struct Params {
  double radius_m = 0.1;
  std::string mood = "fine";

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(radius_m), {.unit = "m", .above = 0., .help = "wheel radius"});
    b(VIWO_PARAM(mood),
      {.choices = "fine|seed|param|input|std|int|bad_alloc|rows_std|rows_int|rows_input",
       .help = "seed: that is logged; else what is thrown, and where"});
  }
};

class Moody final : public KinematicModel {
 public:
  Moody(const Params& params, const HostServices& services)
      : radius_(params.radius_m), mood_(params.mood) {
    if (mood_ == "seed") services.log(LogLevel::kInfo, std::to_string(services.seed));
    if (mood_ == "param") throw ParamError("radius_m", "is too round");
    if (mood_ == "input") throw InputError("wheels.csv:3: not a wheel");
    if (mood_ == "std") throw std::runtime_error("out of sorts");
    if (mood_ == "int") throw 42;
    if (mood_ == "bad_alloc") throw std::bad_alloc();
  }

  void describe(ModelDescription& out) const override {
    out.n_drive = 1;
    out.n_rows = 1;
    out.intrinsics = {{.name = "r",
                       .unit = "m",
                       .nominal = radius_,
                       .prior_sigma = 0.01,
                       .gauge_fixed = false,
                       .rows = {0, 1}}};
    out.noises = {{.kind = NoiseKind::kDrive, .channel = 0, .sigma = 0.01, .rows = {0, 1}}};
  }

  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool, RowSystem& out) const override {
    if (mood_ == "rows_std") throw std::out_of_range("no such row");
    if (mood_ == "rows_int") throw 7;
    if (mood_ == "rows_input") throw InputError("the sample is wrong");
    out.A = Eigen::RowVector3d(1., 0., 0.);
    out.b = RowVector::Constant(1, x_WI[0] * y.drive_rad_per_s[0]);
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample&, const Intrinsics& x_WI, const RowSystem&,
                             const RowVector& b, const Twist&, const RowVector&,
                             IntrinsicDerivatives& out) const override {
    out.J(0, 0) = b[0] / x_WI[0];
    out.DtE.setZero();
  }

  void noise_derivatives(const EncoderSample&, const Intrinsics& x_WI, const RowSystem&,
                         const RowVector&, const Twist&, const RowVector&,
                         NoiseDerivatives& out) const override {
    out.J(0, 0) = x_WI[0];
    out.DtE.setZero();
  }

 private:
  double radius_;
  std::string mood_;
};

}  // namespace

VIWO_REGISTER(KinematicModel, Moody, "moody", "1.2.0", "one wheel", "Apache-2.0", Params);
