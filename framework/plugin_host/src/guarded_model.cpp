#include "guarded_model.hpp"

namespace viwo {
namespace {

template <class F>
decltype(auto) running(const PluginInfo& info, const char* phase, F&& f) {
  try {
    return guarded(info, phase, std::forward<F>(f));
  } catch (const InputError& error) {
    throw PluginFailure(info, phase, error.what());
  }
}

}  // namespace

void GuardedModel::describe(ModelDescription& out) const {
  guarded(info_, "describe", [&] { model_->describe(out); });
}

Status GuardedModel::rows(const EncoderSample& y, const Intrinsics& x_WI, bool A_is_current,
                          RowSystem& out) const {
  return running(info_, "rows", [&] { return model_->rows(y, x_WI, A_is_current, out); });
}

void GuardedModel::intrinsic_derivatives(const EncoderSample& y, const Intrinsics& x_WI,
                                         const RowSystem& rows, const RowVector& b, const Twist& xi,
                                         const RowVector& e, IntrinsicDerivatives& out) const {
  running(info_, "intrinsic_derivatives",
          [&] { model_->intrinsic_derivatives(y, x_WI, rows, b, xi, e, out); });
}

void GuardedModel::noise_derivatives(const EncoderSample& y, const Intrinsics& x_WI,
                                     const RowSystem& rows, const RowVector& b, const Twist& xi,
                                     const RowVector& e, NoiseDerivatives& out) const {
  running(info_, "noise_derivatives",
          [&] { model_->noise_derivatives(y, x_WI, rows, b, xi, e, out); });
}

Status GuardedModel::inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                             EncoderSample& y) const {
  return running(info_, "inverse", [&] { return model_->inverse(xi, x_WI, slip, y); });
}

Status GuardedModel::move_frame(const Eigen::Vector3d& g, Intrinsics& x_WI) const {
  return running(info_, "move_frame", [&] { return model_->move_frame(g, x_WI); });
}

}  // namespace viwo
