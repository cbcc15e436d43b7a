// The drive channels of a base with two driven sides: one or more on each.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/params.hpp"

namespace viwo::sides {

struct SideParams {
  std::vector<double> left_drives{1.};
  std::vector<double> right_drives{2.};

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(left_drives),
      {.min = 1., .max = kMaxDrives, .help = "drive channels on the left, counted from 1"});
    b(VIWO_PARAM(right_drives),
      {.min = 1., .max = kMaxDrives, .help = "drive channels on the right, counted from 1"});
  }
};

/// A row for each drive channel, left ones first.
class Sides {
 public:
  /// ParamError unless each channel is on one side, and each side has one.
  explicit Sides(const SideParams& params) {
    for (const double number : params.left_drives) add_channel("left_drives", number);
    n_left_ = n_drive();
    for (const double number : params.right_drives) add_channel("right_drives", number);
    std::vector<std::size_t> sorted = channels_;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      if (sorted[i] == i) continue;
      throw ParamError("right_drives",
                       "left_drives and right_drives together must name each channel from 1 to " +
                           std::to_string(sorted.size()) + " once");
    }
    if (n_left_ == 0 || n_left_ == n_drive()) {
      throw ParamError("left_drives", "each side needs at least one drive channel");
    }
  }

  int n_drive() const { return static_cast<int>(channels_.size()); }
  bool is_left(int row) const { return row < n_left_; }
  RowRange left() const { return {0, n_left_}; }
  RowRange right() const { return {n_left_, n_drive() - n_left_}; }
  /// Index of the drive channel of a row.
  std::size_t channel(int row) const { return channels_[static_cast<std::size_t>(row)]; }

  void add_drive_noises(double sigma_drive_rad_per_s, ModelDescription& out) const {
    for (int i = 0; i < n_drive(); ++i) {
      out.noises.push_back({NoiseKind::kDrive,
                            static_cast<int>(channel(i)),
                            sigma_drive_rad_per_s,
                            {i, 1},
                            "sigma_drive_rad_per_s"});
    }
  }

 private:
  void add_channel(const char* key, double number) {
    if (number != std::floor(number)) throw ParamError(key, "channels are whole numbers from 1");
    channels_.push_back(static_cast<std::size_t>(number) - 1);
  }

  std::vector<std::size_t> channels_;
  int n_left_ = 0;
};

}  // namespace viwo::sides
