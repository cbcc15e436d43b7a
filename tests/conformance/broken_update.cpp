// An update with one mistake, which its name says; without it it is right: the base does not lift
// off.
#include <array>
#include <cmath>
#include <csignal>
#include <stdexcept>

#include "viwo/api/plugin.hpp"

/// "broken_<defect>": of the library that this is linked into.
extern const char kPluginName[];

namespace viwo {
namespace {

bool is(std::string_view defect) {
  return std::string_view(kPluginName).substr(std::string_view("broken_").size()) == defect;
}

constexpr std::array kParams{
    ParamSpec{.name = "sigma_height_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.1",
              .min = 0.,
              .min_exclusive = true,
              .help = "how flat the ground is"},
};

int shared_calls = 0;

class Broken final : public Update {
 public:
  Broken(const ParamSet& params, const HostServices& /*services*/)
      : sigma_m_(params.number("sigma_height_m")) {}

  UpdateKind kind() const override { return UpdateKind::kBody; }
  void start(const UpdateSetup& /*setup*/) override {
    if (is("no_camera")) throw InputError("needs two cameras");
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    ++shared_calls;
    if (is("throws") && data.imu.size() < 2) throw std::out_of_range("no IMU");
    if (is("crash") && data.imu.empty()) std::raise(SIGSEGV);
    ResidualFactor& factor = sink.add_residual();
    factor.columns.add(is("beyond") ? filter.size - 2 : kPositionColumn, 3);
    if (is("overlap")) factor.columns.add(kPositionColumn + 2, 3);
    factor.set_rows(2);
    factor.H(0, 2) = 1.;
    factor.H(1, 1) = 1e-3;
    factor.residual[0] = 0.1 - filter.imu.p_IinG.z();
    if (is("nan")) factor.residual[1] = std::nan("");
    factor.R = 1e-2 * Eigen::Matrix2d::Identity() + sigma_m_ * Eigen::Matrix2d::Identity();
    if (is("asymmetric")) factor.R(0, 1) = 1e-3;
    if (is("negative")) factor.R(1, 1) = -0.5;
    if (is("shared")) factor.residual[0] += 1e-6 * shared_calls;
  }

 private:
  double sigma_m_;
};

VIWO_REGISTER(Update, Broken, kPluginName, "1.0.0", "an update with one mistake", "Apache-2.0",
              kParams);

}  // namespace
}  // namespace viwo
