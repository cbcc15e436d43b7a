// Sensor contact_simulator: a base on tyres that slip, with IMU, cameras, encoders and the truth
// (model.md).
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "contact_params.hpp"
#include "contact_solver.hpp"
#include "encoders.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/sim/encoder_simulator.hpp"

namespace viwo {
namespace {

using contact::Base;
using contact::ContactSolver;
using contact::ContactState;
using contact::Params;

/// How often a trajectory is driven anew with the sideways velocity that was found on it.
constexpr int kPasses = 3;
constexpr double kStep = 0.01;  // s, of the sideways velocity

/// Everything that the configuration says about the base and its tyres.
struct Vehicle {
  Base truth, controller;
  contact::Physics physics;
  contact::EncoderErrors errors;
};

Vehicle vehicle_from(const Params& params, const HostServices& services) {
  const bool ideal = params.ideal || services.exact;
  const Base nominal = contact::base_from(params);
  const contact::TrueBaseErrors sigma{params.sigma_true_radius_m, params.sigma_true_position_m,
                                      params.sigma_true_steer_offset_rad};
  Vehicle out;
  out.truth = services.exact ? nominal : draw_base(nominal, sigma, services.seed);
  const bool knows = services.exact || params.controller_knows == "truth";
  out.controller = knows ? out.truth : nominal;
  out.physics = contact::physics_from(params, ideal);
  out.errors = contact::encoder_errors_from(params, ideal, params.noise && !services.exact);
  if (!out.physics.slips() && !knows) {
    throw ParamError("controller_knows", "a base whose controller is wrong must slip");
  }
  return out;
}

[[noreturn]] void cannot_follow(const Vehicle& vehicle, double t_s) {
  throw ParamError("motion",
                   "after " + std::to_string(t_s) + " s base " + vehicle.truth.name +
                       (vehicle.physics.slips() ? " would need more friction than there is"
                                                : " would have to slip (slip_per_load: 0)"));
}

/// Goes along a trajectory at equal steps from `begin_s`, and hands over each state.
template <class Take>
void follow(const sim::BodyTrajectory& trajectory, const Vehicle& vehicle, ContactSolver& solver,
            double begin_s, double end_s, double step_s, const Take& take) {
  // Wheels stand in the direction of the motion when it starts.
  solver.stand(trajectory.twist(std::max(begin_s, 0.) + 0.05));
  ContactState state;
  for (std::int64_t k = 0;; ++k) {
    const double t_s = begin_s + static_cast<double>(k) * step_s;
    if (t_s > end_s) return;
    const auto demand = contact::demand_of(trajectory.body(t_s), vehicle.physics);
    if (!solver.step(demand, step_s, state)) cannot_follow(vehicle, t_s);
    take(k, state);
  }
}

/// A base that cannot be told to move sideways does so by its tyres: the trajectory follows
/// (CP-10).
sim::BodyTrajectory drive(const Params& params, const Vehicle& vehicle, double end_s) {
  const double margin_s = std::abs(params.t_OtoI_s);
  sim::BodyTrajectory trajectory = sim::drive_from(params, end_s, margin_s);
  if (vehicle.truth.moves_sideways) return trajectory;
  ContactSolver solver(vehicle.truth, vehicle.controller, vehicle.physics);
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<double> v_y;
    const double begin_s = trajectory.begin_s();
    follow(trajectory, vehicle, solver, begin_s, trajectory.end_s(), kStep,
           [&](std::int64_t, const ContactState& state) { v_y.push_back(state.xi[1]); });
    trajectory = sim::drive_from(params, end_s, margin_s, [&](double t_s) {
      const double at = std::max(t_s - begin_s, 0.) / kStep;
      const auto last = static_cast<double>(v_y.size() - 1);
      const auto i = static_cast<std::size_t>(std::min(std::floor(at), last - 1.));
      const double share = std::min(at, last) - static_cast<double>(i);
      return (1. - share) * v_y[i] + share * v_y[i + 1];
    });
  }
  return trajectory;
}

std::vector<EncoderSample> encoders(const Params& params, const sim::BodyTrajectory& trajectory,
                                    const Vehicle& vehicle, ContactSolver& solver,
                                    std::uint64_t seed) {
  const double rate_hz = params.wheel_rate_hz, begin_s = params.t_OtoI_s;
  contact::Encoders reader(vehicle.errors, seed);
  std::vector<EncoderSample> out;
  follow(trajectory, vehicle, solver, begin_s, begin_s + params.duration_s + 1e-9, 1. / rate_hz,
         [&](std::int64_t k, const ContactState& state) {
           out.push_back(reader.read(vehicle.truth, state, 1. / rate_hz));
           out.back().t_ns = params.start_ns + sim::sample_time_ns(k, rate_hz);
         });
  log::make_cells(out, std::numeric_limits<double>::infinity());
  return out;
}

log::Recording<Measurement> simulate(Params params, const HostServices& services) {
  const std::int64_t start_ns = params.start_ns;
  const Vehicle vehicle = vehicle_from(params, services);
  sim::RigSimulation rig = sim::rig_from(params, params.duration_s, start_ns, services);
  if (!services.exact) params.draw(services.seed, rig.mounting, params.t_OtoI_s);
  const sim::BodyTrajectory trajectory = drive(params, vehicle, sim::rig_end_s(rig));
  ContactSolver solver(vehicle.truth, vehicle.controller, vehicle.physics);

  log::Recording<Measurement> out;
  const auto add = [&out](auto samples) {
    std::move(samples.begin(), samples.end(), std::back_inserter(out.samples));
  };
  add(contact::intrinsics_of(vehicle.truth, solver.static_radius_m(), start_ns));
  add(sim::mounting_truth(rig.mounting, start_ns));
  out.samples.emplace_back(CalibrationSample{start_ns, "t_OtoI", params.t_OtoI_s});
  const std::uint64_t noise_seed = params.noise_seed(services.seed);
  add(sim::simulate_rig(trajectory, rig, noise_seed));
  auto from_wheels = encoders(params, trajectory, vehicle, solver, noise_seed);
  log::mount_joints(params, from_wheels, out.rejections);
  add(std::move(from_wheels));
  sim::sort_by_time(out.samples);
  return out;
}

SampleTypes kinds_of(const Params& params) {
  SampleTypes out = sim::rig_kinds(params);
  const SampleType* const truth = &sample_type<CalibrationSample>();
  if (std::find(out.begin(), out.end(), truth) == out.end()) out.push_back(truth);
  out.push_back(&sample_type<EncoderSample>());
  return out;
}

class ContactSimulator final : public log::RecordingSensor<Measurement> {
 public:
  ContactSimulator(const Params& params, const HostServices& services)
      : RecordingSensor(simulate(params, services), kinds_of(params)) {}
  bool can_be_exact() const override { return true; }
};

VIWO_REGISTER(Sensor, ContactSimulator, "contact_simulator", "1.0.0",
              "a base on tyres that slip: encoders, IMU, cameras and truth", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo
