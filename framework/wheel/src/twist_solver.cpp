#include "viwo/wheel/twist_solver.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace viwo {
namespace {

/// For the parity residual only directions that A cannot tell at all are left out.
constexpr double kParityRankTolerance = 1e-6;

struct NormalInverse {
  Eigen::Matrix3d inverse;  // (pseudo-)inverse of M
  Eigen::Matrix3d missing;  // sum of n n^T over the directions left out, in units of xi
  int rank = 3;
};

/// Inverse of M = A^T W A where its columns are independent to `tolerance`, otherwise the
/// pseudo-inverse. Velocities are scaled alike, the yaw rate to the same size, so that the smallest
/// singular value of rolling rows is about the spread of the wheel directions.
NormalInverse invert_normal_matrix(const Eigen::Matrix3d& M, double tolerance) {
  const double velocity = std::sqrt(2. / (M(0, 0) + M(1, 1)));
  const Eigen::Vector3d scale(velocity, velocity, M(2, 2) > 0. ? 1. / std::sqrt(M(2, 2)) : 1.);
  const Eigen::Matrix3d Ms = scale.asDiagonal() * M * scale.asDiagonal();
  NormalInverse result;
  // The scaled matrix has trace 3, so the product of its two larger eigenvalues is at most 9/4 and
  // det/(9/4) is a lower bound of the smallest: mostly enough, without an eigenvalue solver.
  if (Ms.determinant() > 2.25 * tolerance * tolerance * 3.) {
    result.inverse = scale.asDiagonal() * Ms.inverse() * scale.asDiagonal();
    result.missing.setZero();
    return result;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Ms);
  const double smallest = tolerance * tolerance * eigen.eigenvalues()[2];
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d missing = Eigen::Matrix3d::Zero();
  result.rank = 0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d n = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()[i] > smallest) {
      inverse += n * n.transpose() / eigen.eigenvalues()[i];
      ++result.rank;
    } else {
      missing += n * n.transpose();
    }
  }
  result.inverse = scale.asDiagonal() * inverse * scale.asDiagonal();
  const Eigen::Vector3d unit = scale / velocity;  // in units of xi per m/s of the rows
  result.missing = unit.asDiagonal() * missing * unit.asDiagonal();
  return result;
}

}  // namespace

void ParityInformation::reset(int n) {
  Lambda.setZero(n, n);
  eta.setZero(n);
  chi2 = 0.;
  dof = 0;
}

TwistSolver::TwistSolver(std::shared_ptr<const WheelModel> model, const TwistOptions& options)
    : model_(std::move(model)), options_(options) {
  const ModelDescription& d = model_->description();
  const int m = d.n_rows;
  const int n = model_->n_intrinsics();
  const int q = model_->n_noises();
  rows_.A.setZero(m, 3);
  rows_.b.setZero(m);
  e_.setZero(m);
  e_w_.setZero(m);
  b_fit_.setZero(m);
  plain_.A_plus.setZero(3, m);
  weighted_.A_plus.setZero(3, m);
  for (IntrinsicDerivatives* by_x : {&by_x_, &by_x_fit_}) {
    by_x->J.setZero(m, n);
    by_x->DtE.setZero(3, n);
  }
  WJ_.setZero(m, n);
  by_n_.J.setZero(m, q);
  by_n_.DtE.setZero(3, q);
  R_.setZero(d.noise_block, m);
  W_.setZero(d.noise_block, m);
  variance_.resize(q);
  for (int i = 0; i < q; ++i) {
    const double sigma = d.noises[static_cast<std::size_t>(i)].sigma;
    variance_[i] = sigma * sigma;
  }
  const int s = d.noise_block;
  block_columns_.resize(static_cast<std::size_t>(m / s));
  for (int k = 0; k < n; ++k) {
    const RowRange range = d.intrinsics[static_cast<std::size_t>(k)].rows;
    for (int b = range.first / s; b * s < range.first + range.count; ++b) {
      const int first = std::max(range.first - b * s, 0);
      const int last = std::min(range.first + range.count - b * s, s);
      block_columns_[static_cast<std::size_t>(b)].push_back({k, first, last - first});
    }
  }
  set_intrinsics(model_->nominal());
}

void TwistSolver::set_intrinsics(const Intrinsics& x_WI) {
  x_WI_ = x_WI;
  A_is_current_ = false;
}

Status TwistSolver::solve(const EncoderSample& y, TwistSolution& out) {
  const ModelDescription& d = model_->description();
  const KinematicModel& model = model_->model();
  y_ = y;
  if (model.rows(y_, x_WI_, A_is_current_, rows_) != Status::kOk) return Status::kRejected;
  solve_plain();
  model.noise_derivatives(y_, x_WI_, rows_, rows_.b, xi_, e_, by_n_);
  if (options_.noise_weighted) solve_weighted();
  const Gain& gain = options_.noise_weighted ? weighted_ : plain_;
  out.rank_deficient = gain.rank < 3;
  if (!xi_.allFinite()) return Status::kRejected;
  out.xi = xi_;
  out.e = e_;

  // Master identity (W-4): d xi = A+ d(b - A xi) + (A^T W A)^-1 dA^T W e. With weights, W e takes
  // the place of e: the weights are a choice of the estimator and are held.
  RowVector We = e_;
  if (options_.noise_weighted) {
    const int s = d.noise_block;
    for (int i = 0; i < d.n_rows; i += s) {
      We.segment(i, s).noalias() = W_.middleCols(i, s) * e_.segment(i, s);
    }
  }
  model.intrinsic_derivatives(y_, x_WI_, rows_, rows_.b, xi_, We, by_x_);
  const int n = model_->n_intrinsics();
  out.J_xi_WI.resize(3, n);
  for (int k = 0; k < n; ++k) {
    const RowRange range = d.intrinsics[static_cast<std::size_t>(k)].rows;
    Eigen::Vector3d column = gain.M_inv * by_x_.DtE.col(k);
    for (int i = range.first; i < range.first + range.count; ++i) {
      column += gain.A_plus.col(i) * by_x_.J(i, k);
    }
    out.J_xi_WI(0, k) = column[0];
    out.J_xi_WI(1, k) = column[1];
    out.J_xi_WI(2, k) = column[2];
  }
  // Covariance (W-5): every noise source through the same identity.
  Eigen::Matrix3d P = gain.P_missing;
  for (int k = 0; k < model_->n_noises(); ++k) {
    const RowRange range = d.noises[static_cast<std::size_t>(k)].rows;
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (int i = range.first; i < range.first + range.count; ++i) {
      g += gain.A_plus.col(i) * by_n_.J(i, k);
    }
    if (!d.constant_A && !options_.noise_weighted) g += gain.M_inv * by_n_.DtE.col(k);
    P += (variance_[k] * g) * g.transpose();
  }
  out.P_xi = P;
  return Status::kOk;
}

void TwistSolver::factor(const Eigen::Matrix3d& M, Gain& gain) const {
  const NormalInverse normal = invert_normal_matrix(M, options_.rank_tolerance);
  gain.M_inv = normal.inverse;
  gain.rank = normal.rank;
  const double sigma = options_.unobserved_sigma_m_per_s;
  gain.P_missing = sigma * sigma * normal.missing;
}

void TwistSolver::solve_plain() {
  if (!A_is_current_) {
    const Eigen::Matrix3d M = rows_.A.transpose() * rows_.A;
    factor(M, plain_);
    plain_.A_plus.noalias() = plain_.M_inv * rows_.A.transpose();
    A_is_current_ = model_->description().constant_A;
    if (A_is_current_ && plain_.rank < 3) {
      throw InputError(
          "kinematic model: its rows cannot tell the body twist, whatever the encoders read "
          "(are all wheels at one place?)");
    }
  }
  const int m = model_->n_rows();
  xi_.setZero();
  for (int i = 0; i < m; ++i) xi_ += plain_.A_plus.col(i) * rows_.b[i];
  for (int i = 0; i < m; ++i) {
    e_[i] = rows_.b[i] - (rows_.A(i, 0) * xi_[0] + rows_.A(i, 1) * xi_[1] + rows_.A(i, 2) * xi_[2]);
  }
}

void TwistSolver::solve_weighted() {
  // The noise of some models depends on the twist; that of the unweighted fit is close enough.
  row_weights();
  const int s = model_->description().noise_block;
  const int m = model_->n_rows();
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (int i = 0; i < m; i += s) {
    weighted_.A_plus.middleCols(i, s).noalias() =
        rows_.A.middleRows(i, s).transpose() * W_.middleCols(i, s);
    M += weighted_.A_plus.middleCols(i, s) * rows_.A.middleRows(i, s);
  }
  factor(M, weighted_);
  xi_.setZero();
  for (int i = 0; i < m; ++i) {
    weighted_.A_plus.col(i) = (weighted_.M_inv * weighted_.A_plus.col(i)).eval();
    xi_ += weighted_.A_plus.col(i) * rows_.b[i];
  }
  e_.noalias() = rows_.b - rows_.A * xi_;
}

void TwistSolver::row_weights() {
  const ModelDescription& d = model_->description();
  const int s = d.noise_block;
  R_.setZero();
  for (int k = 0; k < model_->n_noises(); ++k) {
    const RowRange range = d.noises[static_cast<std::size_t>(k)].rows;
    for (int i = range.first; i < range.first + range.count; ++i) {
      const int block = i / s * s;
      const double scaled = variance_[k] * by_n_.J(i, k);
      const int last = std::min(range.first + range.count, block + s);
      for (int l = std::max(range.first, block); l < last; ++l) {
        R_(l - block, i) += scaled * by_n_.J(l, k);
      }
    }
  }
  for (int i = 0; i < d.n_rows; i += s) {
    if (s == 1) {
      W_(0, i) = 1. / R_(0, i);
    } else if (s == 2) {
      W_.middleCols<2>(i).topRows<2>() = R_.block<2, 2>(0, i).inverse();
    } else {
      using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows,
                                  kMaxRows>;
      const Eigen::LLT<Block> factor(R_.middleCols(i, s));
      W_.middleCols(i, s) = factor.solve(Block::Identity(s, s));
    }
  }
}

double TwistSolver::parity_chi2() {
  const ModelDescription& d = model_->description();
  const int s = d.noise_block;
  const int m = d.n_rows;
  if (!options_.noise_weighted) row_weights();
  M_w_.setZero();
  Eigen::Vector3d AtWb = Eigen::Vector3d::Zero();
  for (int i = 0; i < m; i += s) {
    for (int k = 0; k < s; ++k) {
      Eigen::Vector3d WA = Eigen::Vector3d::Zero();  // row k of W A in this block
      double Wb = 0.;
      for (int l = 0; l < s; ++l) {
        WA += W_(k, i + l) * rows_.A.row(i + l).transpose();
        Wb += W_(k, i + l) * rows_.b[i + l];
      }
      M_w_ += WA * rows_.A.row(i + k);
      AtWb += Wb * rows_.A.row(i + k).transpose();
    }
  }
  const NormalInverse normal = invert_normal_matrix(M_w_, kParityRankTolerance);
  M_w_ = normal.inverse;
  parity_rank_ = normal.rank;
  xi_w_ = M_w_ * AtWb;
  double chi2 = 0.;
  for (int i = 0; i < m; ++i) {
    b_fit_[i] = rows_.A.row(i).dot(xi_w_);
    e_w_[i] = rows_.b[i] - b_fit_[i];
  }
  for (int i = 0; i < m; i += s) {
    for (int k = 0; k < s; ++k) {
      for (int l = 0; l < s; ++l) chi2 += e_w_[i + k] * W_(k, i + l) * e_w_[i + l];
    }
  }
  return chi2;
}

void TwistSolver::add_parity(double weight, ParityInformation& out) {
  const ModelDescription& d = model_->description();
  const int s = d.noise_block;
  const int n = model_->n_intrinsics();
  model_->model().intrinsic_derivatives(y_, x_WI_, rows_, b_fit_, xi_w_, e_w_, by_x_fit_);
  const RowJacobian& J = by_x_fit_.J;

  // Lambda = J^T W J - V^T (A^T W A)^-1 V with V = A^T W J; eta = J^T W e (W-10). A column of J
  // meets only the columns of its own noise blocks.
  IntrinsicJacobian V(3, n);
  V.setZero();
  double chi2 = 0.;
  for (std::size_t b = 0; b < block_columns_.size(); ++b) {
    const int i0 = static_cast<int>(b) * s;
    RowVector We(s);
    for (int k = 0; k < s; ++k) {
      We[k] = 0.;
      for (int l = 0; l < s; ++l) We[k] += W_(k, i0 + l) * e_w_[i0 + l];
      chi2 += We[k] * e_w_[i0 + k];
    }
    for (const BlockColumn& column : block_columns_[b]) {
      const int k = column.column;
      for (int i = 0; i < s; ++i) {
        double WJ = 0.;
        for (int l = column.first; l < column.first + column.count; ++l) {
          WJ += W_(i, i0 + l) * J(i0 + l, k);
        }
        WJ_(i0 + i, k) = WJ;
        for (int c = 0; c < 3; ++c) V(c, k) += rows_.A(i0 + i, c) * WJ;
      }
      for (int l = column.first; l < column.first + column.count; ++l) {
        out.eta[k] += weight * J(i0 + l, k) * We[l];
      }
      for (const BlockColumn& other : block_columns_[b]) {
        if (other.column > k) break;  // in ascending order; the upper triangle suffices
        double sum = 0.;
        for (int l = other.first; l < other.first + other.count; ++l) {
          sum += J(i0 + l, other.column) * WJ_(i0 + l, k);
        }
        out.Lambda(other.column, k) += weight * sum;
        if (other.column != k) out.Lambda(k, other.column) += weight * sum;
      }
    }
  }
  IntrinsicJacobian Z(3, n);
  Z.noalias() = M_w_ * V;
  for (int k = 0; k < n; ++k) {
    const double z0 = weight * Z(0, k), z1 = weight * Z(1, k), z2 = weight * Z(2, k);
    double* column = out.Lambda.col(k).data();
    const double* v = V.data();
    for (int l = 0; l < n; ++l) column[l] -= z0 * v[l] + z1 * v[n + l] + z2 * v[2 * n + l];
  }
  out.chi2 += weight * chi2;
  out.dof += parity_dof();
}

}  // namespace viwo
