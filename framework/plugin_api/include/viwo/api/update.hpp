// Update: turns the measurements of an epoch into factors. A plugin describes what was measured;
// only the host touches the estimate and its covariance.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/export.hpp"
#include "viwo/api/filter_view.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo {

inline constexpr int kMaxFactorRows = 24;
inline constexpr int kMaxFactorColumns = 80;
inline constexpr int kMaxFactorBlocks = 32;

/// Consecutive columns of the error state.
struct ColumnRange {
  int first = 0;
  int count = 0;
};

/// The columns that a factor's Jacobian has, block after block. Blocks must not overlap. Blocks
/// that are held (first < 0) must be left out.
class FactorColumns {
 public:
  void clear() { n_blocks_ = size_ = 0; }
  /// Returns where the block starts in the factor's own columns. std::out_of_range when too many.
  VIWO_API int add(int first, int count);
  std::span<const ColumnRange> blocks() const {
    return {blocks_.data(), static_cast<std::size_t>(n_blocks_)};
  }
  int size() const { return size_; }

 private:
  std::array<ColumnRange, kMaxFactorBlocks> blocks_{};
  int n_blocks_ = 0;
  int size_ = 0;
};

/// residual = measured - predicted = H dx + noise, Cov(noise) = R.
struct ResidualFactor {
  FactorColumns columns;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxFactorRows,
                kMaxFactorColumns>
      H;
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxFactorRows, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxFactorRows,
                kMaxFactorRows>
      R;
  /// The host drops the factor, and counts it, when the residual is less likely than this. 0: no
  /// gate.
  double gate_probability = 0.;

  /// Sizes H (zero), residual and R (zero) for `rows` and the columns added so far.
  VIWO_API void set_rows(int rows);
};

/// Many measurements at once, by their normal equations: the cost of an error dx of the columns is
/// dx^T Lambda dx - 2 eta^T dx + constant, Lambda = sum H^T R^-1 H, eta = sum H^T R^-1 residual.
/// Gates are the plugin's.
struct InformationFactor {
  FactorColumns columns;
  Eigen::MatrixXd Lambda;  ///< only the lower triangle of the leading columns.size() is read
  Eigen::VectorXd eta;
};

/// Where an update puts its factors. Storage belongs to the host and is used again: no allocation.
class VIWO_API FactorSink {
 public:
  FactorSink(int max_residual_factors, int max_state_size);

  /// An empty factor, std::out_of_range when there is no room for another one.
  ResidualFactor& add_residual();
  /// The one information factor of this epoch, no columns; Lambda and eta have room for all of
  /// the state and hold anything.
  InformationFactor& add_information();

  /// Measurements that the plugin has put into an information factor, or gated out of it.
  void count(std::int64_t applied, std::int64_t rejected) {
    applied_ += applied;
    rejected_ += rejected;
  }

  void clear();
  std::span<const ResidualFactor> residuals() const { return {residuals_.data(), n_residuals_}; }
  const InformationFactor* information() const {
    return has_information_ ? &information_ : nullptr;
  }
  std::int64_t applied() const { return applied_; }
  std::int64_t rejected() const { return rejected_; }

 private:
  std::vector<ResidualFactor> residuals_;
  std::size_t n_residuals_ = 0;
  InformationFactor information_;
  bool has_information_ = false;
  std::int64_t applied_ = 0;
  std::int64_t rejected_ = 0;
};

/// What an update is told once, before its first epoch.
struct UpdateSetup {
  int max_clones = 0;  ///< that exist during an update, the newest included
  int max_state_size = 0;
  std::span<const CameraView> cameras;
  const WheelsView* wheels = nullptr;  ///< the wheel set that this update is for, if any
};

/// What the host gives to an update.
enum class UpdateKind : std::uint8_t {
  kBody,    ///< one instance: IMU, features
  kWheels,  ///< one instance for each wheel set, with its encoder samples
  kPoses    ///< one instance, with the poses of the sensor that its section names (`sensor: NAME`)
};

/// Calls are serialised by the host: start() once, then update() once per epoch, in time order.
/// update() must not allocate in the steady state.
class VIWO_API Update {
 public:
  virtual ~Update();
  virtual UpdateKind kind() const = 0;
  /// Allocates. Throws InputError when the configuration lacks something (a camera, ...).
  virtual void start(const UpdateSetup& setup) = 0;
  /// Adds factors to `sink`. The factors of one call are linearised at the same estimate and
  /// applied one after the other, residual factors first.
  virtual void update(const FilterView& filter, const EpochData& data, FactorSink& sink) = 0;
  /// What was not used, and why; appended to `out`.
  virtual void rejections(std::vector<RejectionCount>& out) const;
};

}  // namespace viwo
