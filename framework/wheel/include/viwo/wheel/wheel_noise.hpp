// How large each noise of the wheels is, by kind and by channel, as far as how they contradict each
// other tells. Equations: docs/math/wheel_odometry.md, W-14, W-15.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "viwo/api/noise_scale.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// Variance components of the parity residual: each noise source of the model has one.
class WheelNoise {
 public:
  explicit WheelNoise(std::shared_ptr<const WheelModel> model);

  /// A sample that no wheel lies in, at the calibration x_WI of covariance P. Samples about which
  /// the calibration leaves more open than the noise are passed over, and so are outliers and a
  /// base that stands.
  void add(const EncoderSample& y, const Intrinsics& x_WI, const IntrinsicMatrix& P);

  struct Part {
    const NoiseSpec* noise;  ///< or the first one of its parameter
    bool alone;              ///< false: all sources of the parameter, as if they were alike
    double variance, sigma;  ///< as a factor on what is configured, and its standard deviation
  };
  /// What the samples tell: of each kind, and of each channel that is clearly worse than its kind.
  std::vector<Part> parts() const;
  /// Appends them by the parameters of the model.
  void append_to(std::vector<NoiseFound>& out) const;

 private:
  using Columns =
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxNoises>;
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxNoises,
                               kMaxNoises>;
  struct Kinds {
    std::array<std::size_t, kMaxNoises> first{};  ///< source of each kind
    std::size_t size = 0;                         ///< how many kinds
    Square members;  ///< q x size: variance of a source per factor of its kind
  };
  /// Factors on variances, and their standard deviations.
  struct Estimate {
    NoiseVector factor, sigma;
  };

  void forget();
  bool stands(const EncoderSample& y) const;
  bool is_outlier(double chi2, int dof);
  Kinds by_parameter() const;
  Estimate estimate(const Square& members) const;
  int q() const { return model_->n_noises(); }

  std::shared_ptr<const WheelModel> model_;
  std::vector<double> gates_;  ///< by degrees of freedom
  NoiseScale common_;          ///< of all noises together, by which outliers are known
  NoiseVector configured_;     ///< variance of each source
  NoiseVector variance_;       ///< likewise, with which the rows are weighed
  Square N_;                   ///< q x q, of the normal equations (W-15)
  NoiseVector h_;
  std::int64_t count_ = 0;      ///< samples in them
  std::size_t references_ = 0;  ///< how often the weights were renewed
  RowSystem rows_;
  IntrinsicDerivatives by_x_;
  NoiseDerivatives by_n_;
};

}  // namespace viwo
