// Watches what the recent motion tells about a group of blocks: says so, warns in words when it
// tells nothing, and names the directions that are better left alone. Equations:
// docs/math/filter.md.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "viwo/estimator/information_window.hpp"
#include "viwo/estimator/motion_window.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {

struct MonitorOptions {
  bool enabled = true;
  double window_s = 5.;  ///< how far back it looks
  double period_s = 0.5;
  /// A direction with less information than this, in units of that of the prior, is not excited.
  double min_information = 1.;
  /// Directions that are not excited get no correction and keep their variance, from the end of the
  /// first period on.
  bool hold = false;
};

/// A motion from which something cannot be learned.
struct ExcitationWarning {
  std::int64_t t_ns = 0;
  std::string text;                     ///< "no yaw rate for 5 s: ... - turn"
  std::vector<std::string> parameters;  ///< what cannot be learned
};

/// "x_2, x_3, x_4, y_2" becomes "x_2..x_4, y_2".
std::string compressed(std::span<const std::string> names);

/// One per group. Allocates in the constructor and for a warning.
class ExcitationMonitor {
 public:
  /// std::invalid_argument for times that are not positive, more than a thousand periods in the
  /// window, or a group without a mount.
  ExcitationMonitor(const MonitorOptions& options, const StateBlocks& blocks,
                    const BlockGroup& group);

  /// Before a factor is applied to `filter`, and after it was.
  template <class Factor>
  void before(const Filter& filter, const Factor& factor) {
    measured_ = measure(filter, factor);
  }
  void applied() {
    if (measured_) information_.add();
  }

  /// At the end of an epoch; `imu` are its samples. True when period_s have gone: everything below
  /// is new, of as much of the window as there is.
  bool epoch(const Filter& filter, std::span<const ImuSample> imu);

  /// Whether it is new since the last epoch, and of a full window.
  bool has_news() const { return has_news_; }
  /// The parameters that are estimated.
  std::span<const std::string> parameters() const { return names_; }
  /// The sigma that the window alone would leave of each prior sigma (1: nothing was learned).
  /// Empty before the first period is over.
  std::span<const double> sigma_ratio() const { return sigma_ratio_; }
  /// How many directions are not excited; 0 before the first period is over.
  int unexcited() const { return unexcited_; }
  /// Holds them.
  void hold(HeldDirections& held) const;
  /// Each kind of motion at most once.
  std::span<const ExcitationWarning> warnings() const { return warnings_; }
  const InformationWindow& information() const { return information_; }

 private:
  bool measure(const Filter& filter, const ResidualFactor& factor) {
    return information_.measure(factor, filter.covariance());
  }
  bool measure(const Filter& /*filter*/, const InformationFactor& factor) {
    return information_.measure(factor);
  }
  void add_motion(const Filter& filter, std::span<const ImuSample> imu);
  void evaluate();
  double unexcited_part(Eigen::Index parameter) const;
  void warn(std::int64_t t_ns);
  void warn(std::int64_t t_ns, Degeneracy kind);

  MonitorOptions options_;
  InformationWindow information_;
  MotionWindow motion_;
  std::vector<std::string> names_;
  std::vector<Excitation> needs_;
  BlockId mount_;
  std::size_t n_bins_;
  std::size_t bins_done_ = 0;
  std::optional<std::int64_t> bin_begin_ns_;
  bool measured_ = false;
  bool has_news_ = false;
  std::vector<double> sigma_ratio_;
  int unexcited_ = 0;
  std::array<bool, kDegeneracies> warned_{};
  std::vector<ExcitationWarning> warnings_;
};

}  // namespace viwo
