#include "viwo/wheel/twist_solver.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "normal_matrix.hpp"
#include "pieces.hpp"

namespace viwo {
namespace {

bool is_bad(const NoiseSpec& noise, const EncoderSample& y) {
  const std::uint32_t bit = 1u << static_cast<unsigned>(noise.channel);
  if (noise.kind == NoiseKind::kDrive) return (y.bad_drives & bit) != 0;
  return noise.kind == NoiseKind::kSteer && (y.bad_steers & bit) != 0;
}

/// Sum of outer products a b^T of vectors of three in four lanes, column by column in registers.
class OuterProducts {
 public:
  void add(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
    for (int k = 0; k < 3; ++k) sum_.col(k) += b[k] * a;
  }
  Eigen::Matrix3d sum() const { return sum_.topRows<3>(); }

 private:
  Eigen::Matrix<double, 4, 3> sum_ = Eigen::Matrix<double, 4, 3>::Zero();
};

/// A noise block: of a size known at compile time, or within bounds.
template <int kSize>
constexpr int kMaxBlock = kSize == Eigen::Dynamic ? kMaxRows : kSize;
template <int kSize>
using BlockMatrix =
    Eigen::Matrix<double, kSize, kSize, Eigen::ColMajor, kMaxBlock<kSize>, kMaxBlock<kSize>>;

template <int kSize>
BlockMatrix<kSize> invert_block(const BlockMatrix<kSize>& R) {
  if constexpr (kSize == Eigen::Dynamic) {
    return R.llt().solve(BlockMatrix<kSize>::Identity(R.rows(), R.rows()));
  } else {
    return R.inverse();
  }
}

}  // namespace

void ParityInformation::reset(int n) {
  Lambda.setZero(n, n);
  eta.setZero(n);
  of_noise.setZero(n, n);
  chi2 = 0.;
  dof = 0;
}

void TwistSolver::Fit::resize(int n_rows) {
  WA.setZero(4, n_rows);
  b.setZero(n_rows);
  e.setZero(n_rows);
}

TwistSolver::TwistSolver(std::shared_ptr<const WheelModel> model, const TwistOptions& options)
    : model_(std::move(model)), options_(options) {
  const ModelDescription& d = model_->description();
  const int m = d.n_rows;
  const int n = model_->n_intrinsics();
  const int q = model_->n_noises();
  for (RowSystem* rows : {&rows_, &weight_rows_}) {
    rows->A.setZero(m, 3);
    rows->b.setZero(m);
  }
  plain_.resize(m);
  weighted_.resize(m);
  A_plus_.setZero(4, m);
  We_.setZero(m);
  no_residual_.setZero(m);
  by_x_.J.setZero(m, n);
  by_x_.DtE.setZero(3, n);
  by_n_.J.setZero(m, q);
  by_n_.DtE.setZero(3, q);
  WJ_.setZero();
  const int size = d.noise_block;
  const auto whole_blocks = [size](RowRange rows) {
    const int first = rows.first / size * size;
    const int end = (rows.first + rows.count + size - 1) / size * size;
    return RowRange{first, end - first};
  };
  for (const IntrinsicSpec& spec : d.intrinsics) intrinsic_rows_.push_back(whole_blocks(spec.rows));
  block_noises_.resize(static_cast<std::size_t>(m / size));
  variance_.resize(q);
  for (const NoiseSpec& spec : d.noises) {
    const int k = static_cast<int>(noise_rows_.size());
    variance_[k] = spec.sigma * spec.sigma;
    const RowRange rows = whole_blocks(spec.rows);
    noise_rows_.push_back(rows);
    for (int b = rows.first / size; b * size < rows.first + rows.count; ++b) {
      block_noises_[static_cast<std::size_t>(b)].push_back(k);
    }
  }
  set_intrinsics(model_->nominal());
}

void TwistSolver::set_intrinsics(const Intrinsics& x_WI) {
  move_intrinsics(x_WI);
  weights_at_ = x_WI;
  weight_A_is_current_ = false;
}

void TwistSolver::move_intrinsics(const Intrinsics& x_WI) {
  x_WI_ = x_WI;
  A_is_current_ = false;
}

Status TwistSolver::solve(const EncoderSample& y, TwistSolution& out) {
  const KinematicModel& model = model_->model();
  y_ = &y;
  find_left_out(y);
  if (is_undriven_) return Status::kRejected;
  if (model.rows(y, x_WI_, A_is_current_, rows_) != Status::kOk) return Status::kRejected;
  clear_left_out(rows_.A);
  clear_left_out(rows_.b);
  fit_plain();
  if (options_.noise_weighted) {
    // The weights do not move with x_WI, so that the master identity below is the whole derivative.
    model.rows(y, weights_at_, weight_A_is_current_, weight_rows_);
    clear_left_out(weight_rows_.A);
    clear_left_out(weight_rows_.b);
    weight_A_is_current_ = model_->description().constant_A && n_left_out_ == 0;
    model.noise_derivatives(y, weights_at_, weight_rows_, weight_rows_.b, weight_twist(), plain_.e,
                            by_n_);
    clear_left_out(by_n_.J);
    // Rows that tell the twist tell it however noisy some of them are.
    weighted_chi2_ = fit_weighted(
        plain_.rank == 3 ? kWeightedRankTolerance : options_.rank_tolerance, weighted_);
    set_gain(weighted_);
  } else {
    model.noise_derivatives(y, x_WI_, rows_, rows_.b, plain_.xi, plain_.e, by_n_);
    clear_left_out(by_n_.J);
  }
  const Fit& fit = options_.noise_weighted ? weighted_ : plain_;
  if (!fit.xi.allFinite()) return Status::kRejected;
  out.xi = fit.xi;
  out.e = fit.e;
  out.rank_deficient = fit.rank < 3;
  // (W-5) with A+ = (A^T W A)^-1 A^T W and R = W^-1.
  if (options_.noise_weighted) {
    out.P_xi = fit.M_inv.topRows<3>();
  } else {
    with_block_size(model_->description().noise_block,
                    [&](auto size) { twist_covariance<decltype(size)::value>(fit, out.P_xi); });
  }
  // With weights, W e takes the place of e in (W-4).
  if (options_.fitted_jacobian) {
    differentiate_fitted(moves(fit.xi, out.P_xi) ? fit.xi : Twist::Zero(), no_residual_);
  } else {
    model.intrinsic_derivatives(y, x_WI_, rows_, rows_.b, fit.xi,
                                options_.noise_weighted ? We_ : fit.e, by_x_);
    clear_left_out(by_x_.J);
  }
  with_block_size(model_->description().noise_block,
                  [&](auto size) { twist_jacobian<decltype(size)::value>(fit, out.J_xi_WI); });
  if (out.rank_deficient) {
    const double sigma = options_.unobserved_sigma_m_per_s;
    out.P_xi += sigma * sigma * fit.missing;
  }
  return Status::kOk;
}

/// Whether more than noise of covariance P is needed to explain a twist (W-16).
bool TwistSolver::moves(const Twist& xi, const Eigen::Matrix3d& P) const {
  bool moves = moves_;
  for (int i = 0; i < 3; ++i) moves |= !is_noise(xi[i], P(i, i), options_.motion_sigmas);
  return moves;
}

/// Derivatives by the intrinsics at what the rows would read at a twist.
void TwistSolver::differentiate_fitted(const Twist& xi, const RowVector& e) {
  const RowVector b = rows_.A * xi;
  model_->model().intrinsic_derivatives(*y_, x_WI_, rows_, b, xi, e, by_x_);
  clear_left_out(by_x_.J);
}

/// The rows that bad channels enter; A is then that of this sample alone.
void TwistSolver::find_left_out(const EncoderSample& y) {
  if (y.bad_drives == 0 && y.bad_steers == 0 && n_left_out_ == 0) return;
  A_is_current_ = weight_A_is_current_ = false;
  left_out_.fill(false);
  const std::vector<NoiseSpec>& noises = model_->description().noises;
  for (std::size_t k = 0; k < noises.size(); ++k) {
    if (!is_bad(noises[k], y)) continue;
    for (int i = 0; i < noises[k].rows.count; ++i) {
      left_out_[static_cast<std::size_t>(noises[k].rows.first + i)] = true;
    }
  }
  n_left_out_ = static_cast<int>(std::count(left_out_.begin(), left_out_.end(), true));
  // What is left then says how it does not move.
  is_undriven_ =
      n_left_out_ > 0 && std::all_of(noises.begin(), noises.end(), [&](const NoiseSpec& noise) {
        const auto first = left_out_.begin() + noise.rows.first;
        return noise.kind != NoiseKind::kDrive ||
               std::all_of(first, first + noise.rows.count,
                           [](bool is_left_out) { return is_left_out; });
      });
}

template <class Rows>
void TwistSolver::clear_left_out(Rows& rows) const {
  if (n_left_out_ == 0) return;
  for (int i = 0; i < model_->n_rows(); ++i) {
    if (left_out_[static_cast<std::size_t>(i)]) rows.row(i).setZero();
  }
}

void TwistSolver::fit_plain() {
  if (!A_is_current_) {
    plain_.WA.topRows<3>() = rows_.A.transpose();
    factor(rows_.A.transpose() * rows_.A, options_.rank_tolerance, plain_);
    set_gain(plain_);
    A_is_current_ = model_->description().constant_A && n_left_out_ == 0;
    if (A_is_current_ && plain_.rank < 3) {
      throw InputError(
          "kinematic model: its rows cannot tell the body twist, whatever the encoders read "
          "(are all wheels at one place?)");
    }
  }
  solve(plain_);
}

/// Plain twist at the intrinsics of the weights, on which the noise of some models depends; noise
/// through a constant A does not.
Twist TwistSolver::weight_twist() const {
  if (model_->description().constant_A) return plain_.xi;
  const RowMatrix& A = weight_rows_.A;
  const Eigen::Vector3d Atb = A.transpose() * weight_rows_.b;
  return invert_normal_matrix(A.transpose() * A, options_.rank_tolerance).inverse * Atb;
}

/// Returns the whitened squared residual.
double TwistSolver::fit_weighted(double rank_tolerance, Fit& fit) {
  Eigen::Matrix3d M;
  with_block_size(model_->description().noise_block,
                  [&](auto size) { M = weigh_rows<decltype(size)::value>(fit.WA); });
  factor(M, rank_tolerance, fit);
  solve(fit);
  double chi2 = 0.;
  for (int i = 0; i < model_->n_rows(); ++i) {
    const double* w = fit.WA.col(i).data();
    const double We = w[3] - w[0] * fit.xi[0] - w[1] * fit.xi[1] - w[2] * fit.xi[2];
    chi2 += We * fit.e[i];
    We_[i] = We;
  }
  return chi2;
}

/// R and W = R^-1 block by block, W A and in its fourth lane W b; returns A^T W A.
template <int kSize>
Eigen::Matrix3d TwistSolver::weigh_rows(RowLanes& WA) {
  const int size = block_size<kSize>();
  OuterProducts AtWA;
  int i0 = 0;
  for (const std::vector<int>& noises : block_noises_) {
    BlockMatrix<kSize> R = BlockMatrix<kSize>::Zero(size, size);
    for (const int k : noises) {
      const double* J = &by_n_.J(i0, k);
      for (int i = 0; i < size; ++i) {
        for (int l = 0; l < size; ++l) R(l, i) += variance_[k] * J[i] * J[l];
      }
    }
    for (int i = 0; i < size && n_left_out_ > 0; ++i) {
      // Whatever such a row weighs, it is zero.
      if (left_out_[static_cast<std::size_t>(i0 + i)]) R(i, i) = 1.;
    }
    const BlockMatrix<kSize> W = invert_block<kSize>(R);
    W_.block<kSize, kSize>(0, i0, size, size) = W;
    for (int i = 0; i < size; ++i) {
      Lanes w = W(i, 0) * row(i0);
      for (int l = 1; l < size; ++l) w += W(i, l) * row(i0 + l);
      WA.col(i0 + i) = w;
      AtWA.add(w, row(i0 + i));
    }
    i0 += size;
  }
  return AtWA.sum();
}

void TwistSolver::factor(const Eigen::Matrix3d& M, double rank_tolerance, Fit& fit) const {
  const NormalInverse normal = invert_normal_matrix(M, rank_tolerance);
  fit.M_inv << normal.inverse, Eigen::RowVector3d::Zero();
  fit.missing = normal.missing;
  fit.rank = normal.rank;
}

/// Twist and residual (W-2).
void TwistSolver::solve(Fit& fit) const {
  fit.xi = least_squares(fit, rows_.b);
  set_residual(fit);
  if (model_->description().constant_A) return;
  // Such rows may be badly conditioned; fitting the residual once more gets the digits back.
  fit.xi += least_squares(fit, fit.e);
  set_residual(fit);
}

/// (A^T W A)^-1 A^T W b.
Twist TwistSolver::least_squares(const Fit& fit, const RowVector& b) const {
  const int m = model_->n_rows();
  Lanes AtWb = Lanes::Zero();
  for (int i = 0; i < m; ++i) AtWb += fit.WA.col(i) * b[i];
  return (fit.M_inv * AtWb.head<3>()).head<3>();
}

void TwistSolver::set_residual(Fit& fit) const {
  in_pieces(model_->n_rows(), [&](int first, auto width) {
    constexpr int kWidth = decltype(width)::value;
    fit.b.segment<kWidth>(first) = rows_.A.middleRows<kWidth>(first) * fit.xi;
    fit.e.segment<kWidth>(first) = rows_.b.segment<kWidth>(first) - fit.b.segment<kWidth>(first);
  });
}

void TwistSolver::set_gain(const Fit& fit) {
  for (int i = 0; i < model_->n_rows(); ++i) {
    A_plus_.col(i) = fit.M_inv * fit.WA.col(i).head<3>();
  }
}

/// Derivative of the twist by the intrinsics: the master identity (W-4).
template <int kSize>
void TwistSolver::twist_jacobian(const Fit& fit, IntrinsicJacobian& J_xi_WI) const {
  const int n = model_->n_intrinsics();
  J_xi_WI.resize(3, n);
  for (int k = 0; k < n; ++k) {
    const RowRange rows = intrinsic_rows_[static_cast<std::size_t>(k)];
    const Lanes column =
        sum_rows<kSize>(A_plus_, &by_x_.J(0, k), rows) + fit.M_inv * by_x_.DtE.col(k);
    for (int c = 0; c < 3; ++c) J_xi_WI(c, k) = column[c];
  }
}

/// Covariance of the twist (W-5): every noise source through the same identity.
template <int kSize>
void TwistSolver::twist_covariance(const Fit& fit, Eigen::Matrix3d& P_xi) const {
  const bool constant_A = model_->description().constant_A;
  const int q = model_->n_noises();
  OuterProducts P;
  for (int k = 0; k < q; ++k) {
    const RowRange rows = noise_rows_[static_cast<std::size_t>(k)];
    Lanes g = sum_rows<kSize>(A_plus_, &by_n_.J(0, k), rows);
    if (!constant_A) g += fit.M_inv * by_n_.DtE.col(k);
    P.add(variance_[k] * g, g);
  }
  P_xi = P.sum();
}

}  // namespace viwo
