// Whether a sensor goes on giving samples: none at all, gaps, an early end, of one of its cameras,
// too, samples that are held up and then come all at once; and stamps of another unit.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viwo/api/stamp_order.hpp"
#include "viwo/plausibility/finding.hpp"

namespace viwo {

/// Samples of one kind from one sensor. Times are of a clock that all streams of a run share: their
/// stamps, unless those are of another time. Nothing is allocated while samples come.
class StreamWatch {
 public:
  /// A gap is longer than `least_gap_s`, which the filter goes on without, and than ten times the
  /// usual period.
  /// No usual period is longer than `longest_period_s`.
  StreamWatch(std::string name, double least_gap_s,
              double longest_period_s = std::numeric_limits<double>::infinity())
      : name_(std::move(name)),
        least_gap_ns_(static_cast<std::int64_t>(1e9 * least_gap_s)),
        longest_period_ns_(1e9 * longest_period_s) {}

  /// A sample has come, of camera `number` if there are several. `now_ns`: the newest time of all
  /// streams, which begins with the first one. `rests`: of a base that stands, which a log that is
  /// written on change may end with.
  void add(std::int64_t stamp_ns, int number, std::int64_t now_ns, bool rests = false);
  const std::string& name() const { return name_; }
  bool has_begun() const { return has_begun_; }
  /// From its stamps to the common time, when it began: 0 but for stamps of another clock.
  std::int64_t first_offset_ns() const { return first_offset_ns_; }
  /// Time of the newest sample.
  std::int64_t newest_ns() const { return newest_ns_; }

  /// Stamps in another unit than is taken for theirs: a doubt.
  void find_unit(Findings& out) const;
  /// What happens at `now_ns`, while more is to come. Times in texts count from `zero_ns`.
  void findings(std::int64_t now_ns, std::int64_t zero_ns, Findings& out) const;
  /// What has happened in all of a "recording" or "run" that ends at `now_ns`.
  void findings(std::int64_t now_ns, std::int64_t zero_ns, const char* of_what,
                Findings& out) const;

 private:
  struct Pause {
    std::int64_t begin_ns = 0, length_ns = 0;
  };
  std::int64_t longest_spacing_ns() const;
  /// None where that is no time of any clock.
  std::optional<std::int64_t> common_time_ns(std::int64_t stamp_ns) const;
  void find_silent_channels(std::int64_t now_ns, std::int64_t zero_ns, std::int64_t longest_ns,
                            Findings& out) const;
  bool is_set_back(std::int64_t t_ns);
  void watch_period(std::int64_t spacing_ns);
  void watch_bursts(std::int64_t spacing_ns);
  void find_held_up(Findings& out) const;

  std::string name_;
  std::int64_t least_gap_ns_;
  double longest_period_ns_;
  StampJump jump_{1.};
  bool has_begun_ = false;
  bool rests_ = false;
  std::int64_t n_samples_ = 0;
  std::int64_t offset_ns_ = 0;  ///< from its stamps to the common time
  std::int64_t first_offset_ns_ = 0;
  std::int64_t newest_ns_ = 0;
  std::optional<std::int64_t> doubted_ns_;  ///< time of the last sample, if that is far ahead
  int n_behind_ = 0;  ///< samples without a break that are long before the newest
  struct Channel {
    int number = 0;
    std::int64_t newest_ns = 0;
  };
  Channel& channel(int number);
  std::vector<Channel> channels_;
  // The usual period, a running median, is that of the first channel.
  int n_spacings_ = 0;  ///< as far as they matter
  double period_ns_ = 0.;
  double spacings_ns_ = 0., n_all_spacings_ = 0.;  ///< their sum and number
  std::int64_t n_gaps_ = 0, gaps_ns_ = 0;
  Pause last_gap_, longest_gap_;
  // Samples that a pause lacks, and that came at once after it.
  double n_missing_ = 0.;
  int n_at_once_ = 0;
  std::int64_t pause_ns_ = 0;
  std::int64_t n_held_up_ = 0, longest_held_up_ns_ = 0;
};

}  // namespace viwo
