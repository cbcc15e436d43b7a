#include "derivatives.hpp"

#include <cmath>
#include <functional>
#include <set>
#include <string>

#include <Eigen/QR>

namespace viwo::conformance {

using robot::Answer;
using robot::Bench;
using robot::noise_name;
using robot::Probe;
using robot::Signal;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Column {
  VectorXd J;           ///< d(b - A xi)
  Eigen::Vector3d DtE;  ///< dA^T e
};

/// Changes a probe by `h` in one variable.
using Change = std::function<void(double h, Probe& probe)>;

/// Central differences; nothing where the model rejects a reading nearby.
std::optional<Column> differences(const Bench& bench, const Probe& probe, const Change& change,
                                  double h) {
  Probe ahead = probe, behind = probe;
  change(h, ahead);
  change(-h, behind);
  const auto plus = bench.rows(ahead.y, ahead.x_WI), minus = bench.rows(behind.y, behind.x_WI);
  if (!plus || !minus) return std::nullopt;
  const MatrixXd dA = (plus->A - minus->A) / (2. * h);
  return Column{(plus->b - minus->b) / (2. * h) - dA * probe.xi, dA.transpose() * probe.e};
}

Change by_intrinsic(int k) {
  return [k](double h, Probe& probe) { probe.x_WI[k] += h; };
}

/// Of a drive or steering channel as it is read.
Change by_channel(const NoiseSpec& noise) {
  const auto channel = static_cast<std::size_t>(noise.channel);
  if (noise.kind == NoiseKind::kDrive) {
    return [channel](double h, Probe& probe) { probe.y.drive_rad_per_s[channel] += h; };
  }
  return [channel](double h, Probe& probe) { probe.y.steer_rad[channel] += h; };
}

double step_for(double value) { return 1e-6 * std::max(std::abs(value), 0.1); }

bool in_range(const Bench& bench, const NoiseSpec& noise) {
  const ModelDescription& d = bench.description();
  if (noise.channel < 0) return false;
  return noise.kind == NoiseKind::kDrive   ? noise.channel < d.n_drive
         : noise.kind == NoiseKind::kSteer ? noise.channel < d.n_steer
                                           : true;
}

/// The entry that is off by most, if it is by more than the tolerance.
struct Mismatch {
  int row;
  double analytic, numeric;
};

std::optional<Mismatch> mismatch(const VectorXd& analytic, const VectorXd& numeric, double relative,
                                 double absolute) {
  const double limit = relative * numeric.cwiseAbs().maxCoeff() + absolute;
  std::optional<Mismatch> worst;
  double most = limit;
  for (int i = 0; i < analytic.size(); ++i) {
    const double off = std::abs(analytic[i] - numeric[i]);
    if (off <= most) continue;  // false for NaN
    worst = {i, analytic[i], numeric[i]};
    most = std::isnan(off) ? most : off;
  }
  return worst;
}

constexpr double kRelative = 2e-6, kAbsolute = 2e-7;
const char* const kAxes[] = {"v_x", "v_y", "omega"};

/// Reports each column once, at the first probe where it is wrong.
class Comparison {
 public:
  Comparison(Findings& findings, std::string variable)
      : findings_(findings), variable_(std::move(variable)) {}

  void compare(const std::string& column, const Column& analytic, const Column& numeric,
               const std::string& where) {
    report(column, "d(b - A xi)/d " + variable_,
           mismatch(analytic.J, numeric.J, kRelative, kAbsolute), where, false);
    report(column, "(dA/d " + variable_ + ")^T e",
           mismatch(analytic.DtE, numeric.DtE, kRelative, kAbsolute), where, true);
  }

 private:
  void report(const std::string& column, const std::string& what, const std::optional<Mismatch>& m,
              const std::string& where, bool by_axis) {
    if (!m || !reported_.insert(column + what).second) return;
    const std::string row =
        by_axis ? std::string("entry ") + kAxes[m->row] : "row " + std::to_string(m->row);
    findings_.fail("column " + column + " of " + what + ": analytic " + number(m->analytic) +
                   ", numeric " + number(m->numeric) + " (" + row + ") at " + where);
  }

  Findings& findings_;
  std::string variable_;
  std::set<std::string> reported_;
};

/// The rows of a column that say something about a reading: slip alone makes up for the others,
/// which a model may share among the encoders as it likes.
VectorXd told_by_encoders(const Bench& bench, const Answer& answer, VectorXd column) {
  for (int i = 0; i < column.size(); ++i) {
    bool told = false;
    for (int k = 0; k < bench.n_noises(); ++k) {
      const bool is_drive =
          bench.description().noises[static_cast<std::size_t>(k)].kind == NoiseKind::kDrive;
      told = told || (is_drive && std::abs(answer.by_n.J(i, k)) > 1e-9);
    }
    if (!told) column[i] = 0.;
  }
  return column;
}

/// The readings near the probe's that the derivative at the fitted signal may stand for: one
/// without slip, one with the same steering, and the one that is nearest in units of the noise.
std::vector<EncoderSample> fitted_readings(const Bench& bench, const Probe& probe) {
  std::vector<EncoderSample> readings;
  EncoderSample y = probe.y;
  Twist xi = probe.xi;
  if (bench.follow(probe.x_WI, xi, y) && (xi - probe.xi).norm() < 1e-9) readings.push_back(y);
  const Answer answer = bench.answer(probe);
  const VectorXd wanted = answer.rows.A * probe.xi - answer.rows.b;
  for (const bool drives_only : {true, false}) {
    MatrixXd J = answer.by_n.J;
    const auto& noises = bench.description().noises;
    for (int k = 0; k < bench.n_noises(); ++k) {
      const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
      J.col(k) *= noise.sigma;
      if (drives_only && noise.kind == NoiseKind::kSteer) J.col(k).setZero();
    }
    const VectorXd n = J.completeOrthogonalDecomposition().solve(wanted);
    EncoderSample moved = probe.y;
    for (int k = 0; k < bench.n_noises(); ++k) {
      const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
      const auto channel = static_cast<std::size_t>(noise.channel);
      if (!in_range(bench, noise)) continue;
      if (noise.kind == NoiseKind::kDrive) moved.drive_rad_per_s[channel] += noise.sigma * n[k];
      if (noise.kind == NoiseKind::kSteer) moved.steer_rad[channel] += noise.sigma * n[k];
    }
    readings.push_back(moved);
  }
  return readings;
}

}  // namespace

void check_intrinsic_derivatives(const Bench& bench, Findings& findings) {
  Comparison comparison(findings, "x_WI");
  int compared = 0;
  for (const Probe& probe : bench.probes()) {
    const Answer measured = bench.answer(probe);
    if (measured.status != Status::kOk) continue;
    const Answer fitted = bench.answer(probe, Signal::kFitted);
    for (int k = 0; k < bench.n_x(); ++k) {
      const std::string& name = bench.description().intrinsics[static_cast<std::size_t>(k)].name;
      const auto numeric = differences(bench, probe, by_intrinsic(k), step_for(probe.x_WI[k]));
      if (!numeric) continue;
      ++compared;
      comparison.compare(name, {measured.by_x.J.col(k), measured.by_x.DtE.col(k)}, *numeric,
                         probe.name);
      // Where the rows hold the two signals are one.
      if (!probe.follows) continue;
      comparison.compare(name, {fitted.by_x.J.col(k), fitted.by_x.DtE.col(k)}, *numeric,
                         probe.name + ", fitted signal");
    }
  }
  if (compared == 0 && bench.n_x() > 0) findings.fail("rows() accepts none of the readings tried");
  findings.note(std::to_string(compared) + " columns compared");
}

void check_fitted_signal(const Bench& bench, Findings& findings) {
  constexpr double kOff = 1e-3;
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  std::set<std::string> reported;
  for (Probe probe : bench.motions()) {
    for (double& value : probe.y.drive_rad_per_s) {
      value += kOff * std::max(1., std::abs(value)) * uniform(rng);
    }
    for (double& value : probe.y.steer_rad) value += kOff * uniform(rng);
    const Answer fitted = bench.answer(probe, Signal::kFitted), measured = bench.answer(probe);
    if (fitted.status != Status::kOk) continue;
    const std::vector<EncoderSample> readings = fitted_readings(bench, probe);
    for (int k = 0; k < bench.n_x(); ++k) {
      const auto at_measured = differences(bench, probe, by_intrinsic(k), step_for(probe.x_WI[k]));
      // Wrong at any signal: said by 'derivatives by the intrinsics'.
      if (!at_measured || mismatch(measured.by_x.J.col(k), at_measured->J, kRelative, kAbsolute)) {
        continue;
      }
      std::optional<Mismatch> least;
      bool agrees = false;
      for (const EncoderSample& y : readings) {
        Probe at = probe;
        at.y = y;
        const auto numeric = differences(bench, at, by_intrinsic(k), step_for(at.x_WI[k]));
        if (!numeric) continue;
        const auto off = mismatch(told_by_encoders(bench, fitted, fitted.by_x.J.col(k)),
                                  told_by_encoders(bench, fitted, numeric->J), 2e-5, 2e-6);
        agrees = agrees || !off;
        if (off && (!least || std::abs(off->analytic - off->numeric) <
                                  std::abs(least->analytic - least->numeric))) {
          least = off;
        }
      }
      const std::string& name = bench.description().intrinsics[static_cast<std::size_t>(k)].name;
      if (agrees || !least || !reported.insert(name).second) continue;
      findings.fail(
          "column " + name + " of d(b - A xi)/d x_WI at the fitted signal: analytic " +
          number(least->analytic) + ", numeric " + number(least->numeric) + " (row " +
          std::to_string(least->row) + ") at " + probe.name +
          " with a reading that is off by 0.001 - differentiate at the signal `b` that is "
          "given, not at rows.b");
    }
  }
}

void check_noise_derivatives(const Bench& bench, Findings& findings) {
  Comparison comparison(findings, "n");
  for (const Probe& probe : bench.probes()) {
    const Answer answer = bench.answer(probe);
    if (answer.status != Status::kOk) continue;
    for (int k = 0; k < bench.n_noises(); ++k) {
      const NoiseSpec& noise = bench.description().noises[static_cast<std::size_t>(k)];
      if (!in_range(bench, noise)) continue;  // said by 'noise model'
      const std::string name = noise_name(noise, k);
      const Column analytic{answer.by_n.J.col(k), answer.by_n.DtE.col(k)};
      if (noise.kind != NoiseKind::kSlip) {
        const Change change = by_channel(noise);
        if (const auto numeric = differences(bench, probe, change, 1e-6)) {
          comparison.compare(name, analytic, *numeric, probe.name);
        }
        continue;
      }
      // Slip adds to b, so A does not know of it.
      comparison.compare(name, analytic, {analytic.J, Eigen::Vector3d::Zero()}, probe.name);
      if (!analytic.J.allFinite() || analytic.J.norm() < 1e-9) {
        findings.fail("column " + name + " of d(b - A xi)/d n is zero at " + probe.name +
                      " - it is the velocity that unit slip adds to b");
        return;
      }
    }
  }
}

void check_row_ranges(const Bench& bench, Findings& findings) {
  std::set<std::string> reported;
  const auto check = [&](const std::string& name, const RowRange& rows, const VectorXd& column,
                         const std::string& what, const std::string& where) {
    for (int i = 0; i < column.size(); ++i) {
      const bool declared = i >= rows.first && i < rows.first + rows.count;
      if (declared || std::abs(column[i]) < 1e-7) continue;
      if (!reported.insert(name + what).second) return;
      findings.fail("rows of " + name + " are declared as [" + std::to_string(rows.first) + ", " +
                    std::to_string(rows.first + rows.count) + "), but row " + std::to_string(i) +
                    " " + what + " (" + number(column[i]) + ") at " + where +
                    " - declare all rows that it touches in describe()");
    }
  };
  for (const Probe& probe : bench.probes()) {
    const Answer answer = bench.answer(probe);
    if (answer.status != Status::kOk) continue;
    for (int k = 0; k < bench.n_x(); ++k) {
      const IntrinsicSpec& spec = bench.description().intrinsics[static_cast<std::size_t>(k)];
      const auto numeric = differences(bench, probe, by_intrinsic(k), step_for(probe.x_WI[k]));
      const std::string name = "'" + spec.name + "'";
      if (numeric) check(name, spec.rows, numeric->J, "depends on it", probe.name);
      check(name, spec.rows, answer.by_x.J.col(k), "of its derivative is written", probe.name);
    }
    for (int k = 0; k < bench.n_noises(); ++k) {
      const NoiseSpec& noise = bench.description().noises[static_cast<std::size_t>(k)];
      if (!in_range(bench, noise)) continue;
      const std::string name = noise_name(noise, k);
      check(name, noise.rows, answer.by_n.J.col(k), "of its derivative is written", probe.name);
      if (noise.kind == NoiseKind::kSlip) continue;
      const auto numeric = differences(bench, probe, by_channel(noise), 1e-6);
      if (numeric) check(name, noise.rows, numeric->J, "depends on it", probe.name);
    }
  }
}

}  // namespace viwo::conformance
