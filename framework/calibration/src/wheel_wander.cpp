#include "wheel_wander.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace viwo::calibration {
namespace {

/// Pieces of the recordings, and the longest time between two that are compared.
constexpr double kPiece_s = 0.1;
constexpr std::size_t kMostLags = 100;
/// Pairs of pieces that tell something.
constexpr int kFewestPairs = 50;
/// Of its own sigma where none wanders, over all time constants that are tried: once in some
/// thousand calibrations.
constexpr double kSurely = 4.;

/// What pieces have in common with those before, by how many pieces they are later.
class PairSums {
 public:
  /// Later than the one before.
  void add(std::int64_t piece, const ParityInformation& now) {
    for (std::size_t k = 2; k <= kMostLags; ++k) {
      const std::int64_t earlier = piece - static_cast<std::int64_t>(k);
      const Kept& before = kept_[place(earlier)];
      if (earlier < 0 || before.piece != earlier) continue;
      const double product = before.parity.eta.dot(now.eta);
      products[k] += product;
      squares[k] += product * product;
      expected[k] += before.parity.Lambda.cwiseProduct(now.Lambda).sum();
      ++pairs[k];
    }
    kept_[place(piece)] = {piece, now};
  }
  void begin_recording() {
    for (Kept& kept : kept_) kept.piece = -1;
  }

  std::vector<double> products = std::vector<double>(kMostLags + 1, 0.), squares = products,
                      expected = products;
  std::vector<int> pairs = std::vector<int>(kMostLags + 1, 0);

 private:
  struct Kept {
    std::int64_t piece = -1;
    ParityInformation parity;
  };

  static std::size_t place(std::int64_t piece) {
    return static_cast<std::size_t>(std::max<std::int64_t>(0, piece)) % (kMostLags + 1);
  }

  std::vector<Kept> kept_ = std::vector<Kept>(kMostLags + 1);
};

/// Adds the pieces in which a sample begins, in units of the prior sigmas.
void add_pieces(const CalibrationRecording& recording, const Intrinsics& x_WI, PairSums& sums) {
  PreintegrationOptions options = recording.setup.preintegration;
  options.parity = true;
  Preintegrator preintegrator(recording.setup.model, options);
  preintegrator.set_intrinsics(x_WI);
  const Intrinsics sigma = recording.setup.model->prior_sigma();
  const auto& wheels = recording.data.wheels();
  const std::int64_t begin_ns = wheels.front().begin_ns;
  const auto piece_ns = static_cast<std::int64_t>(1e9 * kPiece_s);
  sums.begin_recording();
  PreintegratedPose pose;
  std::int64_t next = 0;
  for (const EncoderSample& sample : wheels) {
    const std::int64_t piece = (sample.begin_ns - begin_ns) / piece_ns;
    const std::int64_t t_ns = begin_ns + piece * piece_ns;
    if (piece < next || t_ns + piece_ns > wheels.back().end_ns) continue;
    next = piece + 1;
    guarded(recording.setup.kinematics.info, "preintegration",
            [&] { preintegrator.integrate(wheels, t_ns, t_ns + piece_ns, pose); });
    ParityInformation parity = pose.parity;
    if (parity.dof == 0.) continue;
    parity.eta = sigma.cwiseProduct(parity.eta).eval();
    parity.Lambda = (sigma.asDiagonal() * parity.Lambda * sigma.asDiagonal()).eval();
    sums.add(piece, parity);
  }
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
  PairSums sums;
  for (const CalibrationRecording& recording : setup.recordings) add_pieces(recording, x_WI, sums);
  WheelWander out;
  for (std::size_t k = 2; k <= kMostLags; ++k) {
    if (sums.pairs[k] < kFewestPairs || !(sums.expected[k] > 0.)) continue;
    out.lag_s.push_back(kPiece_s * static_cast<double>(k));
    out.covariance.push_back(sums.products[k] / sums.expected[k]);
    out.variance.push_back(sums.squares[k] / (sums.expected[k] * sums.expected[k]));
    out.weight.push_back(static_cast<double>(sums.pairs[k]));
  }
  fit_exponential(out);
  return out;
}

}  // namespace viwo::calibration
