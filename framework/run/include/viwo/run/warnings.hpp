// What is suspicious of a run as a whole.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "viwo/math/trajectory.hpp"
#include "viwo/plausibility/finding.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/run/run_result.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// An update that had more than a fifth of its factors rejected, or weighed down, by gates.
struct Contradiction {
  std::string update;
  std::string text;
  bool is_most = false;  ///< more than half
};
std::vector<Contradiction> contradictions(const std::vector<UpdateTrack>& updates);

/// Rejections of one reason, and measurements of a noise, of which fewer tell nothing.
inline constexpr std::int64_t kFewestCounted = 20;

/// A noise was found more than ten times what is configured: the filter has found by itself that
/// something is wrong with the configuration.
bool has_gross_noise(const RunResult& result);

/// Of a run that came to its end, with its accuracy: contradictions are doubts where they are of
/// most of an update, or beside a gross noise, but warnings where a reference agrees with the
/// estimate. An estimate that has little to do with how the reference moves is doubted, too: off by
/// more than half of the way on segments of every length, and aligned by a good part of where the
/// reference went. So are wheels most of whose samples cannot be used, and wheels alone that end up
/// elsewhere: off by a quarter of the way, or half a turn.
void doubt(RunResult& result, const WheelsWay& wheels_way = {});

/// Doubts of what all samples were left out for. Stamps become times since `begin_ns`.
std::vector<std::string> refused_altogether(std::span<const RejectionCount> rejections,
                                            std::int64_t begin_ns);

/// Warnings of what a fifth of the samples, but not all, was left out for, and of noises far above
/// what is configured. Stamps become times since `begin_ns`.
std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns);

/// What the samples say against the configuration: doubts, where the filter has found a noise far
/// above what is configured.
void add_findings(const Findings& findings, RunResult& result);

/// By how many prior sigmas intrinsics have gone, by name, each given where the others are
/// (CAL-18): a first wheel whose zero is off turns the frame that the gauge holds, and all other
/// wheels in it; a wheel that has gone alone has gone by itself. Of wheels of which the gauge
/// holds some entries.
std::map<std::string, double> sigmas_from_prior(const FilterSetup& filter,
                                                std::span<const CalibrationTrack> tracks);
/// Calibration that has gone where its prior does not reach, beyond five sigmas: doubts beyond ten,
/// and where a noise, too, is far above what is configured or one moves by ten of its own sigmas as
/// it is learned, else warnings. By how many sigmas says `sigmas_of` where it has the name, else
/// the track.
void add_far_from_prior(const std::map<std::string, double>& sigmas_of, RunResult& result);
/// Of a calibration that is much surer than it ought to be, one line.
std::vector<std::string> too_sure(const RunResult& result);

/// The accuracy, with a warning when most of the estimate has no part in it because the reference
/// has gaps there, or when there is none to tell.
void compare(const Trajectory& reference, const RunSetup& setup, RunResult& result);

}  // namespace viwo
