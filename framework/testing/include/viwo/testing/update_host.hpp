// A host for tests of updates, small enough to see through: it takes their declarations, owns the
// estimates and their covariance, gives views of them, and applies factors as textbooks do.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ranges>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "viwo/api/status.hpp"
#include "viwo/api/update.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::testing {

/// Error state: inertial (15), clones (6 each), then blocks in the order in which they were
/// declared, those held left out. A copy is a host of its own, in which ids stay what they were:
/// another estimate, for the same updates. Updates of one host share its streams.
struct UpdateHost : Declarations {
  struct Block {
    BlockSpec spec;
    std::vector<double> value, first_estimate;  ///< as BlockSpec::value
    int column = -1;
  };

  explicit UpdateHost(Rig of_all = {}) : rig_(std::move(of_all)) {}

  ImuState imu;
  std::vector<CloneState> clones;
  std::vector<Block> blocks;  ///< by BlockId::index
  Eigen::MatrixXd P;
  ImuNoise imu_noise;
  bool oldest_leaves = false;

  // What was declared.
  std::vector<RoomSpec> rooms;
  std::vector<StreamSpec> streams;

  Rig& rig() override { return rig_; }
  BlockId block(const BlockSpec& spec) override {
    if (const int known = find(spec.name); known >= 0) {
      if (blocks[static_cast<std::size_t>(known)].spec == spec) return {known};
      throw InputError("block '" + spec.name + "' is declared twice, and not the same");
    }
    blocks.push_back({spec, spec.value, spec.value});
    return {static_cast<int>(blocks.size()) - 1};
  }
  BlockId block(std::string_view name) override {
    const int known = find(name);
    if (known < 0) throw std::logic_error("no block '" + std::string(name) + "' so far");
    return {known};
  }
  RoomId room(const RoomSpec& spec) override {
    rooms.push_back(spec);
    return {static_cast<int>(rooms.size()) - 1};
  }
  StreamId stream(const StreamSpec& spec) override {
    for (std::size_t i = 0; i < streams.size(); ++i) {
      const StreamSpec& known = streams[i];
      if (*known.type == *spec.type && known.sensor == spec.sensor && known.given == spec.given) {
        return {static_cast<int>(i)};
      }
    }
    streams.push_back(spec);
    return {static_cast<int>(streams.size()) - 1};
  }

  /// Declares and starts an update. Blocks that are new are held until layout().
  void start(Update& update) {
    update.declare(*this);
    update.start({.max_clones = std::max(2, static_cast<int>(clones.size())),
                  .max_state_size = static_cast<int>(P.rows())});
  }

  /// Gives clones and blocks their columns: a block whose sigmas are all zero is held. P is zero if
  /// its size changes.
  void layout() {
    int column = kImuSize;
    for (CloneState& clone : clones) {
      clone.column = column;
      column += kPoseSize;
    }
    for (Block& one : blocks) {
      const bool held = std::ranges::all_of(
          one.spec.entries, [](const BlockEntry& entry) { return entry.sigma == 0.; });
      one.column = held ? -1 : column;
      if (!held) column += static_cast<int>(one.spec.entries.size());
    }
    if (P.rows() != column) P = Eigen::MatrixXd::Zero(column, column);
  }

  /// Sets the covariance of the blocks to what they were declared with.
  void set_priors() {
    for (const Block& one : blocks) {
      for (std::size_t i = 0; one.column >= 0 && i < one.spec.entries.size(); ++i) {
        const int k = one.column + static_cast<int>(i);
        P.row(k).setZero();
        P.col(k).setZero();
        P(k, k) = one.spec.entries[i].sigma * one.spec.entries[i].sigma;
      }
    }
  }

  int column(BlockId id) const { return at(id).column; }
  Eigen::Map<Eigen::Matrix3d> rotation(BlockId id, int i = 0) {
    return Eigen::Map<Eigen::Matrix3d>(at(id).value.data() + 9 * i);
  }
  /// The entries behind the rotations.
  Eigen::Map<Eigen::VectorXd> numbers(BlockId id) {
    Block& one = at(id);
    return {one.value.data() + 9 * one.spec.rotations,
            static_cast<Eigen::Index>(one.spec.entries.size()) - 3 * one.spec.rotations};
  }

  /// Valid until the host changes.
  FilterView view() const {
    views_.clear();
    for (const Block& one : blocks) {
      views_.emplace_back(one.column, static_cast<int>(one.spec.entries.size()), one.spec.rotations,
                          one.value.data(), one.first_estimate.data());
    }
    FilterView view;
    view.imu = imu;
    view.clones = clones;
    view.blocks = views_;
    view.imu_noise = imu_noise;
    view.oldest_leaves = oldest_leaves;
    view.size = static_cast<int>(P.rows());
    view.covariance_data = P.data();
    view.covariance_stride = static_cast<int>(P.outerStride());
    return view;
  }

  /// An epoch with these samples, epoch(encoders, images): vectors or spans, each for the streams
  /// of its kind; the others have none. Valid until the next call.
  template <std::ranges::borrowed_range... Samples>
  EpochData epoch(Samples&&... samples) const {
    spans_.clear();
    for (const StreamSpec& stream : streams) spans_.push_back({stream.type, nullptr, 0});
    (give(std::span(samples)), ...);
    EpochData data;
    data.streams = spans_;
    return data;
  }

  /// Adds an error to the estimates (not to the first ones).
  void plus(const Eigen::VectorXd& d) {
    const auto rotate = [&](auto&& R, int column) {
      R = (exp_so3(-Eigen::Vector3d(d.segment<3>(column))) * R).eval();
    };
    rotate(imu.R_GtoI, kThetaColumn);
    imu.p_IinG += d.segment<3>(kPositionColumn);
    imu.v_IinG += d.segment<3>(kVelocityColumn);
    imu.gyro_bias += d.segment<3>(kGyroBiasColumn);
    imu.accel_bias += d.segment<3>(kAccelBiasColumn);
    for (CloneState& clone : clones) {
      rotate(clone.R_GtoI, clone.column);
      clone.p_IinG += d.segment<3>(clone.column + 3);
    }
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      if (blocks[k].column < 0) continue;
      const BlockId id{static_cast<int>(k)};
      const int rotations = blocks[k].spec.rotations;
      for (int i = 0; i < rotations; ++i) rotate(rotation(id, i), blocks[k].column + 3 * i);
      numbers(id) += d.segment(blocks[k].column + 3 * rotations, numbers(id).size());
    }
  }

  /// First estimates = estimates.
  void first_estimates() {
    imu.R_GtoI_fej = imu.R_GtoI;
    imu.p_IinG_fej = imu.p_IinG;
    imu.v_IinG_fej = imu.v_IinG;
    for (CloneState& clone : clones) {
      clone.R_GtoI_fej = clone.R_GtoI;
      clone.p_IinG_fej = clone.p_IinG;
    }
    for (Block& one : blocks) one.first_estimate = one.value;
  }

  /// A factor's Jacobian in the columns of the whole error state.
  static Eigen::MatrixXd spread(const FactorColumns& columns, const Eigen::MatrixXd& H,
                                Eigen::Index size) {
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(H.rows(), size);
    int from = 0;
    for (const ColumnRange block : columns.blocks()) {
      full.middleCols(block.first, block.count) = H.middleCols(from, block.count);
      from += block.count;
    }
    return full;
  }

  /// Updates with all factors, without gates; returns the chi-square of the residual factors.
  double apply(const FactorSink& sink) {
    double chi2 = 0.;
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(P.rows());
    for (const ResidualFactor& factor : sink.residuals()) chi2 += apply(factor, dx);
    if (sink.information() != nullptr) apply(*sink.information(), dx);
    plus(dx);
    return chi2;
  }

 private:
  int find(std::string_view name) const {
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (blocks[i].spec.name == name) return static_cast<int>(i);
    }
    return -1;
  }
  Block& at(BlockId id) { return blocks.at(static_cast<std::size_t>(id.index)); }
  const Block& at(BlockId id) const { return blocks.at(static_cast<std::size_t>(id.index)); }

  template <class T, std::size_t kExtent>
  void give(std::span<T, kExtent> samples) const {
    const SampleType& type = sample_type<std::remove_const_t<T>>();
    for (SampleSpan& span : spans_) {
      if (*span.type == type) span = {&type, samples.data(), samples.size()};
    }
  }

  double apply(const ResidualFactor& factor, Eigen::VectorXd& dx) {
    const Eigen::MatrixXd H = spread(factor.columns, factor.H, P.rows());
    const Eigen::MatrixXd S = H * P * H.transpose() + factor.R;
    const Eigen::VectorXd r = factor.residual - H * dx;
    const Eigen::MatrixXd K = S.llt().solve(H * P).transpose();
    dx += K * r;
    const Eigen::MatrixXd I_KH = Eigen::MatrixXd::Identity(P.rows(), P.rows()) - K * H;
    P = (I_KH * P * I_KH.transpose() + K * factor.R * K.transpose()).eval();
    return r.dot(S.llt().solve(r));
  }

  void apply(const InformationFactor& factor, Eigen::VectorXd& dx) {
    const int n = factor.columns.size();
    const Eigen::MatrixXd lower = factor.Lambda.topLeftCorner(n, n);
    const Eigen::MatrixXd symmetric = lower.selfadjointView<Eigen::Lower>();
    const Eigen::MatrixXd E = spread(factor.columns, Eigen::MatrixXd::Identity(n, n), P.rows());
    const Eigen::MatrixXd Lambda = E.transpose() * symmetric * E;
    const Eigen::VectorXd eta = E.transpose() * (factor.eta.head(n) - symmetric * E * dx);
    const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(P.rows(), P.rows()) + P * Lambda;
    P = M.partialPivLu().solve(P).eval();
    P = (0.5 * (P + P.transpose())).eval();
    dx += P * eta;
  }

  Rig rig_;
  mutable std::vector<BlockView> views_;
  mutable std::vector<SampleSpan> spans_;
};

}  // namespace viwo::testing
