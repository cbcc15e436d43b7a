// A kinematic model from one templated function: derivatives by automatic differentiation.
//
//   class MyBase final : public viwo::AutoKinematics<MyBase> {
//    public:
//     MyBase(const viwo::ParamSet& params, const viwo::HostServices&);
//     void describe(viwo::ModelDescription& out) const override;
//     template <class T>
//     void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> steer_rad,
//               std::span<const T> x_WI, viwo::AutoRows<T>& out) const;  // out.A(i, j), out.b[i]
//   };
//
// Slip sources (NoiseKind::kSlip) must name one row each: the row whose b the slip is added to.
// A model may leave its row ranges empty (all rows). Preintegration takes about seven times as long
// as with derivatives by hand, so a model for production writes them out and keeps the automatic
// twin for its test.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <unsupported/Eigen/AutoDiff>

#include "viwo/api/kinematic_model.hpp"

namespace viwo {

/// A (m x 3) and b (m) in a scalar type, to be filled row by row; entries start at zero.
template <class T>
struct AutoRows {
  std::array<std::array<T, 3>, kMaxRows> rows{};
  std::array<T, kMaxRows> b{};
  T& A(int i, int j) { return rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]; }
};

template <class Derived>
class AutoKinematics : public KinematicModel {
 public:
  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool /*A_is_current*/,
              RowSystem& out) const final {
    AutoRows<double> values;
    derived().template auto_rows<double>(
        std::span<const double>(y.drive_rad_per_s.data(), static_cast<std::size_t>(y.n_drive)),
        std::span<const double>(y.steer_rad.data(), static_cast<std::size_t>(y.n_steer)),
        std::span<const double>(x_WI.data(), static_cast<std::size_t>(x_WI.size())), values);
    for (int i = 0; i < out.b.size(); ++i) {
      for (int j = 0; j < 3; ++j) out.A(i, j) = values.A(i, j);
      out.b[i] = values.b[static_cast<std::size_t>(i)];
    }
    return Status::kOk;
  }

  void intrinsic_derivatives(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& rows,
                             const RowVector& b, const Twist& xi, const RowVector& e,
                             IntrinsicDerivatives& out) const final {
    const bool measured = b == rows.b;
    const EncoderSample at = measured ? y : reading_for(y, x_WI, rows, b, xi);
    const int first = y.n_drive + y.n_steer, last = first + static_cast<int>(x_WI.size());
    differentiate(at, x_WI, first, last, xi, e, [&](int variable, const auto& J, const auto& DtE) {
      out.J.col(variable - first) = J;
      out.DtE.col(variable - first) = DtE;
    });
    if (!measured) carry_back(at, x_WI, rows, out.J);
  }

  void noise_derivatives(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& /*rows*/,
                         const RowVector& /*b*/, const Twist& xi, const RowVector& e,
                         NoiseDerivatives& out) const final {
    const auto& noises = this->noises();
    differentiate(y, x_WI, 0, y.n_drive + y.n_steer, xi, e,
                  [&](int variable, const auto& J, const auto& DtE) {
                    for (std::size_t k = 0; k < noises.size(); ++k) {
                      if (variable_of(noises[k], y) != variable) continue;
                      out.J.col(static_cast<int>(k)) = J;
                      out.DtE.col(static_cast<int>(k)) = DtE;
                    }
                  });
    for (std::size_t k = 0; k < noises.size(); ++k) {
      if (noises[k].kind != NoiseKind::kSlip) continue;
      const auto column = static_cast<int>(k);
      out.J.col(column).setZero();
      out.J(noises[k].rows.first, column) = 1.;
      out.DtE.col(column).setZero();
    }
  }

 private:
  /// Of its sigma, how much slip counts where encoders could have read what the rows ask for.
  static constexpr double kSlipShare = 0.01;

  /// Derivatives by so many variables are taken at once.
  static constexpr int kLanes = 16;
  using Gradient = Eigen::Matrix<double, kLanes, 1>;
  using Dual = Eigen::AutoDiffScalar<Gradient>;

  const Derived& derived() const { return static_cast<const Derived&>(*this); }

  /// Of the description, which is the same for good. Any thread may ask.
  const std::vector<NoiseSpec>& noises() const {
    std::call_once(described_, [this] {
      ModelDescription description;
      this->describe(description);
      noises_ = std::move(description.noises);
    });
    return noises_;
  }

  /// Among [drives, steers, intrinsics]; none of them for slip.
  static int variable_of(const NoiseSpec& noise, const EncoderSample& y) {
    if (noise.kind == NoiseKind::kSlip) return -1;
    return noise.channel + (noise.kind == NoiseKind::kSteer ? y.n_drive : 0);
  }

  /// Tells `use(variable, J, DtE)` the columns of the variables `first` .. `last` - 1 of [drives,
  /// steers, intrinsics]: d(b - A xi) and (dA)^T e.
  template <class Use>
  void differentiate(const EncoderSample& y, const Intrinsics& x_WI, int first, int last,
                     const Twist& xi, const RowVector& e, const Use& use) const {
    std::array<Dual, kMaxDrives + kMaxSteers + kMaxIntrinsics> variables;
    const auto n_drive = static_cast<std::size_t>(y.n_drive);
    const auto n_steer = static_cast<std::size_t>(y.n_steer);
    const auto n = static_cast<std::size_t>(x_WI.size());
    Dual* const all = variables.data();
    for (std::size_t i = 0; i < n_drive; ++i) all[i].value() = y.drive_rad_per_s[i];
    for (std::size_t i = 0; i < n_steer; ++i) all[n_drive + i].value() = y.steer_rad[i];
    for (std::size_t i = 0; i < n; ++i) all[n_drive + n_steer + i].value() = x_WI.data()[i];
    AutoRows<Dual> rows;
    Eigen::Matrix<double, Eigen::Dynamic, kLanes, Eigen::RowMajor, kMaxRows, kLanes> J(e.size(),
                                                                                       kLanes);
    Eigen::Matrix<double, 3, kLanes, Eigen::RowMajor> DtE;
    for (; first < last; first += kLanes) {
      const int end = std::min(last, first + kLanes);
      for (Dual& variable : variables) variable.derivatives().setZero();
      for (int k = first; k < end; ++k) all[k].derivatives()[k - first] = 1.;
      for (std::size_t i = 0; i < static_cast<std::size_t>(e.size()); ++i) {
        rows.rows[i].fill(Dual(0., Gradient::Zero()));
        rows.b[i] = Dual(0., Gradient::Zero());
      }
      derived().template auto_rows<Dual>(std::span<const Dual>(all, n_drive),
                                         std::span<const Dual>(all + n_drive, n_steer),
                                         std::span<const Dual>(all + n_drive + n_steer, n), rows);
      DtE.setZero();
      for (int i = 0; i < e.size(); ++i) {
        const auto row = static_cast<std::size_t>(i);
        J.row(i) = rows.b[row].derivatives().transpose();
        for (std::size_t j = 0; j < 3; ++j) {
          const auto dA = rows.rows[row][j].derivatives().transpose();
          J.row(i) -= xi[static_cast<int>(j)] * dA;
          DtE.row(static_cast<int>(j)) += e[i] * dA;
        }
      }
      for (int k = first; k < end; ++k) use(k, J.col(k - first), DtE.col(k - first));
    }
  }

  /// The encoder reading nearest to `y`, in units of the noise, for which the rows would hold at
  /// the twist. Two Gauss-Newton steps: b - rows.b may be many times the noise. Slip takes what
  /// the encoders cannot, and no more: a wheel that is told to slide sideways moves by its steering
  /// offset, in a direction that is noise.
  EncoderSample reading_for(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& rows,
                            const RowVector& b, const Twist& xi) const {
    EncoderSample moved = y;
    move_reading(x_WI, rows, xi, b - rows.b, moved);
    RowSystem at_moved = rows;
    this->rows(moved, x_WI, false, at_moved);
    move_reading(x_WI, at_moved, xi, at_moved.A * xi - at_moved.b, moved);
    return moved;
  }

  /// Derivatives at the reading `at`, by which the rows may have turned, to the rows of `rows`:
  /// what a change of the twist does as well must stay that. T = I + (A - A') A'^+ takes A' to A.
  void carry_back(const EncoderSample& at, const Intrinsics& x_WI, const RowSystem& rows,
                  RowJacobian& J) const {
    RowSystem there = rows;
    this->rows(at, x_WI, false, there);
    Eigen::Matrix3d AtA = there.A.transpose() * there.A;
    AtA.diagonal().array() += 1e-12 * AtA.trace();  // of a base that cannot tell its twist
    const TwistRowsJacobian as_twist = AtA.llt().solve(there.A.transpose() * J);
    J += (rows.A - there.A) * as_twist;
  }

  /// Moves `y`, where the model has `rows`, by the least noise that makes `needed` of the rows.
  void move_reading(const Intrinsics& x_WI, const RowSystem& rows, const Twist& xi,
                    const RowVector& needed, EncoderSample& y) const {
    const auto& noises = this->noises();
    NoiseDerivatives by_n;
    const int q = static_cast<int>(noises.size());
    by_n.J.setZero(needed.size(), q);
    by_n.DtE.setZero(3, q);
    const RowVector no_residual = RowVector::Zero(needed.size());
    noise_derivatives(y, x_WI, rows, rows.b, xi, no_residual, by_n);
    for (int k = 0; k < q; ++k) {
      const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
      by_n.J.col(k) *= noise.kind == NoiseKind::kSlip ? kSlipShare * noise.sigma : noise.sigma;
    }
    using Square =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows>;
    const Square R = by_n.J * by_n.J.transpose();
    const NoiseVector step = by_n.J.transpose() * Eigen::LLT<Square>(R).solve(needed);
    for (int k = 0; k < q; ++k) {
      const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
      const auto channel = static_cast<std::size_t>(noise.channel);
      if (noise.kind == NoiseKind::kDrive) y.drive_rad_per_s[channel] += noise.sigma * step[k];
      if (noise.kind == NoiseKind::kSteer) y.steer_rad[channel] += noise.sigma * step[k];
    }
  }

  mutable std::once_flag described_;
  mutable std::vector<NoiseSpec> noises_;
};

}  // namespace viwo
