// Checks of an update: what it hands to the filter over drives of a simulated robot.
#include <algorithm>
#include <array>
#include <memory>

#include "checks.hpp"
#include "update_declarations.hpp"
#include "update_derivatives.hpp"
#include "update_hostile.hpp"
#include "update_watch.hpp"
#include "viwo/robot/robot.hpp"

namespace viwo::conformance {

using namespace robot;

namespace {

/// What an update did over a drive.
struct Outcome {
  std::int64_t epochs = 0, factors = 0, added_blocks = 0;
  std::vector<std::uint64_t> digests;
};

void check_rejections(const Update& update, Findings& findings) {
  std::vector<RejectionCount> rejections;
  update.rejections(rejections);
  for (const RejectionCount& rejection : rejections) {
    if (!rejection.reason.empty() && rejection.count > 0) continue;
    findings.fail("rejections() gives an entry without reason or count");
  }
}

/// Two instances over the same drive, which must not see each other.
Outcome run(const Subject& subject, Findings& findings, const Drive& drive,
            Calibration calibration = Calibration::kEstimated, bool spoil = false,
            bool full_rooms = false) {
  const auto watch = [&](Findings* to) {
    return std::make_shared<Watch>(subject.make<Update>(), to,
                                   WatchOptions{spoil ? make_spoil() : Spoil(), full_rooms});
  };
  const auto one = watch(&findings), two = watch(nullptr);
  const std::array<std::shared_ptr<Update>, 2> updates{one, two};
  run_updates(updates, subject.info().name, drive, calibration);
  const auto& a = one->digests();
  const auto& b = two->digests();
  const auto differs = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  if (differs != a.end() && findings.failures().empty()) {
    findings.fail("two instances give different factors for the same epoch (epoch " +
                  std::to_string(differs - a.begin() + 1) +
                  ") - no static variables, no clock, no random numbers but from "
                  "HostServices::seed");
  }
  check_rejections(*one, findings);
  return {static_cast<std::int64_t>(a.size()), one->factors(), one->added_blocks(), a};
}

Drive only_imu(Drive drive) {
  std::erase_if(drive.measurements,
                [](const Measurement& m) { return m.get_if<ImuSample>() == nullptr; });
  return drive;
}

void check_start(const Subject& subject, Findings& findings) {
  try {
    run(subject, findings, only_imu(simulate_drive("stationary", 0.5)));
  } catch (const InputError& error) {
    findings.warn(kRobot);
    findings.fail("start() or the first epochs: " + std::string(error.what()));
  } catch (const std::exception& error) {
    findings.fail("start() or the first epochs: " + std::string(error.what()));
  }
}

void check_empty_epochs(const Subject& subject, Findings& findings) {
  const Outcome outcome = run(subject, findings, only_imu(simulate_drive("stationary", 3.)));
  findings.note(std::to_string(outcome.epochs) + " epochs without measurements, " +
                std::to_string(outcome.factors) + " factors");
}

void check_factors(const Subject& subject, Findings& findings) {
  std::int64_t factors = 0;
  for (const char* motion : {"stationary", "figure_eight", "spin"}) {
    factors += run(subject, findings, simulate_drive(motion, 4.)).factors;
  }
  findings.note(std::to_string(factors) + " factors over three drives");
  if (factors == 0) findings.note("no factor was given: there was nothing that could be checked");
}

void check_held_calibration(const Subject& subject, Findings& findings) {
  run(subject, findings, simulate_drive("figure_eight", 3.), Calibration::kHeld);
}

void check_full_rooms(const Subject& subject, Findings& findings) {
  const Drive drive = simulate_drive("figure_eight", 3.);
  run(subject, findings, drive, Calibration::kEstimated, false, true);
}

void check_update_repeatable(const Subject& subject, Findings& findings) {
  const Drive drive = simulate_drive("figure_eight", 3.);
  const Outcome once = run(subject, findings, drive), again = run(subject, findings, drive);
  if (once.digests == again.digests) return;
  findings.fail(
      "the same drive again gives other factors - results may depend on configuration "
      "and measurements alone");
}

void check_hostile_epochs(const Subject& subject, Findings& findings) {
  run(subject, findings, simulate_drive("figure_eight", 4.), Calibration::kEstimated, true);
}

using UpdateCheck = void (*)(const Subject&, Findings&);

/// A check of an update that runs; `with_samples`: of what it makes of them.
Check running(const Subject& subject, bool with_samples, UpdateCheck check) {
  return [&subject, with_samples, check](Findings& findings) {
    const Unmet unmet = unmet_needs(subject);
    if (!unmet.blocks.empty()) return findings.skip(unmet.blocks);
    if (with_samples && !unmet.samples.empty()) return findings.skip(unmet.samples);
    check(subject, findings);
  };
}

}  // namespace

std::vector<NamedCheck> update_checks(const Subject& subject) {
  return {{"declarations", [&](Findings& findings) { check_declarations(subject, findings); }},
          {"start", running(subject, false, check_start)},
          {"empty epochs", running(subject, false, check_empty_epochs)},
          {"factors", running(subject, true, check_factors)},
          {"derivatives", running(subject, true, check_update_derivatives)},
          {"held calibration", running(subject, true, check_held_calibration)},
          {"full rooms", running(subject, true, check_full_rooms)},
          {"repeatable", running(subject, true, check_update_repeatable)},
          {"hostile epochs", running(subject, true, check_hostile_epochs)}};
}

}  // namespace viwo::conformance
