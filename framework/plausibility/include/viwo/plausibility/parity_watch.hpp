// How much the wheels of a base contradict each other, whatever their noises are.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "viwo/api/measurement.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

struct Parity {
  double rms = 0.;              ///< of a row, m/s; NaN where no sample gives a twist
  double drive_rad_per_s = 0.;  ///< rms
  double speed = 0.;            ///< of what the drives say, rms, m/s
  double refused = 0.;          ///< part of the samples
  /// A fifth of what moves, of a base that drives.
  bool is_gross() const;
};

/// Sums it up over the samples of a base, and by their means over pieces of half a second in which
/// it drives: of those neither the noise of a sample nor the steps of a counter are part.
class ParityWatch {
 public:
  explicit ParityWatch(std::shared_ptr<const WheelModel> model);

  /// `solution` of the sample at these intrinsics; null: the solver refuses it. Whether a piece of
  /// gross contradictions has ended before it.
  bool add(const EncoderSample& sample, const Intrinsics& x_WI, const TwistSolution* solution);

  Parity total() const { return parity_of(total_); }
  /// Of the pieces of gross contradictions.
  Parity gross() const { return parity_of(gross_); }
  /// Seconds in which it drives, and those of them in which the contradiction is gross; of the last
  /// piece there is nothing yet.
  double driven_s() const { return driven_s_; }
  double gross_s() const { return gross_s_; }
  /// When that began, of the samples; 0 for never.
  std::int64_t first_gross_ns() const { return first_gross_ns_; }

 private:
  struct Sums {
    double squares = 0., speeds = 0., rates = 0., solved = 0., refused = 0.;
    void operator+=(const Sums& other);
  };
  /// Of the samples of a piece.
  struct Means {
    RowVector e, e_squares, b;
    std::array<double, kMaxDrives> rates{};
    Sums sums;
    void reset(int n_rows);
  };
  Parity parity_of(const Sums& sums) const;
  /// What remains where the samples of the piece are taken for one.
  Sums mean_of_piece() const;
  bool end_piece(std::int64_t end_ns);

  std::shared_ptr<const WheelModel> model_;
  RowSystem rows_;
  Sums total_, gross_;
  Means piece_;
  std::int64_t piece_ns_ = 0, first_gross_ns_ = 0;  ///< beginnings
  double driven_s_ = 0., gross_s_ = 0.;
};

}  // namespace viwo
