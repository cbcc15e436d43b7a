#include "yaw_order_check.hpp"

#include <limits>
#include <utility>

namespace viwo {

YawOrderCheck::YawOrderCheck(SensorName wheels, const std::shared_ptr<const WheelModel>& model,
                             const Intrinsics& x_WI)
    : wheels_(std::move(wheels)), solver_(model, {}), changes_(changes_by_gyro(model, x_WI)) {
  solver_.set_intrinsics(x_WI);
  // Models with more have rows that contradict each other.
  if (changes_.size() > kMost) changes_.resize(kMost);
  undone_.resize(changes_.size());
}

YawOrderCheck::Rates YawOrderCheck::rates(const EncoderSample& sample, double as_it_is) {
  Rates rates = Rates::Zero();
  rates[0] = as_it_is;
  for (std::size_t i = 1; i < changes_.size(); ++i) {
    EncoderSample changed = sample;
    changes_[i].undo(changed);
    const bool is_told =
        solver_.solve(changed, solution_) == Status::kOk && !solution_.rank_deficient;
    rates[static_cast<Eigen::Index>(i)] =
        is_told ? solution_.xi[2] : std::numeric_limits<double>::quiet_NaN();
  }
  return rates;
}

void YawOrderCheck::add(double gyro_rad_per_s, const Rates& wheels_rad_per_s) {
  if (!wheels_rad_per_s.allFinite()) return;
  for (std::size_t i = 0; i < undone_.size(); ++i) {
    undone_[i].add(gyro_rad_per_s, wheels_rad_per_s[static_cast<Eigen::Index>(i)]);
  }
  opposite_.add(gyro_rad_per_s, -wheels_rad_per_s[0]);
}

bool YawOrderCheck::findings(Findings& out) const {
  constexpr int kFewest = 400;  // 8 s
  if (opposite_.count() < kFewest) return false;
  const std::size_t best = clear_change(undone_, opposite_);
  if (best == 0) return false;
  out.push_back({wheels_.text + " yaw order",
                 wheels_.text + ": " + text_of(changes_[best], undone_.front(), undone_[best]),
                 false, changes_[best].remedies(wheels_.sensor, solver_.model().description())});
  return true;
}

}  // namespace viwo
