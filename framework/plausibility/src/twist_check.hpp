// Whether IMU and wheels move alike: the gyro's rate about the base's z and the twist of the
// wheels, the accelerometer and its change.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sensor_name.hpp"
#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/rig.hpp"
#include "viwo/plausibility/finding.hpp"
#include "viwo/plausibility/slip.hpp"
#include "yaw_order_check.hpp"

namespace viwo {

/// Means over the cells of a grid in time of what holds over times of its own; the last seconds.
template <int kSize>
class CellMeans {
 public:
  using Vector = Eigen::Matrix<double, kSize, 1>;
  static constexpr std::int64_t kCellNs = 20'000'000;
  static constexpr std::int64_t kCells = 256;

  /// What is longer than this is a gap.
  static constexpr std::int64_t kLongestNs = 200'000'000;

  void add(std::int64_t begin_ns, std::int64_t end_ns, const Vector& value);
  /// The cell up to which nothing is to come any more.
  std::int64_t end() const { return end_; }
  std::optional<Vector> mean(std::int64_t cell) const;

 private:
  struct Cell {
    std::int64_t index = -1;
    std::int64_t covered_ns = 0;
    Vector sum = Vector::Zero();
  };
  std::array<Cell, kCells> cells_;
  std::int64_t end_ = 0;
};

/// What gives the rate that the wheels are compared with.
enum class Gyro {
  kMounted,  ///< an IMU whose mounting is configured
  kLevel,    ///< an IMU of which only gravity says how it is mounted
  kHeading,  ///< a gyro that integrates for itself
};

class TwistCheck {
 public:
  TwistCheck(const SensorName& imu, const SensorName& wheels,
             const std::shared_ptr<const WheelModel>& model, const WheelsPrior& prior, Gyro gyro);

  void add_imu(const ImuSample& sample);
  void add_heading(const HeadingSample& sample);
  /// `xi`: twist of O over the time of the sample; `rate_by_prior`: by what each unit of the prior
  /// of the intrinsics changes its yaw rate.
  void add_wheels(const EncoderSample& sample, const Twist& xi, const Intrinsics& rate_by_prior);
  /// Nothing more is to come.
  void finish() { look_at_turns(); }
  /// Whether the gyro says that channels are reversed or exchanged, of wheels that cannot say it of
  /// each other.
  bool finds_order(Findings& out) const { return order_.findings(out); }
  /// `up`: direction of the specific force in I (ImuCheck). `zero_ns`: when texts have t = 0.
  void findings(const Eigen::Vector3d& up, std::int64_t zero_ns, Findings& out) const;

 private:
  static constexpr int kMostLag = 25;  ///< cells
  static constexpr int kLags = 2 * kMostLag + 1;
  static constexpr int kWindow = 10;               ///< cells
  static constexpr std::size_t kMostTurns = 7200;  ///< of an hour

  // What moves in a window, along the axes of O, m/s^2 but for the first two, rad/s: rates about z
  // of gyro and wheels, specific force, change of the wheels' velocity, and what it takes to turn
  // that velocity.
  enum Entry { kGyro, kWheels, kForce, kChange = 4, kTurn = 6, kEntries = 8 };
  using Entries = Eigen::Matrix<double, kEntries, 1>;

  /// Sums of one window.
  struct Window {
    int cells = 0;
    Entries mean = Entries::Zero();
    Eigen::Vector2d v = Eigen::Vector2d::Zero();
  };

  static constexpr double kLeastForce = 0.1;  // m/s^2, standard deviation about the mean

  void advance();
  void look_at_turns();
  void begin_anew();
  bool accelerates_as_wheels(const Eigen::MatrixXd& C) const;
  bool find_factor(double slope, double r, const Eigen::MatrixXd& C, Findings& out) const;
  bool finds_slip(std::int64_t zero_ns, Findings& out) const;
  bool finds_disagreement(Findings& out) const;
  std::string opposite() const;
  void add_cell(const Eigen::Matrix<double, 6, 1>& imu, const Twist& xi);
  void add_to_lags(double gyro, const Twist& xi);
  void add_to_turns(double gyro, const Twist& xi);
  void end_window();
  double factor_tolerance() const;
  Remedy drives_times(double scale) const;
  Remedy turned_by(const Eigen::Matrix3d& R) const;
  bool finds_gravity(const Eigen::Vector3d& up, double slope, Findings& out) const;
  static Eigen::Matrix4d of_forces(const Eigen::MatrixXd& C);
  void find_turned(const Eigen::MatrixXd& C, Findings& out) const;
  void find_reversed(const Eigen::MatrixXd& C, Findings& out) const;
  void find_axes(const Eigen::MatrixXd& C, Findings& out) const;
  std::array<double, kLags> left_by_lag(const Eigen::Vector4d& information) const;
  bool find_lag(double rate_variance, Findings& out) const;

  std::string imu_, wheels_;
  std::string gyro_unit_, drive_scale_;  ///< keys of the configuration
  Gyro gyro_is_;
  int n_drive_, n_steer_;
  bool is_redundant_;  ///< the wheels can contradict each other
  Eigen::Matrix3d R_ItoO_;
  Eigen::Vector2d p_IinO_;
  double t_OtoI_s_, sigma_t_OtoI_s_;

  YawOrderCheck order_;
  CellMeans<6> imu_means_;
  /// Twist, and the yaw rates that order_ wants.
  CellMeans<3 + YawOrderCheck::kMost> twist_means_;
  std::optional<ImuSample> last_;
  std::optional<HeadingSample> last_heading_;
  std::int64_t next_ = 0;  ///< cell

  double rate_squares_ = 0.;   ///< of the wheels, sum over samples
  Intrinsics rate_products_;   ///< likewise, of the rate with what a prior sigma changes it by
  double prior_squares_ = 0.;  ///< likewise, of what all of the prior changes it by
  std::int64_t rates_ = 0;     ///< samples

  Window window_, before_;
  std::int64_t windows_ = 0;
  TurnWindow turn_;
  int turn_cells_ = 0;
  std::vector<TurnWindow> turns_;  ///< the last ones
  std::optional<Slip> slip_;       ///< of them, as of a multiple of ten seconds or the end
  std::optional<Disagreement> disagreement_;  ///< likewise
  Entries sum_ = Entries::Zero();
  Eigen::Matrix<double, kEntries, kEntries> products_ =
      Eigen::Matrix<double, kEntries, kEntries>::Zero();

  // Gyro minus wheels by lag, and what a bias and wheels that are not as configured make of it:
  // a part of the turn and of the velocity that they tell.
  struct Lag {
    Eigen::Vector4d products = Eigen::Vector4d::Zero();  ///< of the difference with [1, twist]
    double squares = 0.;
  };
  std::array<double, kLags> gyro_{};  ///< of the last cells, in turn
  std::array<Twist, kLags> wheel_;    ///< likewise
  std::int64_t lag_cells_ = 0;        ///< without a break
  std::int64_t lag_count_ = 0;
  std::array<Lag, kLags> lags_;
  Eigen::Matrix4d lag_products_ = Eigen::Matrix4d::Zero();  ///< of [1, twist] with itself
};

}  // namespace viwo
