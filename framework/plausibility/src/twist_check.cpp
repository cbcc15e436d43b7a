#include "twist_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "viwo/math/arrays.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/heading_rate.hpp"

namespace viwo {

template <int kSize>
void CellMeans<kSize>::add(std::int64_t begin_ns, std::int64_t end_ns, const Vector& value) {
  if (end_ns <= begin_ns) return;
  if (end_ns - begin_ns > kLongestNs) return;
  end_ = std::max(end_, end_ns / kCellNs);
  for (std::int64_t i = begin_ns / kCellNs; i * kCellNs < end_ns; ++i) {
    Cell& cell = cells_[static_cast<std::size_t>(i % kCells)];
    if (cell.index > i) continue;  // long gone
    if (cell.index != i) cell = {i, 0, Vector::Zero()};
    const std::int64_t part_ns =
        std::min(end_ns, (i + 1) * kCellNs) - std::max(begin_ns, i * kCellNs);
    cell.covered_ns += part_ns;
    cell.sum += static_cast<double>(part_ns) * value;
  }
}

template <int kSize>
auto CellMeans<kSize>::mean(std::int64_t cell) const -> std::optional<Vector> {
  const Cell& found = cells_[static_cast<std::size_t>(cell % kCells)];
  if (found.index != cell || 10 * found.covered_ns < 9 * kCellNs) return {};
  return found.sum / static_cast<double>(found.covered_ns);
}

TwistCheck::TwistCheck(const SensorName& imu, const SensorName& wheels,
                       const std::shared_ptr<const WheelModel>& model, const WheelsPrior& prior,
                       Gyro gyro)
    : imu_(imu.text),
      wheels_(wheels.text),
      gyro_unit_(imu.key(gyro == Gyro::kHeading ? "yaw_unit" : "gyro_unit")),
      drive_scale_(wheels.key("drive_scale")),
      gyro_is_(gyro),
      n_drive_(model->description().n_drive),
      n_steer_(model->description().n_steer),
      is_redundant_(model->n_rows() > 3),
      R_ItoO_(prior.wheels.R_ItoO),
      p_IinO_(prior.wheels.p_IinO.head<2>()),
      t_OtoI_s_(prior.wheels.t_OtoI_s),
      sigma_t_OtoI_s_(prior.sigma_time_offset_s),
      order_(wheels, model, prior.wheels.x_WI) {}

void TwistCheck::add_imu(const ImuSample& sample) {
  if (sample.fault() != nullptr || sample.t_ns < 0) return;
  const auto values = [this](const ImuSample& s) {
    Eigen::Matrix<double, 6, 1> v;
    v << R_ItoO_ * to_vector(s.gyro_rad_per_s), R_ItoO_ * to_vector(s.accel_m_per_s2);
    return v;
  };
  // Behind a gap, or a step back, the clock may be another one.
  if (last_ && std::abs(sample.t_ns - last_->t_ns) > CellMeans<6>::kLongestNs) begin_anew();
  if (last_) {
    imu_means_.add(last_->t_ns, sample.t_ns, 0.5 * (values(*last_) + values(sample)));
  }
  last_ = sample;
  advance();
}

void TwistCheck::look_at_turns() {
  slip_ = find_slip(turns_);
  disagreement_ = find_disagreement(turns_, factor_tolerance());
}

void TwistCheck::begin_anew() {
  lag_cells_ = lag_count_ = 0;
  lags_.fill({});
  lag_products_.setZero();
  turn_cells_ = 0;
  turns_.clear();
  slip_.reset();
  disagreement_.reset();
}

/// As the rate of a gyro without an accelerometer.
void TwistCheck::add_heading(const HeadingSample& sample) {
  if (sample.fault() != nullptr || sample.t_ns < 0) return;
  if (last_heading_) {
    const std::int64_t spacing_ns = sample.t_ns - last_heading_->t_ns;
    if (std::abs(spacing_ns) > CellMeans<6>::kLongestNs) begin_anew();
    if (const auto rate = yaw_rate_between(*last_heading_, sample)) {
      Eigen::Matrix<double, 6, 1> v = Eigen::Matrix<double, 6, 1>::Zero();
      v[2] = *rate;
      imu_means_.add(last_heading_->t_ns, sample.t_ns, v);
    }
  }
  last_heading_ = sample;
  advance();
}

void TwistCheck::add_wheels(const EncoderSample& sample, const Twist& xi,
                            const Intrinsics& rate_by_prior) {
  const auto offset_ns = to_ns(t_OtoI_s_);
  if (sample.begin_ns + offset_ns < 0 || !xi.allFinite()) return;
  rate_squares_ += xi[2] * xi[2];
  if (rate_products_.size() == 0) rate_products_.setZero(rate_by_prior.size());
  rate_products_ += xi[2] * rate_by_prior;
  prior_squares_ += rate_by_prior.squaredNorm();
  ++rates_;
  if (!last_ && !last_heading_) return;  // nothing to be compared with, perhaps ever
  Eigen::Matrix<double, 3 + YawOrderCheck::kMost, 1> values;
  values << xi, order_.rates(sample, xi[2]);
  twist_means_.add(sample.begin_ns + offset_ns, sample.end_ns + offset_ns, values);
  advance();
}

/// Takes the cells that both have passed.
void TwistCheck::advance() {
  const std::int64_t end = std::min(imu_means_.end(), twist_means_.end());
  next_ = std::max(next_, end - CellMeans<6>::kCells);
  for (; next_ < end; ++next_) {
    const auto imu = imu_means_.mean(next_);
    const auto wheels = twist_means_.mean(next_);
    if (imu && wheels) {
      add_cell(*imu, wheels->head<3>());
      order_.add((*imu)[2], wheels->tail<YawOrderCheck::kMost>());
    } else {
      window_ = before_ = {};
      lag_cells_ = 0;
      turn_cells_ = 0;
    }
  }
}

void TwistCheck::add_cell(const Eigen::Matrix<double, 6, 1>& imu, const Twist& xi) {
  add_to_lags(imu[2], xi);
  add_to_turns(imu[2], xi);
  // Of the IMU's place.
  const Eigen::Vector2d v(xi[0] - xi[2] * p_IinO_.y(), xi[1] + xi[2] * p_IinO_.x());
  Entries entries = Entries::Zero();
  entries[kGyro] = imu[2];
  entries[kWheels] = xi[2];
  entries.segment<2>(kForce) = imu.segment<2>(3);
  entries.segment<2>(kTurn) << -xi[2] * v.y(), xi[2] * v.x();
  window_.mean += entries / kWindow;
  window_.v += v / kWindow;
  if (++window_.cells == kWindow) end_window();
}

/// Means of this window and the last one go with the change of velocity between them.
void TwistCheck::end_window() {
  if (before_.cells == kWindow) {
    Entries entries = 0.5 * (before_.mean + window_.mean);
    constexpr double kWindow_s = 1e-9 * kWindow * CellMeans<6>::kCellNs;
    entries.segment<2>(kChange) = (window_.v - before_.v) / kWindow_s;
    sum_ += entries;
    products_ += entries * entries.transpose();
    ++windows_;
  }
  before_ = std::exchange(window_, {});
}

void TwistCheck::add_to_turns(double gyro, const Twist& xi) {
  constexpr auto kWindowCells =
      static_cast<std::int64_t>(1e9 * kTurnWindow_s) / CellMeans<6>::kCellNs;
  if (turn_cells_ == 0) turn_ = {next_ * CellMeans<6>::kCellNs};
  turn_ += {0, gyro, xi[2], xi.head<2>().norm()};
  if (++turn_cells_ < kWindowCells) return;
  turn_ /= static_cast<double>(std::exchange(turn_cells_, 0));
  turns_.reserve(kMostTurns);  // once
  if (turns_.size() == kMostTurns) turns_.erase(turns_.begin(), turns_.begin() + kMostTurns / 2);
  turns_.push_back(turn_);
  constexpr std::size_t kLookedAfter = 20;
  if (turns_.size() % kLookedAfter == 0) look_at_turns();
}

/// Differences of the gyro's rates, half a second before to after it, and one of the wheels.
void TwistCheck::add_to_lags(double gyro, const Twist& xi) {
  const auto place = [](std::int64_t cell) { return static_cast<std::size_t>(cell % kLags); };
  gyro_[place(lag_cells_)] = gyro;
  wheel_[place(lag_cells_)] = xi;
  ++lag_cells_;
  if (lag_cells_ < kLags) return;
  const std::int64_t middle = lag_cells_ - 1 - kMostLag;
  const Twist& w = wheel_[place(middle)];
  const Eigen::Vector4d by(1., w[0], w[1], w[2]);
  lag_products_ += by * by.transpose();
  for (int i = 0; i < kLags; ++i) {
    const double difference = gyro_[place(middle + i - kMostLag)] - w[2];
    Lag& lag = lags_[static_cast<std::size_t>(i)];
    lag.products += difference * by;
    lag.squares += difference * difference;
  }
  ++lag_count_;
}

}  // namespace viwo
