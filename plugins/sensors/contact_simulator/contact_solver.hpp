// How a base whose servos hold what they are told must slip to move as it does (model.md).
#pragma once

#include <array>
#include <vector>

#include "physics.hpp"

namespace viwo::contact {

/// One wheel at one instant.
struct WheelState {
  double load_n = 0.;
  double radius_m = 0.;              ///< rolling radius under that load
  double angle_rad = 0.;             ///< where it points in O
  double rate_rad_per_s = 0.;        ///< how fast it turns about its axle
  Eigen::Vector2d place_m;           ///< contact in O
  Eigen::Vector2d velocity_m_per_s;  ///< of the contact, if it were fixed to what carries the wheel
  Eigen::Vector2d force_n;           ///< of the ground on the base in its plane, in O
};

/// A base at one instant.
struct ContactState {
  std::array<WheelState, kMaxWheels> wheels;
  std::array<double, kMaxSteers> steer_rad{};  ///< what the steering encoders stand at
  Twist xi = Twist::Zero();                    ///< as it moves, sideways velocity included
  Twist commanded = Twist::Zero();             ///< as its wheels would move it without slip
};

/// Goes through a motion step by step. No allocation after construction.
class ContactSolver {
 public:
  /// `controller`: the base as those who command the wheels know it; not asked when nothing slips.
  /// ParamError when wheels cannot point where they must, but nothing slips.
  ContactSolver(Base truth, Base controller, const Physics& physics);

  const Base& base() const { return truth_; }
  /// Rolling radius of each wheel under its static load.
  const std::vector<double>& static_radius_m() const { return static_radius_m_; }

  /// Wheels stand in the direction of a twist, in the middle of their play.
  void stand(const Twist& toward);

  /// The base `dt_s` later. False when no slip gives the forces that the motion needs (it needs
  /// more friction than there is), or when a base that does not slip would have to.
  bool step(const Demand& demand, double dt_s, ContactState& out);

 private:
  struct Steer {
    double commanded_rad = 0.;  ///< direction that the controller wants
    double encoder_rad = 0.;    ///< reading
    double wheel_rad = 0.;      ///< direction behind the play
  };
  using Steers = std::array<Steer, kMaxSteers>;

  Twist commanded_twist(const Demand& demand, const Eigen::Vector3d& slip) const;
  Twist actual_twist(const Demand& demand, const Eigen::Vector3d& slip) const;
  double reached(double dt_s) const;
  Steer turn(std::size_t channel, const Twist& commanded, double dt_s) const;
  double commanded_rate(std::size_t wheel, const Twist& commanded, const Steers& steers) const;
  Eigen::Vector2d tyre_force(const Wheel& wheel, WheelState& state) const;
  Eigen::Vector3d evaluate(const Demand& demand, const Eigen::Vector3d& slip, double dt_s,
                           Steers& steers, ContactState& out) const;
  bool find_slip(const Demand& demand, double dt_s, Steers& steers, ContactState& out);
  bool roll(const Demand& demand, double dt_s, Steers& steers, ContactState& out) const;
  void place(const Wheel& wheel, const Twist& xi, const Steers& steers, double dt_s,
             WheelState& state) const;

  Base truth_, controller_;
  Physics physics_;
  std::vector<double> static_radius_m_, controller_radius_m_;
  double reference_load_n_ = 0.;
  double size_m_ = 0.;  ///< rms distance of the wheels from O
  Steers steers_;
  Eigen::Vector3d slip_ = Eigen::Vector3d::Zero();  ///< of the last step: starts the next
};

}  // namespace viwo::contact
