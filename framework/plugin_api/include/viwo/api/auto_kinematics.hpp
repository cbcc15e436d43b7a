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
// A model may leave its row ranges empty (all rows). Derivatives cost about a hundred times those
// by hand, so a model for production writes them out and keeps the automatic twin for its test.
#pragma once

#include <array>
#include <span>

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
    const AutoRows<Dual> d = differentiate(reading_for(y, x_WI, rows, b, xi), x_WI);
    for (int k = 0; k < x_WI.size(); ++k) fill_column(d, k, xi, e, k, out);
  }

  void noise_derivatives(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& /*rows*/,
                         const RowVector& /*b*/, const Twist& xi, const RowVector& e,
                         NoiseDerivatives& out) const final {
    const ModelDescription description = described();
    const AutoRows<Dual> d = differentiate(y, x_WI);
    for (std::size_t k = 0; k < description.noises.size(); ++k) {
      const NoiseSpec& noise = description.noises[k];
      const int column = static_cast<int>(k);
      switch (noise.kind) {
        case NoiseKind::kDrive:
          fill_column(d, kFirstDrive + noise.channel, xi, e, column, out);
          break;
        case NoiseKind::kSteer:
          fill_column(d, kFirstSteer + noise.channel, xi, e, column, out);
          break;
        case NoiseKind::kSlip:
          out.J.col(column).setZero();
          out.J(noise.rows.first, column) = 1.;
          out.DtE.col(column).setZero();
          break;
      }
    }
  }

 private:
  static constexpr int kFirstDrive = kMaxIntrinsics;
  static constexpr int kFirstSteer = kMaxIntrinsics + kMaxDrives;
  static constexpr int kActive = kMaxIntrinsics + kMaxDrives + kMaxSteers;
  using Gradient = Eigen::Matrix<double, kActive, 1>;
  using Dual = Eigen::AutoDiffScalar<Gradient>;

  const Derived& derived() const { return static_cast<const Derived&>(*this); }

  ModelDescription described() const {
    ModelDescription description;
    this->describe(description);
    return description;
  }

  static Dual variable(double value, int index) {
    Dual dual(value, Gradient::Zero());
    dual.derivatives()[index] = 1.;
    return dual;
  }

  AutoRows<Dual> differentiate(const EncoderSample& y, const Intrinsics& x_WI) const {
    std::array<Dual, kMaxDrives> drive;
    std::array<Dual, kMaxSteers> steer;
    std::array<Dual, kMaxIntrinsics> x;
    const auto n_drive = static_cast<std::size_t>(y.n_drive);
    const auto n_steer = static_cast<std::size_t>(y.n_steer);
    const auto n = static_cast<std::size_t>(x_WI.size());
    for (std::size_t i = 0; i < n_drive; ++i) {
      drive[i] = variable(y.drive_rad_per_s[i], kFirstDrive + static_cast<int>(i));
    }
    for (std::size_t i = 0; i < n_steer; ++i) {
      steer[i] = variable(y.steer_rad[i], kFirstSteer + static_cast<int>(i));
    }
    for (std::size_t i = 0; i < n; ++i) x[i] = variable(x_WI.data()[i], static_cast<int>(i));
    AutoRows<Dual> out;
    for (auto& row : out.rows) row.fill(Dual(0., Gradient::Zero()));
    out.b.fill(Dual(0., Gradient::Zero()));
    derived().template auto_rows<Dual>(std::span<const Dual>(drive.data(), n_drive),
                                       std::span<const Dual>(steer.data(), n_steer),
                                       std::span<const Dual>(x.data(), n), out);
    return out;
  }

  /// Column `column` of `out`: derivatives by the active variable `variable_index`.
  template <class Derivatives>
  static void fill_column(const AutoRows<Dual>& d, int variable_index, const Twist& xi,
                          const RowVector& e, int column, Derivatives& out) {
    out.DtE.col(column).setZero();
    for (int i = 0; i < e.size(); ++i) {
      const auto row = static_cast<std::size_t>(i);
      double J = d.b[row].derivatives()[variable_index];
      for (std::size_t j = 0; j < 3; ++j) {
        const double dA = d.rows[row][j].derivatives()[variable_index];
        J -= dA * xi[static_cast<int>(j)];
        out.DtE(static_cast<int>(j), column) += dA * e[i];
      }
      out.J(i, column) = J;
    }
  }

  /// The encoder reading nearest to `y`, in units of the noise, for which the rows would hold with
  /// the signal `b` (slip takes what the encoders cannot): one Gauss-Newton step, so exact to
  /// second order in b - rows.b. `y` itself for the measured signal.
  EncoderSample reading_for(const EncoderSample& y, const Intrinsics& x_WI, const RowSystem& rows,
                            const RowVector& b, const Twist& xi) const {
    if (b == rows.b) return y;
    const ModelDescription description = described();
    NoiseDerivatives by_n;
    const int q = static_cast<int>(description.noises.size());
    by_n.J.setZero(b.size(), q);
    by_n.DtE.setZero(3, q);
    const RowVector no_residual = RowVector::Zero(b.size());
    noise_derivatives(y, x_WI, rows, rows.b, xi, no_residual, by_n);
    for (int k = 0; k < q; ++k) {
      by_n.J.col(k) *= description.noises[static_cast<std::size_t>(k)].sigma;
    }
    using Square =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows>;
    const Square R = by_n.J * by_n.J.transpose();
    const RowVector needed = Eigen::LLT<Square>(R).solve(b - rows.b);
    const NoiseVector step = by_n.J.transpose() * needed;
    EncoderSample moved = y;
    for (int k = 0; k < q; ++k) {
      const NoiseSpec& noise = description.noises[static_cast<std::size_t>(k)];
      const auto channel = static_cast<std::size_t>(noise.channel);
      if (noise.kind == NoiseKind::kDrive) moved.drive_rad_per_s[channel] += noise.sigma * step[k];
      if (noise.kind == NoiseKind::kSteer) moved.steer_rad[channel] += noise.sigma * step[k];
    }
    return moved;
  }
};

}  // namespace viwo
