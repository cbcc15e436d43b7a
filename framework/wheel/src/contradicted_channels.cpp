#include "viwo/wheel/contradicted_channels.hpp"

#include <bit>
#include <iterator>

#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/wheel/wheel_check.hpp"

namespace viwo {
namespace {

constexpr double kProbability = 1e-4;
/// Slip of a wheel is over after half a second.
constexpr double kLong_s = 0.5, kShare = 0.2;

struct Run {
  std::int64_t samples = 0;                         ///< left out in all
  std::int64_t from_ns = 0, to_ns = 0, now_ns = 0;  ///< the longest without a break, and this one
  std::int64_t end_ns = 0;                          ///< of the sample before
  bool lasts = false;

  void add(bool is_bad, const EncoderSample& sample) {
    // A hole of the log is no part of it.
    lasts = lasts && is_bad && sample.begin_ns - end_ns <= 2 * (sample.end_ns - sample.begin_ns);
    end_ns = sample.end_ns;
    if (!is_bad) return;
    if (!lasts) now_ns = sample.begin_ns;
    lasts = true;
    ++samples;
    if (end_ns - now_ns <= to_ns - from_ns) return;
    from_ns = now_ns;
    to_ns = end_ns;
  }
};

}  // namespace

std::vector<ContradictedChannel> contradicted_channels(std::span<const EncoderSample> samples,
                                                       std::shared_ptr<const WheelModel> model,
                                                       const Intrinsics& x_WI,
                                                       const IntrinsicMatrix& P,
                                                       std::vector<EncoderSample>* left) {
  const ModelDescription& description = model->description();
  const auto n_drive = static_cast<std::size_t>(description.n_drive);
  std::vector<Run> runs(n_drive + static_cast<std::size_t>(description.n_steer));
  WheelCheck check(std::move(model), kProbability);
  if (left != nullptr) left->clear();
  if (check.is_on()) check.set_calibration(x_WI, P);
  for (const EncoderSample& sample : samples) {
    EncoderSample checked = sample;
    if (check.is_on()) check.check(checked);
    if (left != nullptr && checked.bad_drives == 0 && checked.bad_steers == 0) {
      left->push_back(sample);
    }
    const auto is_bad = [&](std::size_t i) {
      return i < n_drive ? (checked.bad_drives >> i & 1u) != 0
                         : (checked.bad_steers >> (i - n_drive) & 1u) != 0;
    };
    const auto n_bad = std::popcount(checked.bad_drives) + std::popcount(checked.bad_steers);
    // All of them: nobody knows which one it is.
    const bool is_known = n_bad < std::ssize(runs);
    for (std::size_t i = 0; i < runs.size(); ++i) runs[i].add(is_known && is_bad(i), sample);
  }
  std::vector<ContradictedChannel> found;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double longest_s = seconds_between(runs[i].from_ns, runs[i].to_ns);
    const double share = static_cast<double>(runs[i].samples) / static_cast<double>(samples.size());
    if (longest_s < kLong_s && !(share >= kShare)) continue;
    const bool is_drive = i < n_drive;
    found.push_back(
        {(is_drive ? "drive_" : "steer_") + std::to_string(1 + i - (is_drive ? 0 : n_drive)), share,
         longest_s, runs[i].from_ns});
  }
  return found;
}

std::string text_of(const ContradictedChannel& channel, std::int64_t begin_ns) {
  return channel.name + " is contradicted by all others in " +
         significant(100. * channel.share, 2) + " % of the samples, for " +
         significant(channel.longest_s, 2) + " s from " + time_text(channel.from_ns - begin_ns) +
         " on: it was dead, blocked, slipped, or its encoder jumped";
}

}  // namespace viwo
