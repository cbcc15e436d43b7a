#include "viwo/wheel/wheel_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "viwo/math/chi2.hpp"

namespace viwo {
namespace {

constexpr double kOutlierProbability = 1e-4;
/// The configured variance is worth as many measurements that have nothing but this noise.
constexpr double kBelieved = 1.;
/// Share of the parity residual that may be due to the calibration.
constexpr double kMostOpen = 0.1;
/// After so many samples the weights are those of what was found, and it is begun anew.
constexpr std::array<std::int64_t, 2> kRenewals{100, 400};
/// A variance that is known worse than this, relatively, is not known.
constexpr double kMostUncertain = 0.3;
/// A channel is worse than its kind if its variance is so by this factor and so many sigmas more.
constexpr double kWorse = 1.3;
constexpr double kSureSigmas = 4.;
/// Sigmas of a drive that turns, and what turns in any case.
constexpr double kMoves = 4., kMoves_rad_per_s = 0.1;

}  // namespace

WheelNoise::WheelNoise(std::shared_ptr<const WheelModel> model)
    : model_(std::move(model)), common_(50., 500., 100.) {
  const int m = model_->n_rows(), n = model_->n_intrinsics();
  gates_.push_back(0.);
  for (int dof = 1; dof <= m; ++dof) {
    gates_.push_back(chi2_quantile(1. - kOutlierProbability, dof));
  }
  configured_.resize(q());
  for (int k = 0; k < q(); ++k) {
    const double sigma = model_->description().noises[static_cast<std::size_t>(k)].sigma;
    configured_[k] = sigma * sigma;
  }
  variance_ = configured_;
  rows_.A.setZero(m, 3);
  rows_.b.setZero(m);
  by_x_.J.setZero(m, n);
  by_x_.DtE.setZero(3, n);
  by_n_.J.setZero(m, q());
  by_n_.DtE.setZero(3, q());
  forget();
}

void WheelNoise::forget() {
  // A source that got a small weight may be as large as was configured: of two that look alike the
  // other one is not known for that.
  const NoiseVector believed = variance_.cwiseQuotient(configured_).cwiseMin(1.);
  N_ = kBelieved * Square(believed.cwiseAbs2().asDiagonal());
  h_ = kBelieved * believed;
  count_ = 0;
}

bool WheelNoise::is_outlier(double chi2, int dof) {
  const double gate = gates_[static_cast<std::size_t>(dof)];
  if (chi2 <= common_.variance() * gate) {
    common_.add(chi2 / dof);
    return false;
  }
  common_.add_beyond_in_turn(gate / dof);
  return true;
}

/// Whether no drive turns, by more than its noise. Wheels that stand do not slip, and encoders that
/// stand have no noise: neither is that of driving.
bool WheelNoise::stands(const EncoderSample& y) const {
  bool has_drives = false;
  for (const NoiseSpec& noise : model_->description().noises) {
    if (noise.kind != NoiseKind::kDrive) continue;
    has_drives = true;
    const double rate = y.drive_rad_per_s[static_cast<std::size_t>(noise.channel)];
    if (std::abs(rate) > std::min(kMoves * noise.sigma, kMoves_rad_per_s)) return false;
  }
  return has_drives;
}

void WheelNoise::add(const EncoderSample& y, const Intrinsics& x_WI, const IntrinsicMatrix& P) {
  const int m = model_->n_rows();
  if (m <= 3 || y.bad_drives != 0 || y.bad_steers != 0 || stands(y)) return;
  const KinematicModel& model = model_->model();
  if (model.rows(y, x_WI, false, rows_) != Status::kOk) return;
  const Twist rough = rows_.A.colPivHouseholderQr().solve(rows_.b);
  const RowVector rough_e = rows_.b - rows_.A * rough;
  model.noise_derivatives(y, x_WI, rows_, rows_.b, rough, rough_e, by_n_);
  // (W-14): the sources in rows that are white and free of the twist.
  const Columns J = by_n_.J * variance_.cwiseSqrt().asDiagonal();
  const Columns S = J * J.transpose();
  const Eigen::LLT<Columns> llt(S);
  if (llt.info() != Eigen::Success) return;
  const RowMatrix A = llt.matrixL().solve(rows_.A);
  const Eigen::ColPivHouseholderQR<RowMatrix> qr(A);
  const int dof = m - static_cast<int>(qr.rank());
  if (dof < 1) return;
  const auto free_of_twist = [&](auto& white) {
    white.applyOnTheLeft(qr.householderQ().adjoint());
    white.topRows(qr.rank()).setZero();
  };
  RowVector e = llt.matrixL().solve(rows_.b);
  free_of_twist(e);
  if (!e.allFinite()) return;
  const RowVector fitted = rows_.A * rough;
  model.intrinsic_derivatives(y, x_WI, rows_, fitted, rough, rough_e, by_x_);
  RowJacobian H = llt.matrixL().solve(by_x_.J);
  free_of_twist(H);
  if (!((H * P).cwiseProduct(H).sum() < kMostOpen * dof)) return;
  if (is_outlier(e.squaredNorm(), dof)) return;
  Columns U = llt.matrixL().solve(J);
  free_of_twist(U);
  // (W-15).
  const Square B = U.transpose() * U;
  N_ += B.cwiseAbs2();
  h_ += (U.transpose() * e).cwiseAbs2();
  ++count_;
  if (references_ == kRenewals.size() || count_ < kRenewals[references_]) return;
  const Kinds kinds = by_parameter();
  const Estimate found = estimate(kinds.members);
  for (int k = 0; k < q(); ++k) {
    variance_[k] *= kinds.members.row(k).dot(found.factor);
  }
  common_.reset();
  ++references_;
  forget();
}

/// Sources of one parameter together: as factors on what is configured.
WheelNoise::Kinds WheelNoise::by_parameter() const {
  const std::vector<NoiseSpec>& noises = model_->description().noises;
  Kinds kinds;
  kinds.members.setZero(q(), q());
  for (int k = 0; k < q(); ++k) {
    const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
    std::size_t g = 0;
    while (g < kinds.size && noises[kinds.first[g]].parameter != noise.parameter) ++g;
    if (g == kinds.size) kinds.first[kinds.size++] = static_cast<std::size_t>(k);
    kinds.members(k, static_cast<int>(g)) = configured_[k] / variance_[k];
  }
  kinds.members.conservativeResize(q(), static_cast<int>(kinds.size));
  return kinds;
}

/// The columns of `members` say which sources have one factor.
WheelNoise::Estimate WheelNoise::estimate(const Square& members) const {
  const Square N = members.transpose() * N_ * members;
  const Square C = N.llt().solve(Square::Identity(N.rows(), N.cols()));
  constexpr double kLeast = 1e-2;  // of a variance that is too small to be seen
  return {(C * (members.transpose() * h_)).cwiseMax(kLeast), (2. * C.diagonal()).cwiseSqrt()};
}

std::vector<WheelNoise::Part> WheelNoise::parts() const {
  std::vector<Part> parts;
  if (references_ < kRenewals.size()) return parts;
  const std::vector<NoiseSpec>& noises = model_->description().noises;
  const Kinds kinds = by_parameter();
  const Estimate of_kind = estimate(kinds.members);
  const Estimate of_source = estimate(Square::Identity(q(), q()));
  for (std::size_t g = 0; g < kinds.size; ++g) {
    const auto column = static_cast<int>(g);
    const double variance = of_kind.factor[column];
    if (of_kind.sigma[column] > kMostUncertain * variance) continue;
    parts.push_back({&noises[kinds.first[g]], false, variance, of_kind.sigma[column]});
    for (int k = 0; k < q(); ++k) {
      const double per_factor = kinds.members(k, column);
      if (per_factor == 0.) continue;
      const double alone = of_source.factor[k] / per_factor;
      const double sigma = of_source.sigma[k] / per_factor;
      if (sigma > kMostUncertain * alone || alone < kWorse * variance + kSureSigmas * sigma)
        continue;
      // sigma is that of a channel like the others; it grows with the noise itself.
      const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
      parts.push_back({&noise, true, alone, sigma * alone / variance});
    }
  }
  return parts;
}

void WheelNoise::append_to(std::vector<NoiseFound>& out) const {
  struct Words {
    const char *unit, *channel;
  };
  for (const Part& part : parts()) {
    const NoiseSpec& noise = *part.noise;
    if (noise.parameter.empty()) continue;
    const Words words = noise.kind == NoiseKind::kDrive   ? Words{"rad/s", " of drive "}
                        : noise.kind == NoiseKind::kSteer ? Words{"rad", " of steering "}
                                                          : Words{"m/s", " of wheel "};
    const std::string of = part.alone ? words.channel + std::to_string(noise.channel + 1) : "";
    out.push_back({noise.parameter + of, words.unit, noise.sigma,
                   std::sqrt(part.variance) * noise.sigma, count_});
  }
}

}  // namespace viwo
