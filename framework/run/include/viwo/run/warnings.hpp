// What is suspicious of a run as a whole.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "viwo/run/run_result.hpp"

namespace viwo {

/// Warnings of updates that had more than a third of their factors rejected.
std::vector<std::string> contradictions(const std::vector<UpdateTrack>& updates);

/// Warnings of what a fifth of the samples was left out for, and of noises far above what is
/// configured. Stamps become times since `begin_ns`.
std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns);

/// Warnings of calibration that has gone where its prior does not reach.
std::vector<std::string> far_from_prior(const std::vector<CalibrationTrack>& calibration);

/// An accuracy that most of the estimate has no part in, because the reference has gaps there.
void warn_of_gaps(RunResult& result);

}  // namespace viwo
