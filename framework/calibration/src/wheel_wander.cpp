#include "wheel_wander.hpp"

#include <cmath>

namespace viwo::calibration {
namespace {

/// Pieces of the recordings, and the longest time between two that are compared.
constexpr double kPiece_s = 0.1;
constexpr int kMostLags = 100;
/// Pairs of pieces that tell something.
constexpr int kFewestPairs = 50;

/// Parity information of the pieces, in units of the prior sigmas.
std::vector<ParityInformation> pieces_of(const CalibrationRecording& recording,
                                         const Intrinsics& x_WI) {
  PreintegrationOptions options = recording.setup.preintegration;
  options.parity = true;
  Preintegrator preintegrator(recording.setup.model, options);
  preintegrator.set_intrinsics(x_WI);
  const Intrinsics sigma = recording.setup.model->prior_sigma();
  const auto& wheels = recording.data.wheels();
  const auto piece_ns = static_cast<std::int64_t>(1e9 * kPiece_s);
  std::vector<ParityInformation> out;
  PreintegratedPose pose;
  for (std::int64_t t_ns = wheels.front().begin_ns; t_ns + piece_ns <= wheels.back().end_ns;
       t_ns += piece_ns) {
    guarded(recording.setup.kinematics.info, "preintegration",
            [&] { preintegrator.integrate(wheels, t_ns, t_ns + piece_ns, pose); });
    ParityInformation& parity = out.emplace_back(pose.parity);
    parity.eta = sigma.cwiseProduct(parity.eta).eval();
    parity.Lambda = (sigma.asDiagonal() * parity.Lambda * sigma.asDiagonal()).eval();
  }
  return out;
}

/// The exponential through the covariances (CAL-7): over time constants, the best sigma.
void fit_exponential(WheelWander& wander) {
  double best = 0.;
  for (double time_s = 0.5 * kPiece_s; time_s < 4. * kMostLags * kPiece_s; time_s *= 1.1) {
    double ef = 0., ee = 0.;
    for (std::size_t k = 0; k < wander.lag_s.size(); ++k) {
      const double e = std::exp(-wander.lag_s[k] / time_s);
      ef += wander.weight[k] * e * wander.covariance[k];
      ee += wander.weight[k] * e * e;
    }
    // By how much it lowers the sum of squares.
    const double gain = ef > 0. ? ef * ef / ee : 0.;
    if (gain <= best) continue;
    best = gain;
    wander.sigma = std::sqrt(ef / ee);
    wander.time_s = time_s;
  }
}

}  // namespace

WheelWander find_wander(const CalibrationSetup& setup, const Intrinsics& x_WI) {
  std::vector<double> products(kMostLags + 1, 0.), expected(kMostLags + 1, 0.);
  std::vector<int> pairs(kMostLags + 1, 0);
  for (const CalibrationRecording& recording : setup.recordings) {
    const std::vector<ParityInformation> pieces = pieces_of(recording, x_WI);
    for (std::size_t k = 2; k <= kMostLags; ++k) {
      for (std::size_t i = 0; i + k < pieces.size(); ++i) {
        const ParityInformation& now = pieces[i];
        const ParityInformation& later = pieces[i + k];
        if (now.dof == 0. || later.dof == 0.) continue;
        products[k] += now.eta.dot(later.eta);
        expected[k] += now.Lambda.cwiseProduct(later.Lambda).sum();
        ++pairs[k];
      }
    }
  }
  WheelWander out;
  for (std::size_t k = 2; k <= kMostLags; ++k) {
    if (pairs[k] < kFewestPairs || !(expected[k] > 0.)) continue;
    out.lag_s.push_back(kPiece_s * static_cast<double>(k));
    out.covariance.push_back(products[k] / expected[k]);
    out.weight.push_back(static_cast<double>(pairs[k]));
  }
  fit_exponential(out);
  return out;
}

}  // namespace viwo::calibration
