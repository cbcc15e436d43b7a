#include "wheels_setup.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "calibration_start.hpp"
#include "section.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;
using Eigen::Vector3d;

/// What of a wheel set is known from a drawing, in whose frame nothing is held, and has to be moved
/// into the frame that the gauge holds.
struct Drawn {
  bool intrinsics = false, mount = false;
  Intrinsics held_sigma;  ///< of what the gauge holds; zero for all others
};

/// Holds the entries of the gauge, or sets them free.
Drawn hold_gauge(const WheelsParams& p, const CalibrationStart* start, WheelSet& set) {
  const std::vector<IntrinsicSpec>& specs = set.model->description().intrinsics;
  const auto [mount, clock, intrinsics] = wheels_blocks(set.prior);
  const auto is_from_file = [&](const BlockSpec& block) {
    return start != nullptr && std::ranges::any_of(block.entries, [&](const BlockEntry& e) {
             return start->knows(e.name);
           });
  };
  Drawn out{!is_from_file(intrinsics), !is_from_file(mount), Intrinsics::Zero(std::ssize(specs))};
  for (std::size_t k = 0; k < specs.size(); ++k) {
    if (!specs[k].gauge_fixed) continue;
    const auto i = static_cast<Eigen::Index>(k);
    double& sigma = set.prior.sigma_intrinsics[i];
    if (!p.hold_gauge) {
      if (sigma == 0.) sigma = specs[k].prior_sigma;
      continue;
    }
    // A calibration.yaml has a sigma where O was placed by something else than the gauge.
    if (sigma == 0. && !p.held_are_exact) out.held_sigma[i] = specs[k].prior_sigma;
    sigma = 0.;
  }
  return out;
}

/// Makes the start of a wheel set wrong by draws.
void make_wrong(WrongStart wrong, const Drawn& drawn, WheelSet& set) {
  if (!wrong.is_wrong()) return;
  WheelsPrior& prior = set.prior;
  WheelsView& wheels = prior.wheels;
  const Vector3d turn = wrong.draw(Vector3d(prior.sigma_extrinsics.head<3>()));
  const Vector3d shift = wrong.draw(Vector3d(prior.sigma_extrinsics.tail<3>()));
  const double later = wrong.draw(prior.sigma_time_offset_s);
  Intrinsics by(wheels.x_WI.size());
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    by[i] = wrong.draw(prior.sigma_intrinsics[i] + drawn.held_sigma[i]);
  }
  WheelsView there = wheels;
  there.R_ItoO = exp_so3(turn) * wheels.R_ItoO;
  there.p_IinO += shift;
  there.t_OtoI_s += later;
  const WheelsView unmoved = there;
  const auto is_held = (drawn.held_sigma.array() > 0.).eval();
  there.x_WI += is_held.select(by, 0.);
  const bool has_moved = is_held.any() && move_to_held_gauge(*set.model, wheels.x_WI, there);
  if (!has_moved || !drawn.intrinsics) there.x_WI = unmoved.x_WI;
  const auto& held = prior.sigma_extrinsics;  // zero: an axis that stays as it is
  if (!has_moved || !drawn.mount || held[2] == 0.) there.R_ItoO = unmoved.R_ItoO;
  for (int i = 0; i < 3; ++i) {
    if (!has_moved || !drawn.mount || held[3 + i] == 0.) there.p_IinO[i] = unmoved.p_IinO[i];
  }
  there.x_WI += is_held.select(0., by);
  wheels = there;
}

/// What is known of a wheel set, moved into the frame that the gauge holds (CAL-18).
void move_prior(const Drawn& drawn, WheelSet& set) {
  if (drawn.held_sigma.isZero(0.)) return;
  WheelsPrior& prior = set.prior;
  MountKnowledge mount = known_of_imu(prior.wheels.p_IinO, prior.sigma_extrinsics);
  if (!drawn.mount) mount.by_frame.setZero();
  const Intrinsics sigma = prior.sigma_intrinsics + drawn.held_sigma;
  Eigen::MatrixXd P = prior_in_held_frame(*set.model, prior.wheels.x_WI, sigma, mount);
  const Eigen::Index n = sigma.size();
  if (!drawn.intrinsics) {
    P.topRows(n).setZero();
    P.leftCols(n).setZero();
    P.topLeftCorner(n, n) = prior.sigma_intrinsics.cwiseAbs2().asDiagonal();
  }
  const Eigen::VectorXd sigmas = P.diagonal().cwiseSqrt();
  set.correlations = correlation_matrix(P);
  prior.sigma_intrinsics = sigmas.head(n);
  prior.sigma_extrinsics = sigmas.tail<6>();
}

/// What comes and goes of the intrinsics.
void read_wander(const WheelsParams& p, const Node& section, WheelSet& set, Errors& errors) {
  try {
    set.prior.sigma_wander =
        sim::wander_sigmas(set.model->description(), p.intrinsics_wander, p.intrinsics_wander_of);
    set.prior.wander_time_s = p.intrinsics_wander_time_s;
  } catch (const ParamError& error) {
    errors.add(section.find("intrinsics_wander_of")->mark(),
               std::string("intrinsics_wander_of: ") + error.what());
  }
}

}  // namespace

void read_wheels(const WheelsParams& p, const Node& section, WheelSet set, CalibrationError error,
                 const ReadContext& context, FilterSetup& setup, Errors& errors) {
  WheelsPrior& prior = set.prior;
  prior.sensor = p.sensor;
  prior.wheels.model = &set.model->model();
  prior.wheels.R_ItoO = rotation_of_rpy(p.rpy_ItoO_rad);
  prior.wheels.p_IinO = p.p_IinO_m;
  prior.wheels.t_OtoI_s = p.t_OtoI_s;
  prior.sigma_extrinsics << p.sigma_R_ItoO_rad, p.sigma_p_IinO_m;
  prior.sigma_time_offset_s = p.sigma_t_OtoI_s;
  if (context.start != nullptr) context.start->take_mount_and_clock(prior, errors);
  const Drawn drawn = hold_gauge(p, context.start, set);
  make_wrong(WrongStart(error, context.seed, setup.wheels.size()), drawn, set);
  prior.intrinsics_walk = p.intrinsics_walk_per_sqrt_s;
  if (p.intrinsics_wander > 0. && !context.exact) read_wander(p, section, set, errors);
  move_prior(drawn, set);
  if (!p.calibrate_extrinsics) prior.sigma_extrinsics.setZero();
  if (!p.calibrate_time_offset) prior.sigma_time_offset_s = 0.;
  if (!p.calibrate_intrinsics) prior.sigma_intrinsics.setZero();
  setup.wheels.push_back(std::move(set));
}

void read_wheel_sets(const Node& run, CalibrationError error, const ReadContext& context,
                     FilterSetup& setup, Node& resolved, Errors& errors) {
  const Node* sets = run.find("wheel_sets");
  if (sets == nullptr) return;
  if (!sets->is_map()) {
    errors.add(sets->mark(), "'wheel_sets' is a section NAME: {kinematics: ..., wheels: ...}");
    return;
  }
  Node resolved_sets = Node::empty_map(sets->mark());
  for (const auto& entry : sets->entries()) {
    if (!is_name(entry, "wheel_sets", errors)) continue;
    const std::string path = "wheel_sets." + entry.key;
    const Node* kinematics = entry.value.is_map() ? entry.value.find("kinematics") : nullptr;
    if (kinematics == nullptr) {
      errors.add(entry.value.mark(), path + " needs a section 'kinematics'");
      continue;
    }
    for (const auto& part : entry.value.entries()) {
      if (part.key != "kinematics" && part.key != "wheels") {
        errors.add(part.key_mark,
                   path + ": unknown key '" + part.key + "' - known: kinematics, wheels");
      }
    }
    const std::string model_path = path + ".kinematics";
    const auto model = context.plugins.make_kinematics(
        *kinematics, model_path, instance_seed(context.seed, "kinematics", model_path), errors);
    Node resolved_wheels;
    const Node wheels = section_or_empty(entry.value, "wheels");
    const auto params =
        read_section<WheelsParams>(wheels, path + ".wheels", resolved_wheels, errors);
    if (!model.object || !params) continue;
    WheelSet set;
    set.prior.name = entry.key;
    set.model = guarded(model.info, "describe",
                        [&] { return std::make_shared<const WheelModel>(model.object); });
    set.prior.wheels.x_WI = set.model->nominal();
    set.prior.sigma_intrinsics = set.model->prior_sigma();
    set.info = model.info;
    if (context.start != nullptr && context.start->has_wheels(entry.key, set.info.name)) {
      context.start->take_intrinsics(entry.key, *set.model, set.info.name, set.prior.wheels.x_WI,
                                     set.prior.sigma_intrinsics, errors);
    }
    read_wheels(*params, wheels, std::move(set), error, context, setup, errors);
    Node resolved_set = Node::empty_map();
    resolved_set.set("kinematics", model.resolved);
    resolved_set.set("wheels", resolved_wheels);
    resolved_sets.set(entry.key, resolved_set);
  }
  resolved.set("wheel_sets", resolved_sets);
}

void check_wheel_sensors(const Node& run, const FilterSetup& setup, Errors& errors) {
  const Node* sensors = run.find("sensors");
  if (sensors == nullptr || !sensors->is_map()) return;
  std::vector<std::string> names;
  for (const auto& entry : sensors->entries()) names.push_back(entry.key);
  for (const WheelSet& set : setup.wheels) {
    const std::string &name = set.prior.name, &sensor = set.prior.sensor;
    if (sensor.empty() || sensors->find(sensor) != nullptr) continue;
    const Node* at = &run;
    if (!name.empty()) at = at->find("wheel_sets")->find(name);
    errors.add(at->find("wheels")->find("sensor")->mark(),
               (name.empty() ? "" : "wheel_sets." + name + ".") + "wheels.sensor: no sensor '" +
                   sensor + "'" + config::did_you_mean(sensor, names));
  }
}

PriorCorrelations correlations_of(std::span<const WheelSet> sets) {
  PriorCorrelations out;
  for (const WheelSet& set : sets) {
    if (set.correlations.size() == 0) continue;
    const auto [mount, clock, intrinsics] = wheels_blocks(set.prior);
    PriorCorrelations own;
    std::vector<Eigen::Index> kept;
    Eigen::Index row = 0;
    for (const BlockSpec* block : {&intrinsics, &mount}) {
      for (const BlockEntry& entry : block->entries) {
        // Others may be in a calibration.yaml.
        if (set.correlations.row(row).cwiseAbs().sum() > 1.) {
          own.entries.push_back(entry.name);
          kept.push_back(row);
        }
        ++row;
      }
    }
    own.matrix = set.correlations(kept, kept);
    out.append(own);
  }
  return out;
}

Eigen::MatrixXd WheelSet::P_before() const {
  Eigen::VectorXd sigma(prior.sigma_intrinsics.size() + 6);
  sigma << prior.sigma_intrinsics, prior.sigma_extrinsics;
  if (correlations.size() == 0) return sigma.cwiseAbs2().asDiagonal();
  return sigma.asDiagonal() * correlations * sigma.asDiagonal();
}

}  // namespace viwo
