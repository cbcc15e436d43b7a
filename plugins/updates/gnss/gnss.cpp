// Fixes of a satellite receiver whose antenna sits on the IMU, in the coordinates of the Earth. How
// the Earth lies in the filter's world is found while driving. Equations: model.md.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include <Eigen/Cholesky>

#include "alignment.hpp"
#include "fix.hpp"
#include "local_frame.hpp"
#include "params.hpp"
#include "tally.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using namespace gnss;
using namespace pose_reference;

/// The host has room for 16 factors of one update in an epoch. A fix is two, horizontal and height;
/// the alignment brings two fixes at once.
constexpr std::size_t kMostFixes = 7;
/// What lies further from the origin is no fix: E is flat.
constexpr double kFarthestM = 1e5;
/// How tightly the start is tied to the clones: far below what any filter knows.
constexpr double kTieSigmaM = 1e-3;
/// Two places whose distances in G and E are less likely to be one contradict each other.
constexpr double kContradiction = 1e-3;
/// A fix that is so many times better than the one that the search began with takes its place.
constexpr double kBetterSigma = 2.;

/// Where the receiver takes the antenna to be but for noise, by the state: with its drift.
struct Place {
  Vector3d p_G = Vector3d::Zero();
  Vector3d first_p_G = Vector3d::Zero();  ///< at first estimates, where the drift is zero
  FactorColumns columns;
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 18> J;  ///< of p_G by the columns

  int column(int i) const {
    for (const ColumnRange& block : columns.blocks()) {
      if (i < block.count) return block.first + i;
      i -= block.count;
    }
    return -1;
  }
};

Matrix3d covariance(const FilterView& filter, const Place& a, const Place& b) {
  Matrix3d sum = Matrix3d::Zero();
  for (int i = 0; i < a.J.cols(); ++i) {
    for (int j = 0; j < b.J.cols(); ++j) {
      sum += filter.P()(a.column(i), b.column(j)) * a.J.col(i) * b.J.col(j).transpose();
    }
  }
  return sum;
}

class Gnss final : public Update {
 public:
  Gnss(const GnssParams& params, const HostServices& services)
      : options_(gnss_options(params)),
        services_(services),
        contradiction_(chi2_quantile(1. - kContradiction, 3.)),
        frame_(options_.frame) {}

  void declare(Declarations& host) override {
    fixes_ = host.stream({.type = &sample_type<GnssSample>(),
                          .clocks = {{.constant_s = options_.t_AtoI_s, .block = {}}}});
    lever_ = host.block(options_.lever_arm_spec());
    alignment_ = host.block(options_.alignment_spec());
    if (options_.has_drift()) drift_ = host.block(options_.drift_spec());
    if (!options_.yaw_is_known()) room_ = host.room({options_.name + ".start", 1, 3});
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    const auto fixes = data.samples<GnssSample>(fixes_);
    const std::size_t used = std::min(fixes.size(), kMostFixes);
    too_many_.add(static_cast<std::int64_t>(fixes.size() - used), data.end_ns);
    const auto numbers = filter.block(alignment_).numbers();
    Alignment at{numbers[0], numbers.tail<3>()};
    for (const GnssSample& fix : fixes.last(used)) {
      const auto place = is_sound(fix) ? place_of(filter, fix) : std::nullopt;
      if (!place) continue;
      if (!is_aligned_) {
        if (n_tried_++ == 0) first_tried_ns_ = fix.t_ns;
        const auto found = align(filter, *place, fix, sink);
        if (!found) continue;
        at = *found;
      }
      const LocalFix local = frame_->at(fix, options_.noise);
      if (local.p_AinE.norm() < kFarthestM) {
        emit(filter, *place, local, at, options_.gate_probability, sink);
      } else {
        far_away_.add(1, fix.t_ns);
      }
    }
  }

  void settle(const FilterView& filter, BlockEdits& edits) override {
    if (!start_) return;
    if (!exists(filter, start_->block)) return start_.reset();  // the host has refused it
    if (!is_aligned_ && !start_->leaves) return;
    edits.drop(start_->block);
    start_.reset();
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    brackets_.append_to(out);
    for (const Tally* tally :
         {&too_many_, &faulty_, &bad_covariance_, &far_away_, &waiting_, &contradicting_}) {
      tally->append_to(out);
    }
    if (n_tried_ > 0 && !is_aligned_) {
      out.push_back(
          {"fix without use, as no alignment was found in which the motion of the "
           "estimate is that of the fixes",
           n_tried_, stamp_text(first_tried_ns_), n_tried_});
    }
  }

 private:
  /// Where the search for the yaw begins: a place that is a block of the state.
  struct Start {
    BlockId block;
    Vector3d first_p_G = Vector3d::Zero();  ///< at first estimates
    LocalFix fix;
    int votes = 0;  ///< of later fixes: those that agree with it less those that do not
    bool leaves = false;
  };

  static bool exists(const FilterView& filter, BlockId block) {
    const int column = filter.block(block).column();
    return filter.P()(column, column) > 0.;
  }

  bool is_sound(const GnssSample& fix) {
    // What receivers without a fix may give, though they should say so.
    const bool is_nowhere = fix.latitude_deg == 0. && fix.longitude_deg == 0.;
    if (fix.fault() != nullptr || is_nowhere) {
      faulty_.add(1, fix.t_ns);
      return false;
    }
    const Matrix3d C = covariance_of(fix, options_.noise);
    const bool is_positive = C.allFinite() && C.llt().info() == Eigen::Success;
    if (!is_positive) bad_covariance_.add(1, fix.t_ns);
    return is_positive;
  }

  std::optional<Place> place_of(const FilterView& filter, const GnssSample& fix) {
    const std::int64_t t_ns = fix.t_ns + to_ns(options_.t_AtoI_s);
    const auto clones = brackets_.around(filter.clones, t_ns, options_.max_span_s);
    if (!clones) return std::nullopt;
    return place_between(filter, *clones);
  }

  Place place_between(const FilterView& filter, const Bracket& clones) const {
    const auto& [a, b, period_s, u] = clones;
    const BlockView& arm = filter.block(lever_);
    const Lever lever{Matrix3d::Identity(), arm.numbers()};
    const Lever first_lever{Matrix3d::Identity(), arm.first_numbers()};
    BodyJacobian J;
    const auto first =
        body_between(at_first_estimate(a), at_first_estimate(b), period_s, u, first_lever, &J);
    Place place;
    place.p_G = body_between(at_estimate(a), at_estimate(b), period_s, u, lever).p_BinG;
    place.first_p_G = first.p_BinG;
    place.columns.add(a.column, kPoseSize);
    place.columns.add(b.column, kPoseSize);
    const int by_arm = arm.column() < 0 ? -1 : place.columns.add(arm.column(), 3);
    const int by_drift =
        options_.has_drift() ? place.columns.add(filter.block(drift_).column(), 3) : -1;
    // (GN-2)
    place.J.resize(3, place.columns.size());
    place.J.leftCols<12>() = J.bottomRows<3>();
    if (by_arm >= 0) place.J.middleCols<3>(by_arm) = first.R_GtoB.transpose();
    if (by_drift >= 0) {
      place.J.middleCols<3>(by_drift).setIdentity();
      place.p_G += filter.block(drift_).numbers();
    }
    return place;
  }

  Place place_of_start(const FilterView& filter) const {
    const BlockView& block = filter.block(start_->block);
    Place place;
    place.p_G = block.numbers();
    place.first_p_G = start_->first_p_G;
    place.columns.add(block.column(), 3);
    place.J = Matrix3d::Identity();
    return place;
  }

  /// Where to linearise, as soon as it is known.
  std::optional<Alignment> align(const FilterView& filter, const Place& place,
                                 const GnssSample& fix, FactorSink& sink) {
    Alignment at = options_.alignment;
    if (!options_.yaw_is_known()) {
      const auto yaw = search(filter, place, fix, sink);
      if (!yaw) return std::nullopt;
      const Place start = place_of_start(filter);
      at.yaw_EtoG += std::remainder(*yaw - at.yaw_EtoG, 2. * std::numbers::pi);
      at.p_EinG = start.p_G;
      emit(filter, start, start_->fix, at, 0., sink);
    } else if (!frame_) {
      frame_.emplace(fix.latitude_deg, fix.longitude_deg, fix.altitude_m);
      at.p_EinG = place.p_G;
    } else {
      // Far from the origin the yaw moves the fix: linearised where this fix says that the origin
      // is, unless that is known better.
      const LocalFix local = frame_->at(fix, options_.noise);
      const double by_yaw_m = options_.sigma_yaw_rad * local.p_AinE.norm();
      const double told_m2 = local.R.trace() + by_yaw_m * by_yaw_m;
      if (options_.sigma_p_EinG_m * options_.sigma_p_EinG_m > told_m2) {
        at.p_EinG = place.p_G - R_GtoE(at.yaw_EtoG).transpose() * local.p_AinE;
      }
    }
    is_aligned_ = true;
    tell(at);
    return at;
  }

  /// The yaw that this fix and that of the start tell, if they tell it well enough.
  std::optional<double> search(const FilterView& filter, const Place& place, const GnssSample& fix,
                               FactorSink& sink) {
    if (!start_) {
      begin(filter, place, fix, sink);
      return wait(fix);
    }
    if (start_->leaves || !exists(filter, start_->block)) return wait(fix);
    const LocalFix local = frame_->at(fix, options_.noise);
    const Place start = place_of_start(filter);
    const Matrix3d across = covariance(filter, place, start);
    Baseline baseline;
    baseline.in_G = place.p_G - start.p_G;
    baseline.P_G = covariance(filter, place, place) + covariance(filter, start, start) - across -
                   across.transpose();
    baseline.in_E = local.p_AinE - start_->fix.p_AinE;
    baseline.P_E = local.R + start_->fix.R;
    const YawGuess guess = yaw_of(baseline);
    if (!(guess.chi2 <= contradiction_)) {
      contradicting_.add(1, fix.t_ns);
      start_->leaves = --start_->votes < 0;
      return std::nullopt;
    }
    ++start_->votes;
    if (guess.sigma_rad <= options_.alignment_sigma_rad) return guess.yaw_EtoG;
    start_->leaves = start_->fix.R.trace() > kBetterSigma * kBetterSigma * local.R.trace();
    return wait(fix);
  }

  std::nullopt_t wait(const GnssSample& fix) {
    waiting_.add(1, fix.t_ns);
    return std::nullopt;
  }

  /// Makes the place a block of the state, and its fix the origin of E.
  void begin(const FilterView& filter, const Place& place, const GnssSample& fix,
             FactorSink& sink) {
    const auto block = sink.add_block(room_, std::span(place.p_G.data(), 3));
    if (!block) return;
    frame_.emplace(fix.latitude_deg, fix.longitude_deg, fix.altitude_m);
    start_ = Start{*block, place.first_p_G, frame_->at(fix, options_.noise)};
    // (GN-5)
    InformationFactor& tie = sink.add_information();
    tie.columns = place.columns;
    tie.columns.add(filter.block(*block).column(), 3);
    const auto n = place.J.cols();
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 21> H(3, n + 3);
    H << place.J, -Matrix3d::Identity();
    tie.Lambda.topLeftCorner(n + 3, n + 3) =
        H.transpose().lazyProduct(H) / (kTieSigmaM * kTieSigmaM);
    tie.eta.head(n + 3).setZero();
  }

  /// Linearised at the alignment `at`, which may be another one than the estimate.
  void emit(const FilterView& filter, const Place& place, const LocalFix& fix, const Alignment& at,
            double gate_probability, FactorSink& sink) const {
    const BlockView& block = filter.block(alignment_);
    const auto alignment = block.numbers();
    FactorColumns columns = place.columns;
    const int aligned = block.column() < 0 ? -1 : columns.add(block.column(), 4);
    // (GN-4)
    const Matrix3d R = R_GtoE(at.yaw_EtoG);
    const Vector3d by_yaw = -R * Vector3d::UnitZ().cross(place.first_p_G - at.p_EinG);
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 22> H(3, columns.size());
    H.leftCols(place.J.cols()) = R.lazyProduct(place.J);
    if (aligned >= 0) H.rightCols<4>() << by_yaw, -R;
    // (GN-3), (GN-9)
    Vector3d residual =
        fix.p_AinE - R * (place.p_G - alignment.tail<3>()) - by_yaw * (alignment[0] - at.yaw_EtoG);
    // (GN-10): heights have a gate of their own.
    Matrix3d noise = fix.R;
    const Eigen::RowVector2d K =
        noise.topLeftCorner<2, 2>().llt().solve(noise.topRightCorner<2, 1>()).transpose();
    H.row(2) -= K.lazyProduct(H.topRows<2>());
    residual[2] -= K * residual.head<2>();
    noise(2, 2) -= K * noise.topRightCorner<2, 1>();
    for (const auto& [first, rows] : {std::pair{0, 2}, std::pair{2, 1}}) {
      ResidualFactor& factor = sink.add_residual();
      factor.columns = columns;
      factor.set_rows(rows);
      factor.gate_probability = gate_probability;
      factor.heavy_tailed = true;
      factor.H = H.middleRows(first, rows);
      factor.residual = residual.segment(first, rows);
      factor.R = noise.block(first, first, rows, rows);
    }
  }

  void tell(const Alignment& at) const {
    char text[240];
    std::snprintf(text, sizeof text,
                  "%s: aligned, yaw_EtoG %.3f rad, p_EinG [%.2f, %.2f, %.2f] m; the origin of E is "
                  "at latitude %.9f, longitude %.9f, altitude %.4f m",
                  options_.name.c_str(), at.yaw_EtoG, at.p_EinG.x(), at.p_EinG.y(), at.p_EinG.z(),
                  frame_->latitude_deg(), frame_->longitude_deg(), frame_->altitude_m());
    services_.log(LogLevel::kInfo, text);
  }

  GnssOptions options_;
  HostServices services_;
  double contradiction_;  // chi-square
  std::optional<LocalFrame> frame_;
  std::optional<Start> start_;  // while the yaw is sought
  bool is_aligned_ = false;
  std::int64_t n_tried_ = 0, first_tried_ns_ = 0;  ///< fixes by which an alignment was sought
  StreamId fixes_;
  BlockId lever_, alignment_, drift_;
  RoomId room_;

  Brackets brackets_;
  Tally too_many_{"fix beyond 7 in an epoch"};
  Tally faulty_{"fix with values that cannot be used"};
  Tally bad_covariance_{"fix whose covariance is not positive definite"};
  Tally far_away_{"fix more than 100 km from the origin"};
  Tally waiting_{"fix while the alignment was sought"};
  Tally contradicting_{"fix that contradicted the start of that search"};
};

VIWO_REGISTER(Update, Gnss, "gnss", "1.0.0",
              "fixes of a satellite receiver; finds how the Earth lies in the filter's world",
              "Apache-2.0", GnssParams);

}  // namespace
}  // namespace viwo
