// What is suspicious of a run as a whole.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "viwo/run/run_result.hpp"

namespace viwo {

/// An update that had more than a fifth of its factors rejected.
struct Contradiction {
  std::string update;
  std::string text;
  bool is_doubt = false;  ///< more than half: it, or what contradicts it, is wrong
};
std::vector<Contradiction> contradictions(const std::vector<UpdateTrack>& updates);

/// Warnings of what a fifth of the samples was left out for, and of noises far above what is
/// configured. Stamps become times since `begin_ns`.
std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns);

/// Warnings of calibration that has gone where its prior does not reach.
std::vector<std::string> far_from_prior(const std::vector<CalibrationTrack>& calibration);

/// A doubt of an estimate that has little to do with how the reference moves: off by more than half
/// of the way on the shortest segments that are compared.
void doubt_against_reference(RunResult& result);

/// An accuracy that most of the estimate has no part in, because the reference has gaps there.
void warn_of_gaps(RunResult& result);

}  // namespace viwo
