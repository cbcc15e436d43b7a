#include "readings.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::wpilog {
namespace {

constexpr std::int64_t kMaxStamp_us = 4'000'000'000'000'000;
/// Records of one entry may be out of order, but by less than this.
constexpr std::int64_t kFarBack_us = 1'000'000;
constexpr const char* kWentBack = "stamp a second or more before one of the same entry";

/// When, and at which byte of the file.
struct Instant {
  std::int64_t t_us = 0;
  std::int64_t offset = 0;
};

bool is_earlier(const Instant& a, const Instant& b) { return a.t_us < b.t_us; }

bool has_stamp(const Datum& datum) {
  return datum.t_us >= -kMaxStamp_us && datum.t_us <= kMaxStamp_us;
}

/// The numbers of one source over time.
class Track {
 public:
  Track(const Contents& contents, const Source& source, StampOrder& order)
      : contents_(contents), entry_(*source.entry) {
    for (const Datum& datum : entry_.data) {
      const auto where = [&] { return contents.where(datum.offset); };
      const std::size_t begin = numbers_.size();
      if (datum.is_end) {
        if (width_ > 0 && has_stamp(datum))
          events_.push_back({{datum.t_us, datum.offset}, begin - width_, true});
      } else if (!has_stamp(datum)) {
        order.reject("stamp that is none", where);
      } else if (!source.pick.decode(entry_.payload(datum), numbers_)) {
        order.reject("record that does not fit its type", where);
      } else if (numbers_.size() == begin) {
        order.leave_out("record of nothing", where);
      } else if (width_ > 0 && numbers_.size() - begin != width_) {
        numbers_.resize(begin);
        order.reject("record of another number of values than the first", where);
      } else {
        width_ = numbers_.size() - begin;
        add({{datum.t_us, datum.offset}, begin}, order);
      }
    }
    // The file need not be in the order of time.
    std::stable_sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) {
      return is_earlier(a.instant, b.instant);
    });
  }

  std::size_t width() const { return width_; }

  void append_instants(std::vector<Instant>& out) const {
    for (const Event& event : events_) {
      if (!event.is_end) out.push_back(event.instant);
    }
  }

  /// Two values within a cycle are of two things.
  void check_cycles(const ReadingOptions& options, StampOrder& order) const {
    std::int64_t count = 0, first = 0;
    for (std::size_t i = 1; i < events_.size(); ++i) {
      const Event &a = events_[i - 1], &b = events_[i];
      if (b.instant.t_us - a.instant.t_us > options.spread_us || same(a, b) || a.is_end) continue;
      if (count++ == 0) first = b.instant.offset;
      order.leave_out("'" + entry_.name + "': two values within a cycle, the first not used",
                      [&] { return contents_.where(b.instant.offset); });
    }
    if (static_cast<double>(count) <=
        options.max_rejected_fraction * static_cast<double>(events_.size())) {
      return;
    }
    throw InputError(contents_.file() + "  the entry '" + entry_.name + "' has two values within " +
                     number_text(1e-6 * static_cast<double>(options.spread_us)) + " s " +
                     std::to_string(count) + " times in " + std::to_string(events_.size()) +
                     " records (first at byte " + std::to_string(first) +
                     "): are two things written under one name? They cannot be told apart here; "
                     "if its cycle is shorter, so must cycle_spread_s be");
  }

  /// Goes to the last value of the cycle at `t_us` or before. nullptr, or why there is none.
  const char* advance(std::int64_t t_us, std::int64_t spread_us) {
    while (next_ < events_.size() && events_[next_].instant.t_us <= t_us + spread_us) ++next_;
    if (next_ == 0) return "cycle before the first value of each entry";
    const Event& last = events_[next_ - 1];
    return last.is_end && last.instant.t_us < t_us ? "cycle after the end of an entry" : nullptr;
  }
  std::span<const double> numbers() const { return numbers(events_[next_ - 1]); }

 private:
  struct Event {
    Instant instant;
    std::size_t begin = 0;  ///< of its numbers
    bool is_end = false;    ///< they hold up to here
  };

  /// In the order of the file. Of two stamps that contradict each other the one is wrong that
  /// stands alone.
  void add(const Event& event, StampOrder& order) {
    const auto reject = [&](const Event& one) {
      order.reject(kWentBack, [&] { return contents_.where(one.instant.offset); });
    };
    const std::int64_t t_us = event.instant.t_us;
    const bool is_back = latest_us_ && t_us <= *latest_us_ - (is_behind_ ? 0 : kFarBack_us);
    if (is_back && !is_behind_ && events_.back().instant.t_us == *latest_us_ &&
        !events_.back().is_end && (!before_us_ || t_us > *before_us_ - kFarBack_us)) {
      reject(events_.back());
      events_.pop_back();
      latest_us_ = before_us_;
    } else if (is_back) {
      is_behind_ = true;
      numbers_.resize(event.begin);
      return reject(event);
    }
    is_behind_ = false;
    events_.push_back(event);
    if (latest_us_ && t_us <= *latest_us_) return;
    before_us_ = std::exchange(latest_us_, t_us);
  }

  std::span<const double> numbers(const Event& event) const {
    return std::span(numbers_).subspan(event.begin, width_);
  }
  bool same(const Event& a, const Event& b) const {
    const auto of_a = numbers(a), of_b = numbers(b);
    return std::equal(of_a.begin(), of_a.end(), of_b.begin());
  }

  const Contents& contents_;
  const Entry& entry_;
  std::vector<Event> events_;
  std::vector<double> numbers_;
  std::size_t width_ = 0;
  std::optional<std::int64_t> latest_us_, before_us_;  ///< the last stamps, each after all others
  bool is_behind_ = false;                             ///< until stamps are after the last again
  std::size_t next_ = 0;
};

/// Where readings are: at least a spread apart.
std::vector<Instant> cycles_of(const std::vector<Track>& tracks, const ReadingOptions& options) {
  std::vector<Instant> all, out;
  if (options.cycle == nullptr) {
    for (const Track& track : tracks) track.append_instants(all);
  } else {
    for (const Datum& datum : options.cycle->data) {
      if (!datum.is_end && has_stamp(datum)) all.push_back({datum.t_us, datum.offset});
    }
  }
  std::stable_sort(all.begin(), all.end(), is_earlier);
  for (const Instant& instant : all) {
    if (out.empty() || instant.t_us > out.back().t_us + options.spread_us) out.push_back(instant);
  }
  return out;
}

}  // namespace

void for_each_reading(const Contents& contents, const std::vector<Source>& sources,
                      const ReadingOptions& options, StampOrder& order,
                      const std::function<void(std::int64_t t_ns, std::span<const double> numbers,
                                               const std::function<std::string()>& where)>& visit) {
  std::vector<Track> tracks;
  for (const Source& source : sources) tracks.emplace_back(contents, source, order);
  for (const Track& track : tracks) track.check_cycles(options, order);
  std::vector<double> numbers;
  for (const Instant& cycle : cycles_of(tracks, options)) {
    const auto where = [&] { return contents.where(cycle.offset); };
    numbers.clear();
    const char* missing = nullptr;
    for (Track& track : tracks) {
      if (const char* const why = track.advance(cycle.t_us, options.spread_us)) {
        missing = why;
        continue;
      }
      const auto more = track.numbers();
      numbers.insert(numbers.end(), more.begin(), more.end());
    }
    if (missing == nullptr) {
      visit(1000 * cycle.t_us, numbers, where);
    } else {
      order.leave_out(missing, where);
    }
  }
}

}  // namespace viwo::wpilog
