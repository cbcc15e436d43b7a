#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "viwo/checks/checks.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/periods.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Stamps;
using series::Wheels;

namespace {

/// A spacing that lacks at least one sample, and is more than jitter: the next of a shaken clock
/// comes within two periods.
constexpr double kGapPeriods = 2.5;
/// Of stamps that are whole periods apart, within kEvenPeriods, any that lacks one.
constexpr double kEvenGapPeriods = 1.5;
constexpr double kEvenPeriods = 0.25;
constexpr std::size_t kFewestStamps = 3;

std::string ms(double seconds) { return significant(1e3 * seconds, 3) + " ms"; }

struct Gaps {
  std::int64_t count = 0, missing = 0;
  double longest_s = 0.;
  std::int64_t longest_ns = 0;  ///< when it begins
};

/// Stamps that are whole periods apart: what is missing between them is no jitter.
bool are_even(const std::vector<double>& spacing_s, double period_s) {
  std::vector<double> off_s;
  off_s.reserve(spacing_s.size());
  for (const double s : spacing_s) {
    off_s.push_back(s - std::max(1., std::round(s / period_s)) * period_s);
  }
  return eval::quantile(off_s, 0.99) - eval::quantile(off_s, 0.01) <= kEvenPeriods * period_s;
}

Gaps gaps_of(const std::vector<std::int64_t>& t_ns, double period_s, double gap_s) {
  Gaps gaps;
  for (std::size_t i = 1; i < t_ns.size(); ++i) {
    const double spacing_s = seconds_between(t_ns[i - 1], t_ns[i]);
    if (spacing_s <= gap_s) continue;
    ++gaps.count;
    gaps.missing += std::llround(spacing_s / period_s) - 1;
    if (spacing_s <= gaps.longest_s) continue;
    gaps.longest_s = spacing_s;
    gaps.longest_ns = t_ns[i - 1];
  }
  return gaps;
}

double rate_between_gaps(const std::vector<double>& spacing_s, double gap_s) {
  double sum_s = 0., n = 0.;
  for (const double s : spacing_s) {
    if (s > gap_s) continue;
    sum_s += s;
    n += 1.;
  }
  return sum_s > 0. ? n / sum_s : 0.;
}

/// The filter's own limit (estimator.max_imu_gap_s): in a longer one nobody knows how the robot
/// moved.
double most_gap_s(const Recording& recording, const Stamps& stamps) {
  const bool is_imu =
      *stamps.type == sample_type<ImuSample>() && stamps.sensor == recording.imu_sensor;
  if (!is_imu || !recording.setup->filter) return INFINITY;
  return recording.setup->filter->options.imu.max_gap_s;
}

/// What a run makes of intervals that are longer or shorter than any that it takes, with the key
/// that says so: stamps of another unit, or a reference that is slow. "" for nothing.
struct Interval {
  std::string what;
  std::vector<Remedy> remedies;
};
Interval check_interval(const Recording& recording, const Stamps& stamps, double period_s) {
  const RunSetup& setup = *recording.setup;
  const auto is_of = [&](Consumer consumer) {
    return setup.routes.sensor_of(consumer) == stamps.sensor;
  };
  const bool is_reference =
      (*stamps.type == sample_type<PoseSample>() && is_of(Consumer::kReferencePoses)) ||
      (*stamps.type == sample_type<StateSample>() && is_of(Consumer::kReferenceStates));
  if (is_reference && period_s > setup.evaluation.max_reference_gap_s) {
    const std::string key = "evaluation.reference_max_gap_s";
    return {
        "a run takes none of it, for " + key + " says " + ms(setup.evaluation.max_reference_gap_s),
        {{key, significant(kGapPeriods * period_s, 2)}}};
  }
  const bool is_wheels = *stamps.type == sample_type<EncoderSample>();
  const bool is_bridged = is_wheels || *stamps.type == sample_type<ImuSample>();
  const std::string key = "sensors." + stamps.sensor + ".max_gap_s";
  const config::Node* longest = setup.resolved.at_path(key);
  if (is_bridged && longest != nullptr && period_s > std::stod(longest->scalar())) {
    return {"a run takes each interval of " + ms(period_s) + " for a gap (" + key + ": " +
                longest->scalar() + "): the unit of its stamps is another one (time_unit)?",
            {}};
  }
  if (period_s < kShortestPeriod_s || (is_wheels && period_s > kLongestEncoderPeriod_s)) {
    return {"no sensor of a robot gives a sample every " + ms(period_s) +
                ": the unit of its stamps is another one (time_unit)",
            {}};
  }
  const std::int64_t span_ns = stamps.t_ns.back() - stamps.t_ns.front();
  if (is_wheels && are_of_two_clocks(std::ssize(stamps.t_ns),
                                     span_ns / std::max<std::int64_t>(1, to_ns(setup.epoch_s)))) {
    return {"its stamps are of two clocks, or of another unit", {}};
  }
  return {};
}

std::string label_of(const Recording& recording, const Stamps& stamps) {
  std::string label = recording.label(stamps.sensor, *stamps.type);
  const bool several =
      std::any_of(recording.stamps.begin(), recording.stamps.end(), [&](const Stamps& other) {
        return other.sensor == stamps.sensor && *other.type == *stamps.type &&
               other.channel != stamps.channel;
      });
  if (several) label += ", camera " + std::to_string(stamps.channel);
  return label;
}

void check_jitter(const std::string& label, const std::vector<double>& spacing_s, Findings& out) {
  const double period_s = eval::median(spacing_s);
  const double p1_s = eval::quantile(spacing_s, 0.01), p99_s = eval::quantile(spacing_s, 0.99);
  const auto [shortest, longest] = std::minmax_element(spacing_s.begin(), spacing_s.end());
  if (p99_s - p1_s <= 0.5 * period_s) return;
  out.push_back({label,
                 Severity::kNote,
                 "jitter",
                 "its stamps jitter: intervals of " + ms(p1_s) + " to " + ms(p99_s) +
                     " (1 % .. 99 %; shortest " + ms(*shortest) + ", longest " + ms(*longest) +
                     ") around " + ms(period_s) + ": they are of arrival, not of measurement",
                 {{"jitter", p99_s - p1_s, "s"}}});
}

void check_stream(const Recording& recording, const Stamps& stamps, Findings& out) {
  const std::string label = label_of(recording, stamps);
  const std::vector<std::int64_t>& t_ns = stamps.t_ns;
  if (t_ns.size() < kFewestStamps) {
    out.push_back({label,
                   Severity::kNote,
                   "stamps",
                   "only " + std::to_string(t_ns.size()) + " samples",
                   {{"samples", static_cast<double>(t_ns.size()), ""}}});
    return;
  }
  std::vector<double> spacing_s;
  spacing_s.reserve(t_ns.size());
  for (std::size_t i = 1; i < t_ns.size(); ++i) {
    spacing_s.push_back(seconds_between(t_ns[i - 1], t_ns[i]));
  }
  const double span_s = seconds_between(t_ns.front(), t_ns.back());
  const double period_s = eval::median(spacing_s);
  const double p1_s = eval::quantile(spacing_s, 0.01), p99_s = eval::quantile(spacing_s, 0.99);
  const double longest_s = *std::max_element(spacing_s.begin(), spacing_s.end());
  const bool is_even = are_even(spacing_s, period_s);
  const double gap_s = (is_even ? kEvenGapPeriods : kGapPeriods) * period_s;
  const Gaps gaps = gaps_of(t_ns, period_s, gap_s);
  const double rate_hz = rate_between_gaps(spacing_s, gap_s);
  Finding rate{label,
               Severity::kFits,
               "stamps",
               "",
               {{"samples", static_cast<double>(t_ns.size()), ""},
                {"begin", seconds_between(recording.begin_ns(), t_ns.front()), "s"},
                {"span", span_s, "s"},
                {"rate", rate_hz, "Hz"},
                {"median interval", period_s, "s"},
                {"interval, 1 %", p1_s, "s"},
                {"interval, 99 %", p99_s, "s"},
                {"longest interval", longest_s, "s"},
                {"gaps", static_cast<double>(gaps.count), ""},
                {"missing samples", static_cast<double>(gaps.missing), ""}}};
  rate.what = significant(rate_hz, 4) + " Hz over " + significant(span_s, 4) + " s, " +
              std::to_string(gaps.count) + (gaps.count == 1 ? " gap" : " gaps");
  if (const Interval interval = check_interval(recording, stamps, period_s);
      !interval.what.empty()) {
    rate.severity = Severity::kFault;
    rate.what += "; " + interval.what;
    rate.remedies = interval.remedies;
  } else if (gaps.count > 0) {
    const std::string text = ": " + std::to_string(gaps.missing) +
                             " samples are missing, the longest gap has " + ms(gaps.longest_s) +
                             " at " + time_text(gaps.longest_ns - recording.begin_ns());
    const double most_s = most_gap_s(recording, stamps);
    rate.severity = gaps.longest_s > most_s ? Severity::kFault : Severity::kNote;
    rate.what += text;
    if (gaps.longest_s > most_s) {
      rate.what += "; how the robot moved in gaps longer than estimator.max_imu_gap_s (" +
                   ms(most_s) + ") nobody knows: look at cable, driver and recorder";
    }
  }
  out.push_back(rate);
  if (!is_even) check_jitter(label, spacing_s, out);
}

/// What no run or check takes anything of.
void check_unused(const Recording& recording, Findings& out) {
  for (const Stamps& stamps : recording.stamps) {
    const bool is_wheels = *stamps.type == sample_type<EncoderSample>();
    const bool is_taken =
        is_wheels
            ? std::any_of(recording.wheels.begin(), recording.wheels.end(),
                          [&](const Wheels& w) { return w.sensor == stamps.sensor; })
            : !(*stamps.type == sample_type<ImuSample>()) || stamps.sensor == recording.imu_sensor;
    if (is_taken) continue;
    out.push_back({label_of(recording, stamps), Severity::kNote, "unused",
                   std::string("not looked at but for its stamps: no ") +
                       (is_wheels ? "wheels take it" : "filter takes it, or there are several")});
  }
}

void check_rejections(const Recording& recording, Findings& out) {
  for (const auto& [sensor, rejection] : recording.rejections) {
    std::size_t of = 0;
    for (const Stamps& stamps : recording.stamps) {
      if (stamps.sensor == sensor) of += stamps.t_ns.size();
    }
    // Gaps have been told, with more of them.
    if (rejection.reason.find("gap longer than") != std::string::npos) continue;
    const double share =
        static_cast<double>(rejection.count) /
        static_cast<double>(rejection.of > 0 ? rejection.of
                                             : static_cast<std::int64_t>(of) + rejection.count);
    // A row that a power loss has cut short is none of weight; one of a thousand is a fault, and so
    // is damage behind which nothing can be read.
    const bool loses_the_rest = rejection.reason.find("the rest is not read") != std::string::npos;
    const double most = rejection.of > 0 ? 0.5 : 1e-3;  // of what is suspicious when it is most
    const bool is_fault = loses_the_rest || (rejection.count >= 5 && share > most);
    out.push_back({sensor,
                   is_fault ? Severity::kFault : Severity::kNote,
                   "rejected",
                   std::to_string(rejection.count) + " samples are not used: " + rejection.reason +
                       " (first at " + rejection.first + ")",
                   {{"rejected", static_cast<double>(rejection.count), ""}, {"share", share, ""}}});
  }
  for (const auto& [sensor, text] : recording.broken) {
    out.push_back({sensor, Severity::kFault, "readable", "cannot be read to its end: " + text});
  }
  for (const SensorEntry& entry : recording.setup->sensors) {
    const bool gave = std::any_of(recording.stamps.begin(), recording.stamps.end(),
                                  [&](const Stamps& s) { return s.sensor == entry.name; });
    const bool is_known =
        std::any_of(recording.broken.begin(), recording.broken.end(),
                    [&](const auto& broken) { return broken.first == entry.name; });
    const auto yields =
        guarded(entry.sensor.info, "yields", [&] { return entry.sensor.object->yields(); });
    const bool only_truth = yields.size() == 1 && *yields[0] == sample_type<CalibrationSample>();
    if (gave || is_known || only_truth || !entry.input.empty()) continue;
    out.push_back({entry.name, Severity::kFault, "stamps", "gave no samples at all"});
  }
}

/// Of streams, the time that all of them cover, and what bounds it.
struct Overlap {
  std::int64_t begin_ns = INT64_MIN, end_ns = INT64_MAX;
  double shortest_s = INFINITY, longest_s = 0.;
  const Stamps *latest = nullptr, *earliest = nullptr;  ///< begins last, ends first

  void add(const Stamps& stamps) {
    const auto [first, last] = std::minmax_element(stamps.t_ns.begin(), stamps.t_ns.end());
    if (*first > begin_ns) begin_ns = *first, latest = &stamps;
    if (*last < end_ns) end_ns = *last, earliest = &stamps;
    shortest_s = std::min(shortest_s, seconds_between(*first, *last));
    longest_s = std::max(longest_s, seconds_between(*first, *last));
  }
  double common_s() const {
    return latest != nullptr ? std::max(seconds_between(begin_ns, end_ns), 0.) : 0.;
  }
};

/// A reference may cover less than what the estimate is made of.
bool moves_the_estimate(const Stamps& stamps) {
  return *stamps.type == sample_type<ImuSample>() || *stamps.type == sample_type<EncoderSample>() ||
         *stamps.type == sample_type<ImageSample>() || *stamps.type == sample_type<FeatureSample>();
}

/// Of those that are to be used together.
void check_overlap(const Recording& recording, Findings& out) {
  Overlap all, moving;
  for (const Stamps& stamps : recording.stamps) {
    if (stamps.t_ns.size() < kFewestStamps) continue;
    all.add(stamps);
    if (moves_the_estimate(stamps)) moving.add(stamps);
  }
  if (recording.stamps.empty()) return;
  if (all.latest == nullptr) {
    out.push_back({"recording",
                   Severity::kFault,
                   "overlap",
                   "no sensor gives " + std::to_string(kFewestStamps) + " samples: nothing shows",
                   {}});
    return;
  }
  if (recording.stamps.size() < 2) return;
  const std::vector<Figure> figures = {{"in common", all.common_s(), "s"},
                                       {"shortest", all.shortest_s, "s"},
                                       {"longest", all.longest_s, "s"}};
  const auto covers = [&](double part) {
    return all.common_s() >= part * all.shortest_s && moving.common_s() >= part * moving.longest_s;
  };
  const std::string text = significant(all.common_s(), 4) + " s that all sensors cover";
  constexpr double kShort_s = 2.;
  if (all.longest_s < kShort_s) {
    out.push_back({"recording", Severity::kFault, "overlap",
                   "it lasts " + significant(all.longest_s, 3) +
                       " s, in which nothing shows: are its stamps in another unit?",
                   figures});
    return;
  }
  if (covers(0.9)) {
    out.push_back({"recording", Severity::kFits, "overlap", text, figures});
    return;
  }
  const bool is_fault = !covers(0.5);
  // Of what the estimate is made of, where the rest is no worse than it.
  const bool is_moving = moving.common_s() < 0.9 * moving.longest_s;
  const Overlap& bound = is_moving ? moving : all;
  out.push_back({"recording", is_fault ? Severity::kFault : Severity::kNote, "overlap",
                 text + " (the shortest has " + significant(all.shortest_s, 4) +
                     " s, the longest " + significant(all.longest_s, 4) +
                     " s): " + label_of(recording, *bound.latest) + " begins last, " +
                     label_of(recording, *bound.earliest) + " ends first" +
                     (is_fault ? ": are their clocks the same, are they of one recording, and "
                                 "all of it?"
                               : ""),
                 figures});
}

}  // namespace

void check_stamps(const Recording& recording, Findings& out) {
  for (const Stamps& stamps : recording.stamps) check_stream(recording, stamps, out);
  check_unused(recording, out);
  check_rejections(recording, out);
  check_overlap(recording, out);
}

}  // namespace viwo::inspect
