#include "factor_collector.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "viwo/filter/propagation.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::smoother {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The inverse of a covariance whose units differ by many orders of magnitude. What has no noise at
/// all (a bias that does not walk) gets a little.
ImuMatrix information_of(const ImuMatrix& covariance) {
  constexpr double kLeast = 1e-18;
  const ImuVector scale = covariance.diagonal().cwiseMax(kLeast).cwiseSqrt().cwiseInverse();
  ImuMatrix unit = scale.asDiagonal() * covariance * scale.asDiagonal();
  for (int i = 0; i < kImuSize; ++i) {
    if (!(covariance(i, i) > kLeast)) unit(i, i) = 1.;
  }
  const ImuMatrix inverse = unit.ldlt().solve(ImuMatrix::Identity());
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

}  // namespace

FactorCollector::FactorCollector(const PathRecorder& run, const ImuState& start, std::size_t epochs,
                                 const BlockColumns& columns, int n_shared)
    : system_(n_shared),
      blocks_(columns),
      first_moving_(kImuSize * (static_cast<int>(epochs) + 1) + columns.own),
      next_in_room_(first_moving_ + static_cast<int>(columns.moving.size() * epochs)),
      prior_(run.prior().P) {
  // Behind the path, where blocks of the recording itself stand.
  const int behind = first_moving_ - blocks_.own;
  for (int& unknown : blocks_.unknown) {
    if (unknown >= 0) unknown += behind;
  }
  columns_.resize(kImuSize);
  std::iota(columns_.begin(), columns_.end(), 0);
  const ImuMatrix Lambda = information_of(run.start().P);
  system_.add(columns_, Lambda, -Lambda * difference(start, run.start().state));
}

void FactorCollector::on_propagated(const Filter& filter, const ImuTransition& transition) {
  transition_ = transition;
  predicted_ = filter.imu();
}

void FactorCollector::on_clone(const Filter& filter, const ImuMatrix& /*Phi*/) {
  const auto slot = static_cast<std::size_t>(filter.clones().back().slot);
  if (slot >= epoch_in_slot_.size()) epoch_in_slot_.resize(slot + 1);
  path_.epochs.push_back({filter.t_ns(), filter.imu()});
  epoch_in_slot_[slot] = path_.epochs.size();
  // (SM-2)
  const ImuMatrix information = information_of(transition_.Q);
  Eigen::Matrix<double, kImuSize, 2 * kImuSize> J;
  J << -transition_.Phi, ImuMatrix::Identity();
  columns_.resize(2 * kImuSize);
  std::iota(columns_.begin(), columns_.end(),
            kImuSize * (static_cast<int>(path_.epochs.size()) - 1));
  const Eigen::Matrix<double, 2 * kImuSize, kImuSize> weighted = J.transpose() * information;
  system_.add(columns_, weighted * J, -weighted * difference(filter.imu(), predicted_));
  tie_moving(filter);
}

/// (SM-6)
void FactorCollector::tie_moving(const Filter& filter) {
  const auto n = static_cast<int>(blocks_.moving.size());
  const auto epoch = static_cast<int>(path_.epochs.size()) - 1;
  for (int i = 0; i < n; ++i) {
    const MovingEntry& entry = blocks_.moving[static_cast<std::size_t>(i)];
    const int now = first_moving_ + n * epoch + i;
    blocks_.unknown[static_cast<std::size_t>(entry.column)] = now;
    if (epoch == 0) {
      const double variance = prior_(entry.column, entry.column);
      system_.add({&now, 1}, MatrixXd::Constant(1, 1, 1. / variance), VectorXd::Zero(1));
      continue;
    }
    const double dt_s =
        seconds_between(path_.epochs[static_cast<std::size_t>(epoch) - 1].t_ns, filter.t_ns());
    const bool settles = entry.time_constant_s > 0.;
    const double kept = settles ? std::exp(-dt_s / entry.time_constant_s) : 1.;
    const double gained = settles ? 1. - kept * kept : dt_s;
    const Eigen::Vector2d J(-kept, 1.);
    const int both[] = {now - n, now};
    system_.add(both, J * J.transpose() / (gained * std::pow(entry.process_sigma, 2)),
                Eigen::Vector2d::Zero());
  }
}

void FactorCollector::on_drop(const Filter& filter, BlockId block) {
  const BlockView& view = filter.blocks().view(block);
  const auto first = blocks_.unknown.begin() + view.column() - filter.blocks().first_column();
  std::fill(first, first + view.size(), kInRoom);
}

int FactorCollector::unknown(const Filter& filter, int column) {
  const int first_block = filter.blocks().first_column();
  if (column >= first_block) {
    int& unknown = blocks_.unknown[static_cast<std::size_t>(column - first_block)];
    if (unknown == kInRoom) unknown = next_in_room_++;
    return unknown;
  }
  if (column < kImuSize) return kImuSize * static_cast<int>(path_.epochs.size()) + column;
  const int of_clones = column - kImuSize;
  const std::size_t epoch = epoch_in_slot_[static_cast<std::size_t>(of_clones / kPoseSize)];
  return kImuSize * static_cast<int>(epoch) + of_clones % kPoseSize;
}

void FactorCollector::collect(const Filter& filter, const FactorColumns& columns) {
  columns_.clear();
  for (const ColumnRange& range : columns.blocks()) {
    for (int i = 0; i < range.count; ++i) columns_.push_back(unknown(filter, range.first + i));
  }
}

void FactorCollector::on_factor(const Filter& filter, const UpdateEntry& /*update*/,
                                const ResidualFactor& factor) {
  const Eigen::LLT<MatrixXd> R(factor.R);
  if (R.info() != Eigen::Success || !factor.residual.allFinite() || !factor.H.allFinite()) return;
  const MatrixXd H = R.matrixL().solve(MatrixXd(factor.H));
  const VectorXd r = R.matrixL().solve(VectorXd(factor.residual));
  ++rows_;
  // (SM-3)
  double weight = 1.;
  if (factor.gate_probability > 0.) {
    const double gate = chi2_quantile(1. - factor.gate_probability, static_cast<double>(r.size()));
    weight = std::min(1., gate / r.squaredNorm());
  }
  if (weight < 1.) ++weighed_down_;
  collect(filter, factor.columns);
  system_.add(columns_, weight * (H.transpose() * H), weight * (H.transpose() * r));
}

void FactorCollector::on_factor(const Filter& filter, const UpdateEntry& /*update*/,
                                const InformationFactor& factor) {
  const int n = factor.columns.size();
  if (n == 0) return;
  if (!factor.eta.head(n).allFinite()) return;
  collect(filter, factor.columns);
  system_.add(columns_, factor.Lambda.topLeftCorner(n, n), factor.eta.head(n));
}

}  // namespace viwo::smoother
