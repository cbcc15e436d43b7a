// The search for a plan.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Dense>

#include "viwo/config/errors.hpp"
#include "viwo/math/combination_text.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plan/plan.hpp"

namespace viwo::plan {
namespace {

/// Information of so many drives is as good as all that there can be (PL-6); of more, rounding
/// would be information.
constexpr double kWithoutEnd = 1e4;

class Search {
 public:
  Search(const PlanSetup& setup, WheelInformation& wheels, std::vector<Piece> pieces)
      : setup_(setup), wheels_(wheels), pieces_(std::move(pieces)) {}

  void require_reachable() const;
  Plan run() const;

 private:
  using Sequence = std::vector<std::size_t>;

  double left(const Information& drive) const {
    return left_of(setup_.goals, wheels_.sigma(drive));
  }
  Information sum_of(const Sequence& sequence) const {
    Information sum = Information::zero(setup_.model->n_intrinsics());
    for (const std::size_t k : sequence) sum += pieces_[k].information;
    return sum;
  }
  double cost_of(const Sequence& sequence) const {
    return std::accumulate(sequence.begin(), sequence.end(), 0.,
                           [&](double cost, std::size_t k) { return cost + pieces_[k].cost_m; });
  }
  bool keeps_to_floor(const Sequence& sequence) const;
  std::optional<std::size_t> next_piece(const Information& driven, const Eigen::Vector3d& at,
                                        double least_m) const;
  bool shorten(Sequence& sequence) const;
  Plan greedy(double least_m) const;
  Plan plan_of(const Sequence& sequence) const;

  const PlanSetup& setup_;
  WheelInformation& wheels_;
  std::vector<Piece> pieces_;
};

/// The direction of the intrinsics that a drive leaves most unknown, in prior sigmas.
std::string unknown_direction(const WheelModel& model, const Eigen::MatrixXd& covariance) {
  const Eigen::Index n = model.n_intrinsics();
  const Eigen::VectorXd prior = model.prior_sigma();
  Eigen::MatrixXd P = covariance.topLeftCorner(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (prior[i] == 0.) P(i, i) = 0.;  // held
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(P);
  Eigen::VectorXd v = eigen.eigenvectors().col(n - 1);
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  if (v[largest] < 0.) v = -v;
  std::vector<std::pair<std::string, double>> weights;
  for (Eigen::Index i = 0; i < n; ++i) {
    weights.emplace_back(model.description().intrinsics[static_cast<std::size_t>(i)].name, v[i]);
  }
  return combination_text(weights);
}

/// (PL-6): without what is there by rounding alone, and no more than leaves room for the prior in
/// the digits of a number.
Eigen::MatrixXd without_end(const Eigen::MatrixXd& N) {
  constexpr double kRounding = 1e-12, kMost = 1e12;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(N);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const double smallest = kRounding * values[values.size() - 1];
  const Eigen::VectorXd kept =
      (values.array() > smallest).select((kWithoutEnd * values).cwiseMin(kMost), 0.);
  return eigen.eigenvectors() * kept.asDiagonal() * eigen.eigenvectors().transpose();
}

void Search::require_reachable() const {
  if (pieces_.empty()) {
    throw InputError(
        "this base can follow none of the motions that a plan is made of, or none within ten "
        "minutes");
  }
  Information all = Information::zero(setup_.model->n_intrinsics());
  for (const Piece& piece : pieces_) all += piece.information;
  all.N = without_end(all.N);
  all.path *= std::sqrt(kWithoutEnd);
  const Intrinsics sigma = wheels_.sigma(all);
  const WorstGoal worst = worst_goal(setup_.goals, sigma);
  if (worst.ratio <= 1.) return;
  const IntrinsicSpec& spec =
      setup_.model->description().intrinsics[static_cast<std::size_t>(worst.intrinsic)];
  std::string text =
      "goals: " + spec.name + " cannot be known better than " +
      significant(sigma[worst.intrinsic], 3) + " " + spec.unit + ", " +
      significant(worst.ratio, 3) + " x its goal, however long the drive. What no motion tells: " +
      unknown_direction(*setup_.model, wheels_.covariance(all)) + " (in prior sigmas).";
  if (!setup_.params.gyro) text += " There is no gyro (gyro: true).";
  KnowledgeParams measured = static_cast<const KnowledgeParams&>(setup_.params);
  measured.distance = true;
  if (!setup_.params.distance &&
      worst_goal(setup_.goals, WheelInformation(setup_.model, measured).sigma(all)).ratio <= 1.) {
    text += " The path of the drive, measured (distance: true), would.";
  }
  config::fail(setup_.goals_mark, text);
}

bool Search::keeps_to_floor(const Sequence& sequence) const {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (const std::size_t k : sequence) {
    if (!stays_on_floor(pieces_[k], at, setup_.params)) return false;
    at = compose(at, pieces_[k].end());
  }
  return true;
}

std::optional<std::size_t> Search::next_piece(const Information& driven, const Eigen::Vector3d& at,
                                              double least_m) const {
  const double before = left(driven);
  std::vector<double> gain_per_m;
  for (const Piece& piece : pieces_) {
    Information after = driven;
    after += piece.information;
    const double gain = piece.cost_m < least_m ? 0. : before - left(after);
    gain_per_m.push_back(gain / piece.cost_m);
  }
  Sequence order(pieces_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return gain_per_m[a] > gain_per_m[b]; });
  for (const std::size_t k : order) {
    if (!(gain_per_m[k] > 0.)) break;
    if (stays_on_floor(pieces_[k], at, setup_.params)) return k;
  }
  return std::nullopt;
}

/// Leaves a piece out, or takes a shorter one, where the goals are reached all the same: that which
/// saves most. False where nothing can be saved.
bool Search::shorten(Sequence& sequence) const {
  const Information all = sum_of(sequence);
  Sequence best = sequence;
  double best_cost_m = cost_of(sequence);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    Information without = all;
    Information taken = pieces_[sequence[i]].information;
    without += taken *= -1.;
    const double cost_m = cost_of(sequence) - pieces_[sequence[i]].cost_m;
    const auto try_it = [&](const Sequence& candidate, const Information& drive, double total_m) {
      if (total_m >= best_cost_m || left(drive) > 0. || !keeps_to_floor(candidate)) return;
      best = candidate;
      best_cost_m = total_m;
    };
    Sequence candidate = sequence;
    candidate.erase(candidate.begin() + static_cast<std::ptrdiff_t>(i));
    try_it(candidate, without, cost_m);
    candidate = sequence;
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      if (cost_m + pieces_[k].cost_m >= best_cost_m) continue;
      Information with = without;
      with += pieces_[k].information;
      candidate[i] = k;
      try_it(candidate, with, cost_m + pieces_[k].cost_m);
    }
  }
  const bool shorter = best != sequence;
  sequence = best;
  return shorter;
}

Plan Search::plan_of(const Sequence& sequence) const {
  Plan plan;
  Information driven = Information::zero(setup_.model->n_intrinsics());
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (const std::size_t k : sequence) {
    driven += pieces_[k].information;
    plan.pieces.push_back({pieces_[k], at, wheels_.sigma(driven)});
    at = compose(at, pieces_[k].end());
  }
  return plan;
}

/// Piece by piece, each at least `least_m` long.
Plan Search::greedy(double least_m) const {
  Sequence sequence;
  Information driven = Information::zero(setup_.model->n_intrinsics());
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  double cost_m = 0.;
  std::string why_not;
  while (left(driven) > 0. && why_not.empty()) {
    const auto next = next_piece(driven, at, least_m);
    if (!next) {
      why_not = "the floor has no room for another piece that tells more";
    } else if (cost_m + pieces_[*next].cost_m > setup_.params.max_path_m) {
      why_not = "it would take more than max_path_m";
    } else {
      sequence.push_back(*next);
      driven += pieces_[*next].information;
      at = compose(at, pieces_[*next].end());
      cost_m += pieces_[*next].cost_m;
    }
  }
  while (why_not.empty() && shorten(sequence)) {
  }
  Plan plan = plan_of(sequence);
  plan.reached = why_not.empty();
  plan.why_not = why_not;
  return plan;
}

/// Short pieces tell most per metre at first, but a drive of many of them is always about to stop:
/// the search is made with all pieces, and with the longer ones.
Plan Search::run() const {
  Plan best = greedy(0.);
  for (const double radii : {3., 6., 12., 24.}) {
    Plan plan = greedy(radii * setup_.params.base_radius_m);
    if (plan.reached && (!best.reached || plan.cost_m() < best.cost_m())) best = std::move(plan);
  }
  return best;
}

template <class Get>
double sum_over(const std::vector<PlannedPiece>& pieces, Get get) {
  double sum = 0.;
  for (const PlannedPiece& one : pieces) sum += get(one.piece);
  return sum;
}

}  // namespace

double Plan::cost_m() const {
  return sum_over(pieces, [](const Piece& piece) { return piece.cost_m; });
}
double Plan::duration_s() const {
  return sum_over(pieces, [](const Piece& piece) { return piece.duration_s; });
}
double Plan::path_m() const {
  return sum_over(pieces, [](const Piece& piece) { return piece.path_m; });
}

std::function<Twist(double t_s)> twist_of(const Plan& plan) {
  std::vector<std::pair<double, std::function<Twist(double)>>> by_begin_s;
  double begin_s = 0.;
  for (const PlannedPiece& one : plan.pieces) {
    by_begin_s.emplace_back(begin_s, one.piece.twist);
    begin_s += one.piece.duration_s;
  }
  return [by_begin_s](double t_s) -> Twist {
    const auto behind =
        std::upper_bound(by_begin_s.begin(), by_begin_s.end(), t_s,
                         [](double t, const auto& piece) { return t < piece.first; });
    if (behind == by_begin_s.begin()) return Twist::Zero();
    const auto& [from_s, twist] = *std::prev(behind);
    return twist(t_s - from_s);
  };
}

double left_of(const std::vector<Goal>& goals, const Intrinsics& sigma) {
  double sum = 0.;
  for (const Goal& goal : goals) {
    sum += std::max(0., std::log(sigma[goal.intrinsic] / goal.sigma));
  }
  return sum;
}

WorstGoal worst_goal(const std::vector<Goal>& goals, const Intrinsics& sigma) {
  WorstGoal worst;
  for (const Goal& goal : goals) {
    const double ratio = sigma[goal.intrinsic] / goal.sigma;
    if (ratio > worst.ratio) worst = {ratio, goal.intrinsic};
  }
  return worst;
}

Plan make_plan(const PlanSetup& setup) {
  WheelInformation wheels(setup.model, setup.params);
  Search search(setup, wheels, make_pieces(wheels, setup.params));
  search.require_reachable();
  return search.run();
}

}  // namespace viwo::plan
