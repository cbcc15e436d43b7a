#include "viwo/filter/covariance.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Cholesky>

#include "upper_triangular.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo {
namespace {

using Eigen::Index;

using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  kMaxFactorRows, kMaxFactorRows>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxFactorRows, 1>;
using InPlaceCholesky = Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>;

/// A residual, and the noise that it is weighed with.
class Innovation {
 public:
  /// HPHt: what the estimate leaves open of the residual; R: its noise.
  Innovation(const SmallMatrix& HPHt, const SmallMatrix& R, const SmallVector& residual)
      : HPHt_(HPHt), R_(R), residual_(residual) {}

  /// With noise of `scale` R; false when that is not positive definite.
  bool weigh(double scale) {
    scale_ = scale;
    llt_.compute(HPHt_ + scale * R_);
    if (llt_.info() != Eigen::Success) return false;
    white_ = llt_.matrixL().solve(residual_);
    return true;
  }
  /// Raises the scale until the residual is as likely as `threshold` (F-32).
  bool weaken(double threshold) {
    for (int i = 0; i < kMostWeakenings && chi2() > kNearEnough * threshold; ++i) {
      if (!weigh(scale_ * chi2() / threshold)) return false;
    }
    return true;
  }
  double chi2() const { return white_.squaredNorm(); }
  /// Tells the noise what the residual says of its scale (F-30).
  void tell(NoiseScale& noise) const {
    const SmallVector u = llt_.matrixU().solve(white_);
    const SmallMatrix claimed = llt_.solve(R_);
    const double information = claimed.cwiseProduct(claimed.transpose()).sum();
    noise.add(scale_ + (u.dot(R_ * u) - claimed.trace()) / information,
              scale_ * scale_ * information / static_cast<double>(u.size()));
  }
  const Eigen::LLT<SmallMatrix>& llt() const { return llt_; }
  const SmallVector& white() const { return white_; }

 private:
  static constexpr int kMostWeakenings = 20;
  static constexpr double kNearEnough = 1.01;

  const SmallMatrix& HPHt_;
  const SmallMatrix& R_;
  const SmallVector& residual_;
  double scale_ = 1.;
  Eigen::LLT<SmallMatrix> llt_;
  SmallVector white_;
};

void mirror_lower(Eigen::Ref<Eigen::MatrixXd> M) {
  M.triangularView<Eigen::StrictlyUpper>() = M.transpose();
}

}  // namespace

Covariance::Covariance(int size, int max_new)
    : P_(Eigen::MatrixXd::Zero(size, size)),
      PHt_(size, kMaxFactorRows),
      in_factor_(static_cast<std::size_t>(size)),
      C_(size, size),
      T_(size, size),
      Y_(size, size),
      Z_(size, size),
      G_(size, size),
      W_(size, size),
      y_(size),
      N_(max_new, max_new),
      G_new_(max_new, size),
      P_new_(size, std::max(max_new, kMaxRoomEntries)),
      eta_new_(max_new) {
  order_.reserve(static_cast<std::size_t>(size));
  factor_index_.reserve(static_cast<std::size_t>(size));
  gates_.reserve(64);
  runs_.reserve(static_cast<std::size_t>(size));
  for (std::vector<int>* list : {&new_, &known_, &new_index_, &known_index_}) {
    list->reserve(static_cast<std::size_t>(size));
  }
}

void Covariance::set_block(int first, const Eigen::MatrixXd& block) {
  clear_block(first, static_cast<int>(block.rows()));
  P_.block(first, first, block.rows(), block.cols()) = block;
}

void Covariance::clear_block(int first, int count) {
  P_.middleRows(first, count).setZero();
  P_.middleCols(first, count).setZero();
}

void Covariance::propagate(const ImuTransition& transition) {
  const Index rest = size() - kImuSize;
  const ImuMatrix P_imu = P_.topLeftCorner<kImuSize, kImuSize>();
  const ImuMatrix half = transition.Phi * P_imu;
  ImuMatrix next = half * transition.Phi.transpose() + transition.Q;
  next.triangularView<Eigen::StrictlyUpper>() = next.transpose();
  P_.topLeftCorner<kImuSize, kImuSize>() = next;
  auto shared = P_.bottomLeftCorner(rest, kImuSize);
  auto product = PHt_.topLeftCorner(rest, kImuSize);
  product.noalias() = shared * transition.Phi.transpose();
  shared = product;
  P_.topRightCorner(kImuSize, rest) = product.transpose();
}

void Covariance::move(std::span<const ErrorMove> moves) {
  for (int half = 0; half < 2; ++half) {  // T P, then T (T P)^T
    for (Index j = 0; j < P_.cols(); ++j) {
      auto errors = P_.col(j);
      for (const ErrorMove& move : moves) {
        const Eigen::Vector3d theta = errors.segment<3>(move.column);
        errors.segment<3>(move.column).noalias() = move.turn * theta;
        errors.segment<3>(move.column + 3).noalias() += move.position_by_theta * theta;
        if (!move.velocity_by_theta) continue;
        errors.segment<3>(move.column + 6).noalias() += *move.velocity_by_theta * theta;
      }
    }
    P_.transposeInPlace();
  }
  mirror_lower(P_);
}

void Covariance::clone_pose(int column) {
  P_.middleCols<kPoseSize>(column) = P_.middleCols<kPoseSize>(kThetaColumn);
  P_.middleRows<kPoseSize>(column) = P_.middleRows<kPoseSize>(kThetaColumn);
}

void Covariance::decay(int column, double kept, double variance) {
  if (kept != 1.) {
    P_.row(column) *= kept;
    P_.col(column) *= kept;
  }
  P_(column, column) += variance;
}

double Covariance::gate(int rows, double probability) {
  for (const Gate& gate : gates_) {
    if (gate.rows == rows && gate.probability == probability) return gate.threshold;
  }
  gates_.push_back({rows, probability, chi2_quantile(1. - probability, rows)});
  return gates_.back().threshold;
}

FactorResult Covariance::apply(const ResidualFactor& factor, Eigen::VectorXd& dx) {
  const Index rows = factor.residual.size();
  dx.setZero();
  if (rows == 0 || !factor.residual.allFinite() || !factor.H.allFinite() ||
      !factor.R.allFinite()) {  // Eigen's LLT succeeds on NaN
    return FactorResult::kRejected;
  }
  auto PHt = PHt_.leftCols(rows);
  PHt.setZero();
  Index start = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    PHt.noalias() += P_.middleCols(block.first, block.count) *
                     factor.H.middleCols(start, block.count).transpose();
    start += block.count;
  }
  SmallMatrix HPHt = SmallMatrix::Zero(rows, rows);
  start = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    HPHt += factor.H.middleCols(start, block.count)
                .lazyProduct(PHt.middleRows(block.first, block.count));
    start += block.count;
  }
  Innovation innovation(HPHt, factor.R, factor.residual);
  if (!innovation.weigh(factor.noise != nullptr ? factor.noise->variance() : 1.)) {
    return FactorResult::kRejected;
  }
  FactorResult result = FactorResult::kApplied;
  const double threshold = factor.gate_probability > 0.
                               ? gate(static_cast<int>(rows), factor.gate_probability)
                               : std::numeric_limits<double>::infinity();
  if (innovation.chi2() <= threshold) {
    if (factor.noise != nullptr) innovation.tell(*factor.noise);
  } else {
    if (factor.noise != nullptr) {
      factor.noise->add_beyond_in_turn(threshold / static_cast<double>(rows));
    }
    if (!factor.heavy_tailed || !innovation.weaken(threshold)) return FactorResult::kGated;
    result = FactorResult::kWeakened;
  }
  const Eigen::LLT<SmallMatrix>& llt = innovation.llt();
  // W = P H^T L^-T: P <- P - W W^T, dx = W L^-1 r (F-7).
  for (Index i = 0; i < rows; ++i) {
    for (Index k = 0; k < i; ++k) PHt.col(i) -= llt.matrixLLT()(i, k) * PHt.col(k);
    PHt.col(i) /= llt.matrixLLT()(i, i);
  }
  dx.noalias() = PHt * innovation.white();
  for (Index j = 0; j < P_.cols(); ++j) {
    for (Index k = 0; k < rows; ++k) {
      P_.col(j).tail(P_.rows() - j) -= PHt(j, k) * PHt.col(k).tail(P_.rows() - j);
    }
  }
  mirror_lower(P_);
  return result;
}

void Covariance::collect_columns(const FactorColumns& columns) {
  order_.clear();
  factor_index_.clear();
  std::fill(in_factor_.begin(), in_factor_.end(), false);
  int start = 0;
  for (const ColumnRange& block : columns.blocks()) {
    for (int i = 0; i < block.count; ++i) {
      const int column = block.first + i;
      if (P_(column, column) <= 0.) continue;  // held: nothing to learn
      order_.push_back(column);
      factor_index_.push_back(start + i);
      in_factor_[static_cast<std::size_t>(column)] = true;
    }
    start += block.count;
  }
  const auto m = order_.size();
  // Nothing comes of columns without variance: what is held, and room that is not used.
  for (int column = 0; column < size(); ++column) {
    if (!in_factor_[static_cast<std::size_t>(column)] && P_(column, column) > 0.) {
      order_.push_back(column);
    }
  }
  // Neighbours that are neighbours in the state and in the factor, too; a run is of the factor or
  // of the others.
  const auto follows = [&](std::size_t i) {
    return order_[i] == order_[i - 1] + 1 &&
           (i >= m || factor_index_[i] == factor_index_[i - 1] + 1);
  };
  runs_.clear();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    if (i == 0 || i == m || !follows(i)) {
      runs_.push_back({static_cast<int>(i), order_[i], 0});
    }
    ++runs_.back().count;
  }
}

Eigen::Index Covariance::gather(const InformationFactor& factor) {
  collect_columns(factor.columns);
  const Index m = static_cast<Index>(factor_index_.size());
  const auto in_factor = [this](const Run& run) {
    return factor_index_[static_cast<std::size_t>(run.start)];
  };
  auto Lambda = G_.topLeftCorner(m, m);
  auto reversed = W_.topLeftCorner(m, m);
  for (const Run& rows : runs_) {
    if (rows.start >= m) break;
    y_.segment(rows.start, rows.count) = factor.eta.segment(in_factor(rows), rows.count);
    for (const Run& cols : runs_) {
      if (cols.start > rows.start) break;
      Lambda.block(rows.start, cols.start, rows.count, cols.count) =
          factor.Lambda.block(in_factor(rows), in_factor(cols), rows.count, cols.count);
      reversed.block(m - cols.start - cols.count, m - rows.start - rows.count, cols.count,
                     rows.count) =
          P_.block(cols.column, rows.column, cols.count, rows.count).reverse();
    }
  }
  mirror_lower(Lambda);
  return m;
}

FactorResult Covariance::apply(const InformationFactor& factor, Eigen::VectorXd& dx) {
  dx.setZero();
  const Index m = gather(factor);
  const Index n = static_cast<Index>(order_.size());
  if (m == 0) return FactorResult::kRejected;
  auto y = y_.head(m);
  auto G = G_.topLeftCorner(n, n);
  const auto Lambda = G.topLeftCorner(m, m);
  if (!Lambda.allFinite() || !y.allFinite()) return FactorResult::kRejected;

  auto C = C_.topLeftCorner(m, m);
  auto T = T_.topLeftCorner(m, m);
  auto work = W_.topLeftCorner(m, m);
  if (!upper_triangular::factorise(work, C)) {
    // Where nothing tells the place, what clones are off by together is so much more than what they
    // are off by from each other that rounding is as large as that: as much again, and once more.
    constexpr double kRounding = 1e-12;
    gather(factor);
    work.diagonal() *= 1. + kRounding;
    if (!upper_triangular::factorise(work, C)) return FactorResult::kFailed;
  }
  upper_triangular::weigh(C, Lambda, work, T);
  Eigen::Ref<Eigen::MatrixXd> L(T);
  if (InPlaceCholesky(L).info() != Eigen::Success) return FactorResult::kRejected;

  auto Y_o = Y_.topLeftCorner(m, n - m);
  for (const Run& rows : runs_) {
    for (const Run& cols : runs_) {
      if (rows.start >= m || cols.start < m) continue;
      Y_o.block(rows.start, cols.start - m, rows.count, cols.count) =
          P_.block(rows.column, cols.column, rows.count, cols.count);
    }
  }
  C.triangularView<Eigen::Upper>().solveInPlace(Y_o);
  auto Z_o = Z_.topLeftCorner(m, n - m);
  Z_o = Y_o;
  L.triangularView<Eigen::Lower>().solveInPlace(Z_o);
  auto product = W_.col(0).head(m);  // y cannot be both sides, and a temporary would be allocated
  product.noalias() = C.transpose().triangularView<Eigen::Lower>() * y;
  y = product;
  L.triangularView<Eigen::Lower>().solveInPlace(y);

  upper_triangular::divide(C, L);
  auto correction = W_.col(0).head(n);
  correction.head(m).noalias() = C.triangularView<Eigen::Upper>() * y;
  correction.tail(n - m).noalias() = Z_o.transpose() * y;
  upper_triangular::square(C, G.topLeftCorner(m, m));
  G.bottomLeftCorner(n - m, m).noalias() =
      Z_o.transpose() * C.transpose().triangularView<Eigen::Lower>();
  auto G_o = G.bottomRightCorner(n - m, n - m);
  G_o.triangularView<Eigen::Lower>().setZero();
  G_o.selfadjointView<Eigen::Lower>().rankUpdate(Z_o.transpose());
  G_o.selfadjointView<Eigen::Lower>().rankUpdate(Y_o.transpose(), -1.);
  mirror_lower(G);
  scatter(m, dx);
  return FactorResult::kApplied;
}

void Covariance::scatter(Eigen::Index m, Eigen::VectorXd& dx) {
  for (const Run& cols : runs_) {
    dx.segment(cols.column, cols.count) = W_.col(0).segment(cols.start, cols.count);
    for (const Run& rows : runs_) {
      auto P_block = P_.block(rows.column, cols.column, rows.count, cols.count);
      const auto G_block = G_.block(rows.start, cols.start, rows.count, cols.count);
      if (rows.start < m || cols.start < m) {
        P_block = G_block;
      } else {
        P_block += G_block;
      }
    }
  }
}

}  // namespace viwo
