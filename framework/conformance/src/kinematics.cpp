#include "kinematics.hpp"

#include <cmath>
#include <set>
#include <thread>

#include <Eigen/Eigenvalues>

#include "checks.hpp"
#include "derivatives.hpp"

namespace viwo::conformance {

using robot::Answer;
using robot::Bench;
using robot::noise_name;
using robot::Probe;
using robot::Signal;

namespace {

using config::Node;

Bench bench_of(const Subject& subject) { return Bench(subject.make<KinematicModel>().object); }

/// The section with the numbers of one parameter a little larger; null if it has none.
Node varied(const Node& resolved, const ParamSpec& spec) {
  if (spec.type != ParamType::kNumber && spec.type != ParamType::kNumbers) return {};
  Node section = resolved;
  Node* value = section.find(spec.name);
  if (value == nullptr) return {};
  const auto larger = [](const Node& text) {
    const double old = std::stod(text.scalar());
    return Node::scalar_of(number(old == 0. ? 0.01 : 1.01 * old));
  };
  if (value->is_scalar()) *value = larger(*value);
  for (Node& item : value->items()) item = larger(item);
  return section;
}

/// Everything that a model says, at readings that do not depend on the model.
std::vector<Answer> fingerprint(const Bench& bench) {
  std::vector<Answer> answers;
  for (Probe probe : bench.probes()) {
    if (probe.follows) continue;
    probe.x_WI = bench.nominal();
    answers.push_back(bench.answer(probe));
  }
  return answers;
}

bool same(const std::vector<Answer>& a, const std::vector<Answer>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!same_bits(a[i], b[i])) return false;
  }
  return true;
}

bool equal_values(const Answer& a, const Answer& b) {
  return a.status == b.status && a.rows.A == b.rows.A && a.rows.b == b.rows.b &&
         a.by_x.J == b.by_x.J && a.by_x.DtE == b.by_x.DtE && a.by_n.J == b.by_n.J &&
         a.by_n.DtE == b.by_n.DtE;
}

}  // namespace

void check_description(const Subject& subject, Findings& findings) {
  const Bench bench = bench_of(subject);  // sizes and row ranges
  const ModelDescription& d = bench.description();
  std::set<std::string> names;
  for (const IntrinsicSpec& spec : d.intrinsics) {
    const std::string name = "intrinsic '" + spec.name + "'";
    if (!is_snake_case(spec.name)) findings.fail(name + ": its name is not in snake_case");
    if (!names.insert(spec.name).second) findings.fail(name + " appears twice");
    if (spec.unit.empty()) findings.fail(name + " has no unit - say \"1\" for a pure number");
    if (!std::isfinite(spec.nominal)) findings.fail(name + ": its nominal value is not finite");
    if (!(spec.prior_sigma > 0.) || !std::isfinite(spec.prior_sigma)) {
      findings.fail(name + ": prior sigma " + number(spec.prior_sigma) + " is not positive");
    }
  }
  if (d.noise_block < 1 || d.n_rows % d.noise_block != 0) {
    findings.fail("noise_block " + std::to_string(d.noise_block) + " does not divide the " +
                  std::to_string(d.n_rows) + " rows");
  }
  ModelDescription again;
  bench.model().describe(again);
  if (again.intrinsics.size() != d.intrinsics.size() || again.noises.size() != d.noises.size()) {
    findings.fail("describe() says another thing when it is called again");
  }
}

void check_noise_model(const Bench& bench, Findings& findings) {
  const ModelDescription& d = bench.description();
  bool slip_seen = false;
  for (int k = 0; k < bench.n_noises(); ++k) {
    const NoiseSpec& noise = d.noises[static_cast<std::size_t>(k)];
    const std::string name = noise_name(noise, k);
    if (!(noise.sigma > 0.) || !std::isfinite(noise.sigma)) {
      findings.fail(name + ": sigma " + number(noise.sigma) + " is not positive");
    }
    const int channels = noise.kind == NoiseKind::kDrive   ? d.n_drive
                         : noise.kind == NoiseKind::kSteer ? d.n_steer
                                                           : noise.channel + 1;
    if (noise.channel < 0 || noise.channel >= channels) {
      findings.fail(name + ": there is no such channel, the model has " + std::to_string(channels));
    }
    if (noise.kind != NoiseKind::kSlip && slip_seen) {
      findings.fail(name + " stands behind a slip source - encoders first, slip last");
    }
    slip_seen = slip_seen || noise.kind == NoiseKind::kSlip;
  }
  if (!findings.failures().empty()) return;
  for (const Probe& probe : bench.motions()) {
    const Answer answer = bench.answer(probe);
    if (answer.status != Status::kOk) continue;
    Eigen::MatrixXd J = answer.by_n.J;
    for (int k = 0; k < bench.n_noises(); ++k)
      J.col(k) *= d.noises[static_cast<std::size_t>(k)].sigma;
    const Eigen::MatrixXd R = J * J.transpose();
    const int size = d.noise_block;
    for (int first = 0; first < d.n_rows; first += size) {
      const auto block = R.block(first, first, size, size);
      const Eigen::VectorXd values =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(block).eigenvalues();
      const std::string rows =
          size == 1 ? "row " + std::to_string(first)
                    : "rows " + std::to_string(first) + " to " + std::to_string(first + size - 1);
      if (!(values[0] > 1e-12 * values[size - 1]) || !(values[size - 1] > 0.)) {
        return findings.fail("the noise of " + rows + " is singular at " + probe.name +
                             ": no source enters some direction of them - add a slip source");
      }
      const auto beside = R.middleRows(first, size).rightCols(d.n_rows - first - size);
      if (beside.size() > 0 && beside.cwiseAbs().maxCoeff() > 1e-9 * R.diagonal().maxCoeff()) {
        return findings.fail("the noise of " + rows + " is correlated with later rows at " +
                             probe.name + " - noise_block " + std::to_string(size) +
                             " is too small");
      }
    }
  }
}

void check_constant_A(const Bench& bench, Findings& findings) {
  if (!bench.description().constant_A) return findings.note("A depends on the sample");
  std::mt19937_64 rng(4);
  const Intrinsics x_WI = bench.unequal(rng);
  std::optional<RowSystem> first;
  for (const Probe& probe : bench.probes()) {
    const auto rows = bench.rows(probe.y, x_WI);
    if (!rows) continue;
    if (!first) first = rows;
    if (rows->A != first->A) {
      return findings.fail("constant_A is set, but A at " + probe.name + " differs by up to " +
                           number((rows->A - first->A).cwiseAbs().maxCoeff()) +
                           " from that at another sample - do not set it");
    }
    RowSystem again = *first;
    bench.model().rows(probe.y, x_WI, true, again);
    if (again.A != rows->A || again.b != rows->b) {
      return findings.fail("with A_is_current rows() gives another A or b at " + probe.name);
    }
  }
}

void check_repeatable(const Subject& subject, Findings& findings) {
  const Bench bench = bench_of(subject), other = bench_of(subject);
  const std::vector<Probe> probes = bench.probes();
  std::vector<Answer> first;
  for (const Probe& probe : probes) first.push_back(bench.answer(probe));
  Answer used = bench.empty_answer();
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const Probe& probe = probes[i];
    if (!same_bits(bench.answer(probe), first[i])) {
      return findings.fail("the same call gives other numbers the second time, at " + probe.name +
                           " - results may depend on the arguments alone");
    }
    if (!same_bits(other.answer(probe), first[i])) {
      return findings.fail("another instance with the same parameters gives other numbers, at " +
                           probe.name);
    }
    if (first[i].status != Status::kOk) continue;
    // rows() of another sample before the derivatives of this one.
    Answer late = bench.empty_answer();
    bench.model().rows(probe.y, probe.x_WI, false, late.rows);
    const Probe& between = probes[(i + 1) % probes.size()];
    bench.answer(between);
    late.status = Status::kOk;
    bench.model().intrinsic_derivatives(probe.y, probe.x_WI, late.rows, late.rows.b, probe.xi,
                                        probe.e, late.by_x);
    bench.model().noise_derivatives(probe.y, probe.x_WI, late.rows, late.rows.b, probe.xi, probe.e,
                                    late.by_n);
    if (!same_bits(late, first[i])) {
      return findings.fail("derivatives at " + probe.name +
                           " change when rows() of another sample (" + between.name +
                           ") is called before - keep what they need in "
                           "RowSystem::kept, not in the object");
    }
    bench.answer(probe, Signal::kMeasured, used);
    if (used.status == Status::kOk && !equal_values(used, first[i])) {
      return findings.fail(
          "outputs that hold the numbers of another sample come out different at " + probe.name +
          " - write every entry that is not always zero, and set "
          "before you add");
    }
  }
}

void check_independent(const Subject& subject, Findings& findings) {
  const Loaded<KinematicModel> loaded = subject.make<KinematicModel>();
  const Bench one(loaded.object);
  const std::vector<Answer> alone = fingerprint(one);
  // Another process knows what an instance says when it has never seen another one.
  bool any = false;
  for (const ParamSpec& spec : loaded.info.params) {
    const Node section = varied(loaded.resolved, spec);
    if (section.is_null() || !subject.try_section(section).empty()) continue;
    const Bench two(subject.make<KinematicModel>(section).object);
    const std::vector<Answer> others = fingerprint(two);
    any = any || two.nominal() != one.nominal() || !same(others, alone);
    if (!same(fingerprint(one), alone) || one.nominal() != Bench(loaded.object).nominal()) {
      return findings.fail("an instance changes when another one is made with a different '" +
                           spec.name +
                           "' - no static variables: instances must not see each other");
    }
    if (!same(fingerprint(two), others)) {
      return findings.fail("an instance changes when another one with a different '" + spec.name +
                           "' is used - no static variables: instances must not see each other");
    }
  }
  if (!any && !loaded.info.params.empty()) {
    findings.fail(
        "no parameter changes what the model says - are they read, and not kept from "
        "the first instance?");
  }
}

void check_concurrent(const Bench& bench, Findings& findings) {
  const std::vector<Probe> probes = bench.probes();
  std::vector<Answer> expected;
  for (const Probe& probe : probes) expected.push_back(bench.answer(probe));
  constexpr int kThreads = 4, kRounds = 40;
  std::vector<std::string> wrong(kThreads);
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (int round = 0; round < kRounds; ++round) {
        for (std::size_t i = 0; i < probes.size(); ++i) {
          const std::size_t k = (i + static_cast<std::size_t>(t * 3 + round)) % probes.size();
          if (same_bits(bench.answer(probes[k]), expected[k])) continue;
          wrong[static_cast<std::size_t>(t)] = probes[k].name;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::string& where : wrong) {
    if (where.empty()) continue;
    return findings.fail("calls of several threads on one object disturb each other, at " + where +
                         " - const calls may write nothing but their outputs");
  }
}

std::vector<NamedCheck> kinematics_checks(const Subject& subject) {
  const auto on_bench = [&subject](void (*check)(const Bench&, Findings&)) -> Check {
    return [&subject, check](Findings& findings) { check(bench_of(subject), findings); };
  };
  const auto on_subject = [&subject](void (*check)(const Subject&, Findings&)) -> Check {
    return [&subject, check](Findings& findings) { check(subject, findings); };
  };
  return {{"description", on_subject(check_description)},
          {"repeatable", on_subject(check_repeatable)},
          {"noise model", on_bench(check_noise_model)},
          {"constant A", on_bench(check_constant_A)},
          {"rank of A", on_bench(check_rank)},
          {"derivatives by the intrinsics", on_bench(check_intrinsic_derivatives)},
          {"derivatives at the fitted signal", on_bench(check_fitted_signal)},
          {"derivatives by the noise", on_bench(check_noise_derivatives)},
          {"row ranges", on_bench(check_row_ranges)},
          {"gauge", on_bench(check_gauge)},
          {"change of frame", on_bench(check_move_frame)},
          {"inverse kinematics", on_bench(check_inverse)},
          {"independent instances", on_subject(check_independent)},
          {"concurrent calls", on_bench(check_concurrent)},
          {"hostile readings", on_bench(check_hostile_readings)},
          {"hostile arguments", on_bench(check_hostile_arguments)}};
}

}  // namespace viwo::conformance
