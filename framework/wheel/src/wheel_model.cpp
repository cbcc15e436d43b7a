#include "viwo/wheel/wheel_model.hpp"

#include <cmath>
#include <set>
#include <utility>

namespace viwo {
namespace {

void require(bool condition, const std::string& text) {
  if (!condition) throw InputError("kinematic model: " + text);
}

/// An empty range means "all rows", so that a model need not declare its sparsity.
void fill_range(RowRange& range, int n_rows, const std::string& what) {
  if (range.count == 0) range = {0, n_rows};
  require(range.first >= 0 && range.count > 0 && range.first + range.count <= n_rows,
          "row range of " + what + " lies outside of its " + std::to_string(n_rows) + " rows");
}

}  // namespace

WheelModel::WheelModel(std::shared_ptr<const KinematicModel> model) : model_(std::move(model)) {
  ModelDescription& d = description_;
  model_->describe(d);
  require(d.n_drive >= 1 && d.n_drive <= kMaxDrives, "n_drive is " + std::to_string(d.n_drive));
  require(d.n_steer >= 0 && d.n_steer <= kMaxSteers, "n_steer is " + std::to_string(d.n_steer));
  require(d.n_rows >= 1 && d.n_rows <= kMaxRows, "n_rows is " + std::to_string(d.n_rows));
  require(d.noise_block >= 1 && d.n_rows % d.noise_block == 0,
          "noise_block does not divide n_rows");
  require(d.intrinsics.size() <= kMaxIntrinsics, "too many intrinsics");
  require(!d.noises.empty() && d.noises.size() <= kMaxNoises, "no or too many noise sources");
  std::set<std::string> names;
  for (IntrinsicSpec& spec : d.intrinsics) {
    require(names.insert(spec.name).second, "intrinsic '" + spec.name + "' appears twice");
    require(std::isfinite(spec.nominal), "nominal value of '" + spec.name + "' is not finite");
    require(spec.prior_sigma > 0. && std::isfinite(spec.prior_sigma),
            "prior sigma of '" + spec.name + "' is not positive");
    require(spec.lowest <= spec.nominal && spec.nominal <= spec.highest,
            "nominal value of '" + spec.name + "' is outside of its bounds");
    fill_range(spec.rows, d.n_rows, "intrinsic '" + spec.name + "'");
  }
  for (NoiseSpec& spec : d.noises) {
    require(spec.sigma > 0. && std::isfinite(spec.sigma), "a noise sigma is not positive");
    fill_range(spec.rows, d.n_rows, "a noise source");
  }
}

Intrinsics WheelModel::nominal() const { return nominal_intrinsics(description_); }

Intrinsics WheelModel::prior_sigma() const {
  Intrinsics sigma = drawn_sigma();
  for (int i = 0; i < n_intrinsics(); ++i) {
    if (description_.intrinsics[static_cast<std::size_t>(i)].gauge_fixed) sigma[i] = 0.;
  }
  return sigma;
}

Intrinsics WheelModel::drawn_sigma() const {
  Intrinsics sigma(n_intrinsics());
  for (int i = 0; i < n_intrinsics(); ++i) {
    sigma[i] = description_.intrinsics[static_cast<std::size_t>(i)].prior_sigma;
  }
  return sigma;
}

int WheelModel::find(const std::string& intrinsic) const {
  for (std::size_t i = 0; i < description_.intrinsics.size(); ++i) {
    if (description_.intrinsics[i].name == intrinsic) return static_cast<int>(i);
  }
  return -1;
}

void WheelModel::require_channels(const EncoderSample& sample, const std::string& sensor) const {
  const ModelDescription& d = description_;
  if (sample.n_drive == d.n_drive && (d.n_steer == 0 || sample.n_steer == d.n_steer)) return;
  throw InputError(sensor + " has " + std::to_string(sample.n_drive) + " drive and " +
                   std::to_string(sample.n_steer) +
                   " steering channels, but the kinematic model has " + std::to_string(d.n_drive) +
                   " driven and " + std::to_string(d.n_steer) + " steered wheels");
}

}  // namespace viwo
