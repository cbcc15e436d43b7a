// Checks of an update: what it hands to the filter over drives of a simulated robot.
#include <cmath>
#include <limits>
#include <set>

#include <Eigen/Eigenvalues>

#include "checks.hpp"
#include "digest.hpp"
#include "update_rig.hpp"

namespace viwo::conformance {
namespace {

constexpr int kMaxFactors = 16;  // that the estimator has room for in an epoch

/// The columns of a factor: within the state, each once.
std::string fault(const FactorColumns& columns, int state_size) {
  std::vector<bool> taken(static_cast<std::size_t>(state_size), false);
  for (const ColumnRange& block : columns.blocks()) {
    const std::string text = "columns " + std::to_string(block.first) + " to " +
                             std::to_string(block.first + block.count - 1);
    if (block.first < 0 || block.count < 1 || block.first + block.count > state_size) {
      return text + " are not in the state of " + std::to_string(state_size);
    }
    for (int i = block.first; i < block.first + block.count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (taken[k]) return text + " overlap another block (column " + std::to_string(i) + ")";
      taken[k] = true;
    }
  }
  return columns.size() == 0 ? "has no columns" : "";
}

/// `numbers_matter`: what is absurd may give absurd factors, which the filter drops and counts.
std::string fault(const ResidualFactor& factor, int state_size, bool numbers_matter) {
  const std::string columns = fault(factor.columns, state_size);
  if (!columns.empty()) return columns;
  const auto rows = factor.residual.size();
  if (factor.H.rows() != rows || factor.R.rows() != rows || factor.R.cols() != rows ||
      factor.H.cols() != factor.columns.size()) {
    return "H is " + std::to_string(factor.H.rows()) + " x " + std::to_string(factor.H.cols()) +
           " for " + std::to_string(rows) + " residuals and " +
           std::to_string(factor.columns.size()) + " columns - call set_rows() after the columns";
  }
  if (!numbers_matter) return "";
  if (!factor.H.allFinite()) return "H has entries that are not finite";
  if (!factor.residual.allFinite()) return "residual has entries that are not finite";
  if (!factor.R.allFinite()) return "R has entries that are not finite";
  const Eigen::MatrixXd R = factor.R;
  const double off = (R - R.transpose()).cwiseAbs().maxCoeff();
  if (off > 1e-9 * R.cwiseAbs().maxCoeff()) {
    return "R is not symmetric (by up to " + number(off) + ")";
  }
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(R).eigenvalues()[0];
  if (!(least > 0.)) return "R is not positive definite (eigenvalue " + number(least) + ")";
  if (!(factor.gate_probability >= 0. && factor.gate_probability < 1.)) {
    return "gate_probability is " + number(factor.gate_probability);
  }
  return "";
}

std::string fault(const InformationFactor& factor, int state_size, bool numbers_matter) {
  const std::string columns = fault(factor.columns, state_size);
  if (!columns.empty()) return columns;
  if (!numbers_matter) return "";
  const int n = factor.columns.size();
  Eigen::MatrixXd Lambda = factor.Lambda.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  Lambda = Eigen::MatrixXd(Lambda.selfadjointView<Eigen::Lower>());
  if (!Lambda.allFinite()) return "Lambda has entries that are not finite";
  if (!factor.eta.head(n).allFinite()) return "eta has entries that are not finite";
  const auto values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Lambda).eigenvalues();
  if (values[0] < -1e-9 * std::max(values[n - 1], 1e-12)) {
    return "Lambda is not positive semidefinite (eigenvalue " + number(values[0]) + ")";
  }
  return "";
}

/// Stands in for the plugin in a filter: hands every call on to two instances, looks at what they
/// emit, and gives that of the first to the filter.
class Watch final : public Update {
 public:
  using Spoil = std::function<void(int epoch, EpochData& data)>;

  Watch(const Subject& subject, Findings& findings, Spoil spoil = {})
      : one_(subject.make<Update>()),
        two_(subject.make<Update>()),
        findings_(findings),
        spoil_(std::move(spoil)) {}

  UpdateKind kind() const override { return one_.object->kind(); }

  void start(const UpdateSetup& setup) override {
    one_.object->start(setup);
    two_.object->start(setup);
    sink_one_ = FactorSink(kMaxFactors, setup.max_state_size);
    sink_two_ = FactorSink(kMaxFactors, setup.max_state_size);
  }

  void update(const FilterView& filter, const EpochData& given, FactorSink& sink) override {
    EpochData data = given;
    if (spoil_) spoil_(epoch_, data);
    ++epoch_;
    if (call(*one_.object, filter, data, sink_one_)) check(filter, sink_one_);
    if (call(*two_.object, filter, data, sink_two_) &&
        digest_of(sink_one_) != digest_of(sink_two_) && !differs_) {
      differs_ = true;
      findings_.fail("two instances give different factors for the same epoch (" + where() +
                     ") - no static variables, no clock, no random numbers but from "
                     "HostServices::seed");
    }
    digest_.add(digest_of(sink_one_));
    if (!spoil_) pass_on(sink);
  }

  int epochs() const { return epoch_; }
  std::int64_t factors() const { return factors_; }
  std::uint64_t digest() const { return digest_.value(); }

 private:
  std::string where() const { return "epoch " + std::to_string(epoch_); }

  bool call(Update& update, const FilterView& filter, const EpochData& data, FactorSink& sink) {
    sink.clear();
    try {
      update.update(filter, data, sink);
      return true;
    } catch (const std::exception& error) {
      findings_.fail("update() threw '" + std::string(error.what()) + "' in " + where() +
                     " - leave out what cannot be used, and count it in rejections()");
    }
    sink.clear();
    return false;
  }

  void check(const FilterView& filter, const FactorSink& sink) {
    int i = 0;
    for (const ResidualFactor& factor : sink.residuals()) {
      report("residual factor " + std::to_string(i++), fault(factor, filter.size, !spoil_));
    }
    if (const InformationFactor* factor = sink.information();
        factor != nullptr && factor->columns.size() > 0) {
      report("information factor", fault(*factor, filter.size, !spoil_));
      ++i;
    }
    factors_ += i;
    if (sink.applied() < 0 || sink.rejected() < 0) report("count()", "is below zero");
  }

  void report(const std::string& what, const std::string& fault) {
    if (!fault.empty() && reported_.insert(what).second) {
      findings_.fail(what + " of " + where() + ": " + fault);
    }
  }

  void pass_on(FactorSink& sink) const {
    for (const ResidualFactor& factor : sink_one_.residuals()) sink.add_residual() = factor;
    if (const InformationFactor* factor = sink_one_.information()) {
      sink.add_information() = *factor;
    }
    sink.count(sink_one_.applied(), sink_one_.rejected());
  }

  Loaded<Update> one_, two_;
  FactorSink sink_one_{0, 0}, sink_two_{0, 0};
  Findings& findings_;
  Spoil spoil_;
  int epoch_ = 0;
  std::int64_t factors_ = 0;
  bool differs_ = false;
  Digest digest_;
  std::set<std::string> reported_;
};

Drive only_imu(Drive drive) {
  std::erase_if(drive.measurements,
                [](const Measurement& m) { return !std::holds_alternative<ImuSample>(m); });
  return drive;
}

void check_start(const Subject& subject, Findings& findings) {
  try {
    run_update(std::make_shared<Watch>(subject, findings),
               only_imu(simulate_drive("stationary", 0.5)));
  } catch (const std::exception& error) {
    findings.fail("start() or the first epochs: " + std::string(error.what()) +
                  " - the robot of these checks has an IMU, one camera, four driven wheels and a "
                  "pose reference");
  }
}

void check_empty_epochs(const Subject& subject, Findings& findings) {
  const auto watch = std::make_shared<Watch>(subject, findings);
  run_update(watch, only_imu(simulate_drive("stationary", 3.)));
  findings.note(std::to_string(watch->epochs()) + " epochs without measurements, " +
                std::to_string(watch->factors()) + " factors");
}

void check_factors(const Subject& subject, Findings& findings) {
  std::int64_t factors = 0;
  for (const char* motion : {"stationary", "figure_eight", "spin"}) {
    const auto watch = std::make_shared<Watch>(subject, findings);
    run_update(watch, simulate_drive(motion, 4.));
    factors += watch->factors();
  }
  findings.note(std::to_string(factors) + " factors over three drives");
  if (factors == 0) findings.note("no factor was given: there was nothing that could be checked");
}

void check_update_repeatable(const Subject& subject, Findings& findings) {
  const Drive drive = simulate_drive("figure_eight", 3.);
  std::uint64_t digests[2];
  for (std::uint64_t& digest : digests) {
    const auto watch = std::make_shared<Watch>(subject, findings);
    run_update(watch, drive);
    digest = watch->digest();
  }
  if (digests[0] != digests[1]) {
    findings.fail(
        "the same drive again gives other factors - results may depend on configuration "
        "and measurements alone");
  }
}

/// Measurements as broken logs have them; owned here because an epoch only refers to them.
struct Broken {
  std::vector<FeatureSample> features;
  std::vector<EncoderSample> encoders;
  std::vector<ImuSample> imu;
  std::vector<PoseSample> poses;
};

void spoil(int epoch, Broken& broken, EpochData& data) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kValues[] = {kNan, std::numeric_limits<double>::infinity(), 1e300, -1e9};
  const double bad = kValues[epoch % 4];
  broken.features.assign(data.features.begin(), data.features.end());
  broken.encoders.assign(data.encoders.begin(), data.encoders.end());
  broken.poses.assign(data.poses.begin(), data.poses.end());
  broken.imu.assign(data.imu.begin(), data.imu.end());
  switch (epoch / 4 % 3) {
    case 0:  // values
      for (FeatureSample& image : broken.features) {
        for (FeaturePoint& point : image.points) point.u_px = bad;
      }
      for (EncoderSample& cell : broken.encoders) cell.drive_rad_per_s.fill(bad);
      for (PoseSample& pose : broken.poses) pose.p_BinW_m.fill(bad);
      break;
    case 1:  // one point as often as there are points, poses without a rotation
      for (FeatureSample& image : broken.features) {
        for (FeaturePoint& point : image.points) point.id = 1;
      }
      for (PoseSample& pose : broken.poses) pose.q_BtoW_xyzw.fill(0.);
      broken.encoders.clear();
      break;
    default:  // a camera that does not exist, no IMU
      for (FeatureSample& image : broken.features) image.camera = 7;
      broken.imu.clear();
      broken.poses.clear();
      break;
  }
  data.features = broken.features;
  data.encoders = broken.encoders;
  data.poses = broken.poses;
  data.imu = broken.imu;
}

void check_hostile_epochs(const Subject& subject, Findings& findings) {
  Broken broken;
  const auto watch = std::make_shared<Watch>(
      subject, findings, [&](int epoch, EpochData& data) { spoil(epoch, broken, data); });
  run_update(watch, simulate_drive("figure_eight", 4.));
}

}  // namespace

std::vector<NamedCheck> update_checks(const Subject& subject) {
  const auto of = [&subject](void (*check)(const Subject&, Findings&)) -> Check {
    return [&subject, check](Findings& findings) { check(subject, findings); };
  };
  return {{"start", of(check_start)},
          {"empty epochs", of(check_empty_epochs)},
          {"factors", of(check_factors)},
          {"repeatable", of(check_update_repeatable)},
          {"hostile epochs", of(check_hostile_epochs)}};
}

}  // namespace viwo::conformance
