#include "viwo/wheel/contradicted_channels.hpp"

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
  bool lasts = false;

  void add(bool is_bad, std::int64_t t_ns) {
    if (is_bad && !lasts) now_ns = t_ns;
    lasts = is_bad;
    if (!is_bad) return;
    ++samples;
    if (t_ns - now_ns <= to_ns - from_ns) return;
    from_ns = now_ns;
    to_ns = t_ns;
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
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const bool is_bad = i < n_drive ? (checked.bad_drives >> i & 1u) != 0
                                      : (checked.bad_steers >> (i - n_drive) & 1u) != 0;
      runs[i].add(is_bad, sample.t_ns);
    }
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
