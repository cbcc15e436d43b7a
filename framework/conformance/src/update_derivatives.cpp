#include "update_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "viwo/estimator/factor_fit.hpp"
#include "viwo/filter/propagation.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/robot/robot.hpp"

namespace viwo::conformance {
namespace {

using Eigen::VectorXd;

/// A part of the largest derivative by a block that Jacobians at first estimates, and what is left
/// out of them on purpose, may be off by.
constexpr double kTolerance = 0.1;
/// Steps are so small a part of what a column is known to.
constexpr double kStep = 1e-3;

/// What an update emitted in an epoch.
struct Emitted {
  std::vector<ResidualFactor> residuals;
  std::optional<InformationFactor> information;
  std::vector<std::pair<int, VectorXd>> added;  ///< first columns and values of new blocks

  Emitted(const FactorSink& sink, const FilterView& filter)
      : residuals(sink.residuals().begin(), sink.residuals().end()) {
    if (sink.information() != nullptr) information = *sink.information();
    for (const AddedBlock& block : sink.added()) {
      const BlockView& view = filter.block(block.id);
      added.emplace_back(view.column(),
                         Eigen::Map<const VectorXd>(block.value.data(), view.size()));
    }
  }
  bool is_empty() const { return residuals.empty() && !information; }
  bool fits(int state_size) const {
    const auto good = [state_size](const auto& f) { return misfit_of(f, state_size).empty(); };
    return std::ranges::all_of(residuals, good) && (!information || good(*information));
  }
};

/// A column of the error state: of what, and how well it is known.
struct Column {
  std::vector<int> indices;  ///< of the pose of the IMU also that of the newest clone, which it is
  int block = 0;             ///< columns of one have the same
  std::string name;
  double sigma = 0.;
};

std::vector<Column> columns_of(const FilterView& filter) {
  std::vector<Column> columns;
  int block = 0;
  const auto add = [&](const std::string& of, int first, int count) {
    for (int i = first; i < first + count; ++i) {
      const double sigma = std::sqrt(std::max(0., filter.P()(i, i)));
      columns.push_back({{i}, block, of + std::to_string(i - first + 1), sigma});
      if (i < kPoseSize && !filter.clones.empty()) {
        columns.back().indices.push_back(filter.clones.back().column + i);
      }
    }
    ++block;
  };
  add("theta of the IMU, ", kThetaColumn, 3);
  add("p of the IMU, ", kPositionColumn, 3);
  add("v of the IMU, ", kVelocityColumn, 3);
  add("gyro bias, ", kGyroBiasColumn, 3);
  add("accelerometer bias, ", kAccelBiasColumn, 3);
  for (std::size_t i = 0; i + 1 < filter.clones.size(); ++i) {
    const std::string clone = " of clone " + std::to_string(i) + ", ";
    add("theta" + clone, filter.clones[i].column, 3);
    add("p" + clone, filter.clones[i].column + 3, 3);
  }
  for (std::size_t i = 0; i < filter.blocks.size(); ++i) {
    const BlockView& view = filter.blocks[i];
    if (view.column() < 0) continue;
    add("block " + std::to_string(i) + ", entry ", view.column(), view.size());
  }
  return columns;
}

/// A filter whose estimate is moved along one column, first estimates stay.
class MovedView {
 public:
  MovedView(const FilterView& filter, const Column& column, double step)
      : view_(filter),
        clones_(filter.clones.begin(), filter.clones.end()),
        blocks_(filter.blocks.begin(), filter.blocks.end()) {
    const auto along = [&](int first, int count) {
      VectorXd dx = VectorXd::Zero(count);
      for (const int index : column.indices) {
        if (index >= first && index < first + count) dx[index - first] = step;
      }
      return dx;
    };
    retract(along(0, kImuSize), view_.imu);
    for (CloneState& clone : clones_) {
      const VectorXd dx = along(clone.column, kPoseSize);
      clone.R_GtoI = exp_so3(Eigen::Vector3d(-dx.head<3>())) * clone.R_GtoI;
      clone.p_IinG += dx.tail<3>();
    }
    for (BlockView& block : blocks_) {
      if (block.column() < 0) continue;
      const VectorXd dx = along(block.column(), block.size());
      if (!dx.isZero(0.)) move(dx, block);
    }
    view_.clones = clones_;
    view_.blocks = blocks_;
  }
  const FilterView& operator*() const { return view_; }

 private:
  void move(const VectorXd& dx, BlockView& block) {
    const int numbers = static_cast<int>(block.numbers().size());
    const int rotations = (block.size() - numbers) / 3;
    value_.resize(9 * rotations + numbers);
    first_.resize(9 * rotations + numbers);
    for (int i = 0; i < rotations; ++i) {
      Eigen::Map<Eigen::Matrix3d> moved(value_.data() + 9 * i), first(first_.data() + 9 * i);
      moved = exp_so3(Eigen::Vector3d(-dx.segment<3>(3 * i))) * block.rotation(i);
      first = block.first_rotation(i);
    }
    value_.tail(numbers) = block.numbers() + dx.tail(numbers);
    first_.tail(numbers) = block.first_numbers();
    block = BlockView(block.column(), block.size(), rotations, value_.data(), first_.data());
  }

  FilterView view_;
  std::vector<CloneState> clones_;
  std::vector<BlockView> blocks_;
  VectorXd value_, first_;
};

/// Where a filter is moved for the update, and by how much; the filter itself is not.
struct Move {
  int epoch = -1;  ///< none
  Column column = {};
  double step = 0.;
};

/// Stands in for the plugin, and keeps what it emits in an epoch.
class Differenced final : public Update {
 public:
  Differenced(Loaded<Update> plugin, Move move)
      : plugin_(std::move(plugin)), move_(std::move(move)) {}

  void declare(Declarations& host) override { plugin_.object->declare(host); }
  void start(const UpdateSetup& setup) override { plugin_.object->start(setup); }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    const int epoch = ++epoch_;
    if (epoch == move_.epoch) {
      plugin_.object->update(*MovedView(filter, move_.column, move_.step), data, sink);
      keep(sink, filter);
      return;
    }
    plugin_.object->update(filter, data, sink);
    if (move_.epoch >= 0 || !keep(sink, filter)) return;
    emitted_in_ = epoch;
    columns_ = columns_of(filter);
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    plugin_.object->settle(filter, edits);
  }

  const std::optional<Emitted>& emitted() const { return emitted_; }
  int emitted_in() const { return emitted_in_; }
  const std::vector<Column>& columns() const { return columns_; }

 private:
  /// False for nothing, or what other checks say is wrong.
  bool keep(const FactorSink& sink, const FilterView& filter) {
    Emitted emitted(sink, filter);
    if (emitted.is_empty() || !emitted.fits(filter.size)) return false;
    emitted_ = std::move(emitted);
    return true;
  }

  Loaded<Update> plugin_;
  Move move_;
  int epoch_ = -1;
  int emitted_in_ = -1;  ///< the last epoch with anything
  std::optional<Emitted> emitted_;
  std::vector<Column> columns_;
};

/// Where a column of the state stands in a factor; -1: not in it.
int place_in(const FactorColumns& columns, int column) {
  int start = 0;
  for (const ColumnRange& block : columns.blocks()) {
    if (column >= block.first && column < block.first + block.count) {
      return start + column - block.first;
    }
    start += block.count;
  }
  return -1;
}

/// Compares one epoch with the same epoch from a moved estimate.
class Comparison {
 public:
  Comparison(const Emitted& there, const std::vector<Column>& columns, Findings& findings)
      : there_(there), columns_(columns), findings_(findings) {}

  bool has(const Column& column) const {
    const auto in = [&](const auto& factor) {
      return std::ranges::any_of(column.indices,
                                 [&](int index) { return place_in(factor.columns, index) >= 0; });
    };
    return std::ranges::any_of(there_.residuals, in) ||
           (there_.information && in(*there_.information));
  }

  void with(const Emitted& moved, const Column& column, double step) {
    if (moved.residuals.size() == there_.residuals.size()) {
      for (std::size_t i = 0; i < there_.residuals.size(); ++i) {
        const ResidualFactor& there = there_.residuals[i];
        const VectorXd dx = errors(there.columns, moved, column, step);
        compare("residual factor " + std::to_string(i), there, moved.residuals[i], dx, column);
      }
    }
    if (there_.information && moved.information) {
      const VectorXd dx = errors(there_.information->columns, moved, column, step);
      compare(*there_.information, *moved.information, dx, column);
    }
  }

 private:
  /// What the columns of a factor were moved by, blocks that are added in this epoch, too; in steps
  /// of what the column is known to.
  VectorXd errors(const FactorColumns& columns, const Emitted& moved, const Column& column,
                  double step) const {
    VectorXd dx = VectorXd::Zero(columns.size());
    const auto move = [&](int index, double by) {
      if (const int place = place_in(columns, index); place >= 0) dx[place] += by / kStep;
    };
    for (const int index : column.indices) move(index, step);
    for (std::size_t k = 0; k < there_.added.size() && k < moved.added.size(); ++k) {
      const VectorXd by = moved.added[k].second - there_.added[k].second;
      for (int i = 0; i < by.size(); ++i) move(there_.added[k].first + i, by[i]);
    }
    return dx;
  }

  /// How well the columns of a factor are known; 0 for those of another block than `block`, if that
  /// is one.
  VectorXd known(const FactorColumns& columns, int block = -1) const {
    VectorXd sigma = VectorXd::Zero(columns.size());
    for (const Column& column : columns_) {
      if (block >= 0 && column.block != block) continue;
      for (const int index : column.indices) {
        if (const int place = place_in(columns, index); place >= 0) sigma[place] = column.sigma;
      }
    }
    return sigma;
  }

  void compare(const std::string& what, const ResidualFactor& there, const ResidualFactor& moved,
               const VectorXd& dx, const Column& column) {
    if (moved.residual.size() != there.residual.size()) return;
    const VectorXd found = (there.residual - moved.residual) / kStep;
    const VectorXd of_block = known(there.columns, column.block), of_all = known(there.columns);
    for (Eigen::Index i = 0; i < found.size(); ++i) {
      const auto row = there.H.row(i).transpose().cwiseAbs();
      const double expected = there.H.row(i).dot(dx);
      const double allowed = kTolerance * row.cwiseProduct(of_block).maxCoeff() +
                             kNegligible * row.cwiseProduct(of_all).maxCoeff() +
                             kNegligible * std::sqrt(there.R(i, i));
      if (std::abs(found[i] - expected) <= allowed) continue;
      fail(what, column,
           "by H row " + std::to_string(i) + " of the residual should change by " +
               number(0. - expected / column.sigma) + " for 1, and does by " +
               number(-found[i] / column.sigma) +
               " - residual = measured - predicted = H dx + noise, R_GtoI = Exp(-dtheta) "
               "R_GtoI_hat");
    }
  }

  void compare(const InformationFactor& there, const InformationFactor& moved, const VectorXd& dx,
               const Column& column) {
    const Eigen::Index n = dx.size();
    if (moved.columns.size() != n) return;
    const Eigen::MatrixXd Lambda = there.Lambda.topLeftCorner(n, n).selfadjointView<Eigen::Lower>();
    const VectorXd found = (there.eta.head(n) - moved.eta.head(n)) / kStep;
    const VectorXd expected = Lambda * dx;
    // Where there is no information, rounding may leave less.
    const VectorXd scale = Lambda.diagonal().cwiseMax(0.).cwiseSqrt();
    const VectorXd sigma = known(there.columns);
    const double size = scale.cwiseProduct(dx).norm();
    for (Eigen::Index i = 0; i < n; ++i) {
      const double off = std::abs(found[i] - expected[i]);
      // What a factor says nothing of may change to second order in a step.
      const bool is_told =
          scale[i] * sigma[i] > kNothing || std::abs(there.eta[i]) * sigma[i] > kNegligible;
      if (!is_told) continue;
      if (off <= scale[i] * (kTolerance * size + kNegligible) || off * sigma[i] <= kNegligible) {
        continue;
      }
      fail("information factor", column,
           "by Lambda row " + std::to_string(i) + " of eta should change by " +
               number(0. - expected[i] / column.sigma) + " for 1, and does by " +
               number(-found[i] / column.sigma) + " - eta = sum H^T R^-1 residual");
    }
  }

  /// The first of a factor and a block.
  void fail(const std::string& what, const Column& column, const std::string& text) {
    if (!reported_.insert(what + std::to_string(column.block)).second) return;
    findings_.fail(what + ", column " + std::to_string(column.indices.front()) + " (" +
                   column.name + "): " + text);
  }

  static constexpr double kNegligible = 1e-2;  ///< sigmas of a measurement
  static constexpr double kNothing = 1e-3;     ///< root of information, over that of the prior
  const Emitted& there_;
  const std::vector<Column>& columns_;
  Findings& findings_;
  std::set<std::string> reported_;
};

/// The numbers of columns that were looked at.
int check_on(const char* motion, const Subject& subject, Findings& findings) {
  const robot::Drive drive = robot::simulate_drive(motion, 2., false);
  const auto run = [&](const std::vector<Move>& moves) {
    std::vector<std::shared_ptr<Differenced>> runs;
    for (const Move& move : moves) {
      runs.push_back(std::make_shared<Differenced>(subject.make_exact_update(), move));
    }
    const std::vector<std::shared_ptr<Update>> updates(runs.begin(), runs.end());
    robot::run_updates(updates, subject.info().name, drive, robot::Calibration::kEstimated);
    return runs;
  };
  const auto there = run({Move()}).front();
  if (!there->emitted()) return 0;
  Comparison compare(*there->emitted(), there->columns(), findings);
  std::vector<Move> moves;
  for (const Column& column : there->columns()) {
    if (!(column.sigma > 0.) || !compare.has(column)) continue;
    moves.push_back({there->emitted_in(), column, kStep * column.sigma});
  }
  const auto moved = run(moves);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (moved[i]->emitted()) compare.with(*moved[i]->emitted(), moves[i].column, moves[i].step);
  }
  return static_cast<int>(moves.size());
}

}  // namespace

void check_update_derivatives(const Subject& subject, Findings& findings) {
  int columns = 0;
  for (const char* motion : {"stationary", "figure_eight"}) {
    columns += check_on(motion, subject, findings);
  }
  findings.note(std::to_string(columns) + " columns moved");
}

}  // namespace viwo::conformance
