#include "wheel_wander.hpp"

#include <cmath>

namespace viwo::calibration {
namespace {

/// Pieces of the recordings, and the longest time between two that are compared.
constexpr double kPiece_s = 0.1;
constexpr int kMostLags = 100;
/// Pairs of pieces that tell something.
constexpr int kFewestPairs = 50;
/// Of its own sigma where none wanders, over all time constants that are tried: once in some
/// thousand calibrations.
constexpr double kSurely = 4.;

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

/// The exponential through the covariances (CAL-7): over time constants, the best sigma; none that
/// noise might give. A shorter time than those that are compared is not told.
void fit_exponential(WheelWander& wander) {
  if (wander.lag_s.empty()) return;
  double best = 0.;
  for (double time_s = wander.lag_s.front(); time_s < 4. * kMostLags * kPiece_s; time_s *= 1.1) {
    double ef = 0., ee = 0., variance = 0.;  // of ef, of noise alone
    for (std::size_t k = 0; k < wander.lag_s.size(); ++k) {
      const double e = std::exp(-wander.lag_s[k] / time_s);
      ef += wander.weight[k] * e * wander.covariance[k];
      ee += wander.weight[k] * e * e;
      variance += std::pow(wander.weight[k] * e, 2) * wander.variance[k];
    }
    // By how much it lowers the sum of squares.
    const double gain = ef > 0. ? ef * ef / ee : 0.;
    if (gain <= best) continue;
    best = gain;
    const bool is_sure = ef > kSurely * std::sqrt(variance);
    wander.sigma = is_sure ? std::sqrt(ef / ee) : 0.;
    wander.time_s = is_sure ? time_s : 0.;
  }
}

}  // namespace

WheelWander find_wander(const CalibrationSetup& setup, const Intrinsics& x_WI) {
  std::vector<double> products(kMostLags + 1, 0.), squares = products, expected = products;
  std::vector<int> pairs(kMostLags + 1, 0);
  for (const CalibrationRecording& recording : setup.recordings) {
    const std::vector<ParityInformation> pieces = pieces_of(recording, x_WI);
    for (std::size_t k = 2; k <= kMostLags; ++k) {
      for (std::size_t i = 0; i + k < pieces.size(); ++i) {
        const ParityInformation& now = pieces[i];
        const ParityInformation& later = pieces[i + k];
        if (now.dof == 0. || later.dof == 0.) continue;
        const double product = now.eta.dot(later.eta);
        products[k] += product;
        squares[k] += product * product;
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
    out.variance.push_back(squares[k] / (expected[k] * expected[k]));
    out.weight.push_back(static_cast<double>(pairs[k]));
  }
  fit_exponential(out);
  return out;
}

}  // namespace viwo::calibration
