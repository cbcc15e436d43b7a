#include "viwo/observability/directions.hpp"

#include <cmath>

#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Builds directions of the state; entries that are not estimated are left out.
class Builder {
 public:
  Builder(const ObservabilityMatrix& state, const WheelsView& wheels)
      : state_(state), wheels_(wheels), now_(VectorXd::Zero(state.size())) {}

  void imu(int first, const Vector3d& value) { now_.segment<3>(first) += value; }
  void feature(const Vector3d& value) {
    if (state_.feature_column() >= 0) now_.segment<3>(state_.feature_column()) += value;
  }
  void mount_theta(const Vector3d& value) { extrinsics(0, value); }
  void mount_p(const Vector3d& value) { extrinsics(3, value); }
  void time_offset(double value) { set(wheels_.time_offset_column, value); }
  void intrinsic(int i, double value) {
    if (wheels_.intrinsics_column >= 0) set(wheels_.intrinsics_column + i, value);
  }

  /// Ends a direction; one that needs what is not estimated is none.
  void next() {
    if (whole_ && !now_.isZero(0.)) done_.push_back(now_);
    now_.setZero();
    whole_ = true;
  }

  MatrixXd take() {
    MatrixXd basis(state_.size(), static_cast<Eigen::Index>(done_.size()));
    for (std::size_t k = 0; k < done_.size(); ++k) basis.col(static_cast<int>(k)) = done_[k];
    done_.clear();
    return basis;
  }

 private:
  void extrinsics(int first, const Vector3d& value) {
    for (int i = 0; i < 3; ++i) {
      if (wheels_.extrinsics_column >= 0) {
        set(wheels_.extrinsics_column + first + i, value[i]);
      } else if (value[i] != 0.) {
        whole_ = false;
      }
    }
  }
  void set(int filter_column, double value) {
    if (value == 0.) return;
    const int own = state_.state_column(filter_column);
    if (own < 0) {
      whole_ = false;
      return;
    }
    now_[own] += value;
  }

  const ObservabilityMatrix& state_;
  const WheelsView& wheels_;
  VectorXd now_;
  bool whole_ = true;
  std::vector<VectorXd> done_;
};

/// (OB-5).
MatrixXd global_position_and_yaw(const ObservabilityMatrix& state, Builder& build) {
  const ImuState& imu = state.start();
  for (int i = 0; i < 3; ++i) {
    build.imu(kPositionColumn, Vector3d::Unit(i));
    build.feature(Vector3d::Unit(i));
    build.next();
  }
  const Vector3d up = Vector3d::UnitZ();
  build.imu(kThetaColumn, imu.R_GtoI * up);
  build.imu(kPositionColumn, up.cross(imu.p_IinG));
  build.imu(kVelocityColumn, up.cross(imu.v_IinG));
  build.feature(up.cross(state.p_FinG()));
  build.next();
  return build.take();
}

/// (OB-9): without rotation a tilt of everything looks like an accelerometer bias.
MatrixXd tilt_and_accelerometer_bias(const ObservabilityMatrix& state, double gravity_m_per_s2,
                                     Builder& build) {
  const ImuState& imu = state.start();
  for (int i = 0; i < 2; ++i) {
    const Vector3d axis = Vector3d::Unit(i);
    build.imu(kThetaColumn, imu.R_GtoI * axis);
    build.imu(kPositionColumn, axis.cross(imu.p_IinG));
    build.imu(kVelocityColumn, axis.cross(imu.v_IinG));
    build.imu(kAccelBiasColumn, gravity_m_per_s2 * (imu.R_GtoI * axis.cross(Vector3d::UnitZ())));
    build.feature(axis.cross(state.p_FinG()));
    build.next();
  }
  return build.take();
}

/// (OB-6), the intrinsics by central differences: move_frame() is the model's.
MatrixXd placement_of_O(const WheelsView& wheels, Builder& build) {
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 3; ++k) {
    Intrinsics plus = wheels.x_WI, minus = wheels.x_WI;
    const Vector3d step = kStep * Vector3d::Unit(k);
    if (wheels.model->move_frame(step, plus) != Status::kOk ||
        wheels.model->move_frame(-step, minus) != Status::kOk) {
      return {};
    }
    const Intrinsics change = (plus - minus) / (2. * kStep);
    for (int i = 0; i < change.size(); ++i) {
      // A held entry that would move: not a direction of this state. Rounding is none.
      build.intrinsic(i, std::abs(change[i]) > 1e-9 ? change[i] : 0.);
    }
    if (k == 0) {
      build.mount_theta(Vector3d::UnitZ());
      build.mount_p(wheels.p_IinO.cross(Vector3d::UnitZ()));
    } else {
      build.mount_p(-Vector3d::Unit(k - 1));
    }
    build.next();
  }
  return build.take();
}

/// Where the intrinsics of wheels that steer stand in x_WI; empty for other bases.
struct SteeredWheel {
  int r, x, y, delta_o;
};

std::vector<SteeredWheel> steered_wheels(const WheelModel& model) {
  std::vector<SteeredWheel> wheels;
  for (int j = 1; j <= model.description().n_steer; ++j) {
    const std::string n = std::to_string(j);
    const SteeredWheel wheel{model.find("r_" + n), model.find("x_" + n), model.find("y_" + n),
                             model.find("delta_o" + n)};
    if (wheel.r < 0 || wheel.x < 0 || wheel.y < 0 || wheel.delta_o < 0) return {};
    wheels.push_back(wheel);
  }
  return wheels;
}

/// (OB-7): two directions for each wheel, at one instant of a motion with constant steering.
MatrixXd constant_steering(const std::vector<SteeredWheel>& steered, const WheelsView& wheels,
                           const WheelModel& model, const EncoderSample& sample, Builder& build) {
  TwistSolver solver(std::make_shared<const WheelModel>(model), {});
  solver.set_intrinsics(wheels.x_WI);
  TwistSolution solution;
  if (solver.solve(sample, solution) != Status::kOk) return {};
  const double omega = solution.xi.z();
  if (std::abs(omega) < 1e-6) return {};
  for (std::size_t j = 0; j < steered.size(); ++j) {
    const SteeredWheel& wheel = steered[j];
    const double rate = sample.drive_rad_per_s[j];
    const double delta = sample.steer_rad[j] - wheels.x_WI[wheel.delta_o];
    const double lambda = rate * wheels.x_WI[wheel.r] / omega, eta = rate / omega;
    const double c = std::cos(delta), s = std::sin(delta);
    if (std::abs(lambda) < 1e-6) {  // on the centre of rotation: it does not roll
      build.intrinsic(wheel.r, 1.);
      build.next();
      build.intrinsic(wheel.delta_o, 1.);
      build.next();
      continue;
    }
    build.intrinsic(wheel.x, 1.);
    build.intrinsic(wheel.r, s / eta);
    build.intrinsic(wheel.delta_o, -c / lambda);
    build.next();
    build.intrinsic(wheel.y, 1.);
    build.intrinsic(wheel.r, -c / eta);
    build.intrinsic(wheel.delta_o, -s / lambda);
    build.next();
  }
  return build.take();
}

/// Each of the intrinsics that `of` names for a wheel, alone.
template <class... Of>
MatrixXd single(const std::vector<SteeredWheel>& wheels, Builder& build, Of... of) {
  for (const SteeredWheel& wheel : wheels) {
    ((build.intrinsic(wheel.*of, 1.), build.next()), ...);
  }
  return build.take();
}

/// (OB-8): a tilt of the mount, with the shift of its lever arm that hides it.
MatrixXd tilt_of_the_mount(const WheelsView& wheels, Builder& build) {
  for (int i = 0; i < 2; ++i) {
    const Vector3d c = Vector3d::Unit(i);
    const Vector3d shift = wheels.p_IinO.cross(c);
    build.mount_theta(c);
    build.mount_p({shift.x(), shift.y(), 0.});
    build.next();
  }
  return build.take();
}

auto adding_to(std::vector<NamedDirections>& all) {
  return [&all](const std::string& name, const std::string& when, MatrixXd basis) {
    if (basis.cols() > 0) all.push_back({name, std::move(basis), when});
  };
}

}  // namespace

std::vector<NamedDirections> directions_of_the_robot(const ObservabilityMatrix& state,
                                                     double gravity_m_per_s2) {
  const WheelsView none;
  Builder build(state, none);
  std::vector<NamedDirections> all;
  const auto add = adding_to(all);
  add("global position and yaw", "always", global_position_and_yaw(state, build));
  add("tilt and accelerometer bias", "no rotation",
      tilt_and_accelerometer_bias(state, gravity_m_per_s2, build));
  build.feature(state.p_FinG() - state.start().p_IinG);
  build.next();
  add("distance of the feature", "no motion", build.take());
  return all;
}

std::vector<NamedDirections> directions_of_wheels(const ObservabilityMatrix& state,
                                                  const WheelsView& wheels, const WheelModel& model,
                                                  const EncoderSample& sample) {
  Builder build(state, wheels);
  std::vector<NamedDirections> all;
  const auto add = adding_to(all);
  add("placement of O", "always", placement_of_O(wheels, build));
  for (int i = 0; i < 3; ++i) {
    build.mount_theta(Vector3d::Unit(i));
    build.next();
    build.mount_p(Vector3d::Unit(i));
    build.next();
  }
  build.time_offset(1.);
  build.next();
  for (int i = 0; i < wheels.x_WI.size(); ++i) {
    build.intrinsic(i, 1.);
    build.next();
  }
  add("all of the calibration", "no motion", build.take());
  const std::vector<SteeredWheel> steered = steered_wheels(model);
  add("wheel positions", "no yaw rate", single(steered, build, &SteeredWheel::x, &SteeredWheel::y));
  add("steering offsets", "drive rows alone", single(steered, build, &SteeredWheel::delta_o));
  add("constant steering", "steering angles constant",
      constant_steering(steered, wheels, model, sample, build));
  for (std::size_t j = 0; j < steered.size(); ++j) {
    add("wheel " + std::to_string(j + 1), "it does not roll",
        single({steered[j]}, build, &SteeredWheel::r, &SteeredWheel::delta_o));
  }
  for (int i = 0; steered.empty() && i < wheels.x_WI.size(); ++i) {
    build.intrinsic(i, 1.);
    build.next();
    add(model.description().intrinsics[static_cast<std::size_t>(i)].name, "it has no effect",
        build.take());
  }
  for (int i = 0; i < 3; ++i) {
    build.mount_p(Vector3d::Unit(i));
    build.next();
  }
  add("p_IinO", "pure translation", build.take());
  build.mount_p(Vector3d::UnitZ());
  build.next();
  add("p_IinO along the axis", "rotation about one axis", build.take());
  add("tilt of the mount", "rotation about one axis", tilt_of_the_mount(wheels, build));
  build.time_offset(1.);
  build.next();
  add("t_OtoI", "constant local velocity and rate", build.take());
  return all;
}

}  // namespace viwo
