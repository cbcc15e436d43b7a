// Rank of the rows, gauge, change of the odometry frame, inverse kinematics.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/SVD>

#include "kinematics.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::conformance {

using robot::Answer;
using robot::Bench;
using robot::Probe;
using robot::Signal;

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kMotions = 60;
constexpr double kRankTolerance = 1e-8;

int rank_of(const MatrixXd& M) {
  if (M.cols() == 0 || M.rows() == 0) return 0;
  const VectorXd values = Eigen::JacobiSVD<MatrixXd>(M).singularValues();
  return static_cast<int>((values.array() > kRankTolerance * values[0]).count());
}

/// "v_x and omega cannot be told apart": what A xi does not depend on, for a rank below 3.
std::string hidden_in(const MatrixXd& A, int rank) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  const MatrixXd hidden = svd.matrixV().rightCols(3 - rank);
  constexpr const char* kNames[] = {"v_x", "v_y", "omega"};
  std::vector<std::string> names;
  for (int j = 0; j < 3; ++j) {
    if (hidden.row(j).norm() > 1e-6) names.emplace_back(kNames[j]);
  }
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) {
    text += (i + 1 < names.size() ? ", " : " and ") + names[i];
  }
  const bool mixed = static_cast<int>(names.size()) > 3 - rank;
  return text + (mixed ? " cannot be told apart" : " cannot be told");
}

/// The twist of O' from that of O; `g` = [yaw, x, y] of O' in O.
Twist moved_twist(const Vector3d& g, const Twist& xi) {
  Twist out;
  out << R2(g[0]).transpose() * (xi.head<2>() + xi.z() * J2() * g.tail<2>()), xi.z();
  return out;
}

/// All that the rows of general motion say about intrinsics and where O is on a body whose motion
/// is known (three more columns), as a triangle with columns of unit norm.
MatrixXd information(const Bench& bench) {
  std::mt19937_64 rng(6);
  const std::vector<Probe> probes = bench.random_motions(kMotions, bench.unequal(rng));
  const int n = bench.n_x(), m = bench.description().n_rows;
  MatrixXd M(static_cast<Eigen::Index>(probes.size()) * m, n + 3);
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const Answer answer = bench.answer(probes[i], Signal::kFitted);
    const Twist& xi = probes[i].xi;
    Eigen::Matrix3d by_g = Eigen::Matrix3d::Zero();
    by_g.col(0) << xi.y(), -xi.x(), 0.;
    by_g.col(1) << 0., xi.z(), 0.;
    by_g.col(2) << -xi.z(), 0., 0.;
    M.middleRows(static_cast<Eigen::Index>(i) * m, m) << answer.by_x.J, -(answer.rows.A * by_g);
  }
  for (int k = 0; k < n + 3; ++k) {
    const double norm = M.col(k).norm();
    if (norm > 0.) M.col(k) /= norm;
  }
  return M;
}

MatrixXd without(const MatrixXd& M, const std::vector<int>& columns) {
  std::vector<int> kept;
  for (int k = 0; k < M.cols(); ++k) {
    if (std::find(columns.begin(), columns.end(), k) == columns.end()) kept.push_back(k);
  }
  return M(Eigen::all, kept);
}

/// How the gauge entries move with the frame.
MatrixXd frame_directions(const Bench& bench, const std::vector<int>& gauge,
                          const std::vector<int>& ways) {
  const Intrinsics x_WI = bench.nominal();
  constexpr double kStep = 1e-6;
  MatrixXd F(static_cast<Eigen::Index>(gauge.size()), static_cast<Eigen::Index>(ways.size()));
  for (std::size_t j = 0; j < ways.size(); ++j) {
    const Vector3d g = kStep * Vector3d::Unit(ways[j]);
    Intrinsics ahead = x_WI, behind = x_WI;
    bench.model().move_frame(g, ahead);
    bench.model().move_frame(-g, behind);
    for (std::size_t i = 0; i < gauge.size(); ++i) {
      const int k = gauge[i];
      F(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          (ahead[k] - behind[k]) / (2. * kStep);
    }
  }
  return F;
}

std::string names_of(const Bench& bench, const std::vector<int>& entries) {
  std::string text;
  for (const int k : entries) {
    text += (text.empty() ? "" : ", ") +
            bench.description().intrinsics[static_cast<std::size_t>(k)].name;
  }
  return text.empty() ? "none" : text;
}

/// Of yaw, x and y those that move_frame() can change.
std::vector<int> movable(const Bench& bench) {
  std::vector<int> directions;
  for (int j = 0; j < 3; ++j) {
    Intrinsics x_WI = bench.nominal();
    if (bench.model().move_frame(1e-3 * Vector3d::Unit(j), x_WI) == Status::kOk) {
      directions.push_back(j);
    }
  }
  return directions;
}

}  // namespace

void check_rank(const Bench& bench, Findings& findings) {
  // At the same intrinsics, so that rows of one direction stay of one direction.
  const Intrinsics x_WI = bench.nominal();
  MatrixXd all(0, 3);
  int best = 0;
  for (const Probe& probe : bench.probes()) {
    const auto rows = bench.rows(probe.y, x_WI);
    if (!rows || !rows->A.allFinite()) continue;
    best = std::max(best, rank_of(rows->A));
    all.conservativeResize(all.rows() + rows->A.rows(), 3);
    all.bottomRows(rows->A.rows()) = rows->A;
  }
  if (all.rows() == 0) return findings.note("the model answers none of the readings tried");
  const int rank = rank_of(all);
  if (rank < 3) {
    findings.fail("A has rank " + std::to_string(rank) +
                  " at all readings tried: " + hidden_in(all, rank) +
                  " - check the signs of A; a direction that no wheel measures needs a row with "
                  "a slip source (v_y = 0)");
  } else if (best < 3) {
    findings.warn("A has rank " + std::to_string(best) +
                  " at most: no reading alone tells the whole twist, and the base needs another "
                  "source of motion - if that is not meant, check the signs of A");
  }
}

void check_gauge(const Bench& bench, Findings& findings) {
  std::vector<int> gauge;
  for (int k = 0; k < bench.n_x(); ++k) {
    if (bench.description().intrinsics[static_cast<std::size_t>(k)].gauge_fixed) gauge.push_back(k);
  }
  const MatrixXd M = information(bench);
  if (M.rows() == 0) return findings.note("no motion was found that the rows can follow");
  const int rank = rank_of(M);
  std::vector<int> held;
  for (const int k : gauge) {
    held.push_back(k);
    const int left = rank_of(without(M, held));
    if (left == rank) continue;
    findings.fail("entry '" + bench.description().intrinsics[static_cast<std::size_t>(k)].name +
                  "' is not gauge: motion shows it (rank " + std::to_string(rank) + " falls to " +
                  std::to_string(left) +
                  " when it is held), so holding a wrong value would spoil the others - do not set "
                  "gauge_fixed");
    held.pop_back();
  }
  const auto hidden = M.cols() - static_cast<Eigen::Index>(held.size()) - rank;
  findings.note("gauge entries: " + names_of(bench, gauge) + "; " + std::to_string(hidden) +
                " directions of intrinsics and frame stay unobservable in general motion");
  const std::vector<int> ways = movable(bench);
  if (ways.empty() || !findings.failures().empty()) return;
  const int placed = rank_of(frame_directions(bench, gauge, ways));
  if (placed < static_cast<int>(ways.size())) {
    findings.fail("move_frame() moves O in " + std::to_string(ways.size()) +
                  " ways, but the gauge entries (" + names_of(bench, gauge) + ") hold only " +
                  std::to_string(placed) +
                  " of them - hold what places O on the body, or let move_frame() answer "
                  "kUnsupported");
  }
}

void check_move_frame(const Bench& bench, Findings& findings) {
  const std::vector<int> ways = movable(bench);
  if (ways.empty()) return findings.note("move_frame() is not offered");
  Vector3d g = Vector3d::Zero(), h = Vector3d::Zero();
  for (const int j : ways) {
    g[j] = Vector3d(0.3, 0.04, -0.07)[j];
    h[j] = Vector3d(-0.5, 0.02, 0.03)[j];
  }
  std::mt19937_64 rng(8);
  const Intrinsics x_WI = bench.unequal(rng);
  const auto move = [&](Intrinsics x, const Vector3d& by) {
    bench.model().move_frame(by, x);
    return x;
  };
  const auto expect_equal = [&](const Intrinsics& is, const Intrinsics& expected,
                                const std::string& what) {
    Eigen::Index k = 0;
    const double off = (is - expected).cwiseAbs().maxCoeff(&k);
    if (off < 1e-9) return;
    findings.fail(what + ": '" + bench.description().intrinsics[static_cast<std::size_t>(k)].name +
                  "' is " + number(is[k]) + " instead of " + number(expected[k]));
  };
  if (bench.n_x() == 0) return;
  const Intrinsics there = move(x_WI, g);
  expect_equal(move(there, between(g, Vector3d::Zero())), x_WI, "to another frame and back");
  expect_equal(move(there, h), move(x_WI, compose(g, h)), "two changes of frame and one");
  for (const Probe& probe : bench.random_motions(8, x_WI)) {
    const auto r = bench.residual(probe.y, there, moved_twist(g, probe.xi));
    if (r && r->norm() < 1e-8) continue;
    return findings.fail(
        "after a change of frame the same reading does not fit the same motion: "
        "b - A xi is " +
        (r ? number(r->norm()) : "rejected") +
        " m/s - move_frame() takes [yaw, x, y] of the new O in the old one");
  }
}

void check_inverse(const Bench& bench, Findings& findings) {
  const RowVector no_slip = RowVector::Zero(bench.description().n_rows);
  int followed = 0, rejected = 0;
  for (const Probe& probe : bench.motions()) {
    EncoderSample y = bench.zero_reading();
    const Status status = bench.model().inverse(probe.xi, probe.x_WI, no_slip, y);
    if (status == Status::kUnsupported) return findings.note("inverse() is not offered");
    if (status != Status::kOk) {
      ++rejected;
      continue;
    }
    ++followed;
    if (y.n_drive != bench.description().n_drive || y.n_steer != bench.description().n_steer) {
      return findings.fail("inverse() leaves " + std::to_string(y.n_drive) + " drive and " +
                           std::to_string(y.n_steer) + " steering channels, describe() says " +
                           std::to_string(bench.description().n_drive) + " and " +
                           std::to_string(bench.description().n_steer));
    }
    const auto r = bench.residual(y, probe.x_WI, probe.xi);
    Eigen::Index row = 0;
    const double off = r ? r->cwiseAbs().maxCoeff(&row) : std::nan("");
    if (!(off < 1e-8)) {
      return findings.fail("the reading of inverse() does not fit at " + probe.name + ": row " +
                           std::to_string(row) + " of b - A xi is " + number(off) + " m/s");
    }
    EncoderSample again = y;
    bench.model().inverse(probe.xi, probe.x_WI, no_slip, again);
    for (std::size_t i = 0; i < again.steer_rad.size(); ++i) {
      if (std::abs(again.steer_rad[i] - y.steer_rad[i]) < 1e-9) continue;
      return findings.fail("inverse() turns wheel " + std::to_string(i) + " from " +
                           number(y.steer_rad[i]) + " to " + number(again.steer_rad[i]) +
                           " rad although the motion stays the same, at " + probe.name);
    }
  }
  findings.note(std::to_string(followed) + " motions followed, " + std::to_string(rejected) +
                " rejected");
  if (followed == 0)
    findings.fail("inverse() rejects every motion, even those the rows can follow");
}

}  // namespace viwo::conformance
