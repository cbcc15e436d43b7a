// A kinematic model as the framework holds it: what the plugin throws becomes a failure of the host
// that names it, whoever calls the model - an update plugin among them, which could not tell.
#pragma once

#include <memory>
#include <utility>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {

/// Hands every call on to `model`. PluginFailure for all that the model throws while it runs, an
/// InputError too: by then there is nothing in the configuration left to mend.
class GuardedModel final : public KinematicModel {
 public:
  GuardedModel(std::shared_ptr<const KinematicModel> model, PluginInfo info)
      : model_(std::move(model)), info_(std::move(info)) {}

  void describe(ModelDescription& out) const override;
  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool A_is_current,
              RowSystem& out) const override;
  void intrinsic_derivatives(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& rows,
                             const RowVector& b, const Twist& xi, const RowVector& e,
                             IntrinsicDerivatives& out) const override;
  void noise_derivatives(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& rows,
                         const RowVector& b, const Twist& xi, const RowVector& e,
                         NoiseDerivatives& out) const override;
  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& y) const override;
  Status move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const override;

 private:
  std::shared_ptr<const KinematicModel> model_;
  PluginInfo info_;
};

}  // namespace viwo
