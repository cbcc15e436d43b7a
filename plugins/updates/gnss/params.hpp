// Parameters of the update, and the blocks of the state that follow from them.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "alignment.hpp"
#include "local_frame.hpp"
#include "viwo/api/block.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo::gnss {

inline constexpr double kUnknownPositionM = 1e3;  ///< the default of sigma_p_EinG_m

struct GnssParams {
  std::string name = "gnss";
  Eigen::Vector3d p_AinI_m{0., 0., 0.};
  Eigen::Vector3d sigma_p_AinI_m{0.05, 0.05, 0.05};
  double t_AtoI_s = 0.;
  double sigma_m = 1.;
  double sigma_scale = 1.;
  double sigma_drift_m = 0.;
  double sigma_height_drift_m = 0.;
  double drift_time_constant_s = 100.;
  double yaw_EtoG_rad = 0.;
  double sigma_yaw_rad = 3.2;
  std::vector<double> origin_deg;
  double origin_altitude_m = 0.;
  Eigen::Vector3d p_EinG_m{0., 0., 0.};
  double sigma_p_EinG_m = 1000.;
  double alignment_sigma_rad = 0.2;
  double max_span_s = 0.5;
  double gate_probability = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(name),
      {.help = "in front of what is estimated; another one for a further receiver"});
    b(VIWO_PARAM(p_AinI_m),
      {.unit = "m", .help = "lever arm: where the antenna is seen from the IMU"});
    b(VIWO_PARAM(sigma_p_AinI_m),
      {.unit = "m", .min = 0., .help = "how well that is known; 0 holds it"});
    b(VIWO_PARAM(t_AtoI_s),
      {.unit = "s",
       .min = -10.,
       .max = 10.,
       .help = "clock of the receiver: t_imu = stamp + t_AtoI; below 0 for stamps that are "
               "late"});
    b(VIWO_PARAM(sigma_m), {.unit = "m",
                            .above = 0.,
                            .help = "noise of fixes that come without a covariance, per axis"});
    b(VIWO_PARAM(sigma_scale),
      {.above = 0., .help = "the sigmas of all fixes are taken so many times"});
    b(VIWO_PARAM(sigma_drift_m),
      {.unit = "m",
       .min = 0.,
       .help = "error that consecutive fixes share, per horizontal axis; 0: none"});
    b(VIWO_PARAM(sigma_height_drift_m), {.unit = "m", .min = 0., .help = "the same, up"});
    b(VIWO_PARAM(drift_time_constant_s),
      {.unit = "s", .above = 0., .help = "in which that error becomes another one"});
    b(VIWO_PARAM(yaw_EtoG_rad),
      {.unit = "rad",
       .min = -6.3,
       .max = 6.3,
       .help = "how E (x east) is turned in G, about the vertical, counter-clockwise"});
    b(VIWO_PARAM(sigma_yaw_rad),
      {.unit = "rad", .min = 0., .help = "how well that is known; 3.2: not at all; 0 holds it"});
    b(VIWO_PARAM(origin_deg),
      {.unit = "deg",
       .help = "with a known yaw: latitude and longitude of the origin of E; empty: that of "
               "the first fix that is used"});
    b(VIWO_PARAM(origin_altitude_m), {.unit = "m", .help = "of that origin, above the ellipsoid"});
    b(VIWO_PARAM(p_EinG_m), {.unit = "m", .help = "where that origin is in G"});
    b(VIWO_PARAM(sigma_p_EinG_m),
      {.unit = "m", .min = 0., .help = "how well that is known; 1000: not at all; 0 holds it"});
    b(VIWO_PARAM(alignment_sigma_rad),
      {.unit = "rad",
       .min = 0.001,
       .max = 0.3,
       .help = "fixes are used from when two of them tell the yaw so well"});
    b(VIWO_PARAM(max_span_s),
      {.unit = "s", .above = 0., .help = "fixes between clones further apart are left out"});
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "fixes less likely than this are weighed down (F-32) and counted; 0: none"});
  }
};

struct GnssOptions {
  std::string name;
  Eigen::Vector3d p_AinI, sigma_p_AinI;
  double t_AtoI_s;
  FixNoise noise;
  Eigen::Vector3d sigma_drift;  ///< along the axes of G [m]
  double drift_time_constant_s;
  std::optional<LocalFrame> frame;  ///< if its origin is configured
  Alignment alignment;
  double sigma_yaw_rad, sigma_p_EinG_m;
  double alignment_sigma_rad;
  double max_span_s, gate_probability;

  bool has_drift() const { return sigma_drift.maxCoeff() > 0.; }
  bool yaw_is_known() const { return sigma_yaw_rad <= alignment_sigma_rad; }

  BlockSpec lever_arm_spec() const {
    BlockSpec spec{.name = name + ".lever_arm"};
    for (int i = 0; i < 3; ++i) {
      spec.add(name + ".p_AinI_" + "xyz"[i], "m", p_AinI[i], sigma_p_AinI[i]);
    }
    spec.entries[2].needs = Excitation::kTilt;
    return spec;
  }
  BlockSpec alignment_spec() const {
    BlockSpec spec{.name = name + ".alignment"};
    spec.add(name + ".yaw_EtoG", "rad", alignment.yaw_EtoG, sigma_yaw_rad);
    for (int i = 0; i < 3; ++i) {
      spec.add(name + ".p_EinG_" + "xyz"[i], "m", alignment.p_EinG[i], sigma_p_EinG_m);
    }
    return spec;
  }
  BlockSpec drift_spec() const {
    BlockSpec spec{.name = name + ".drift"};
    spec.process = Process::kGaussMarkov;
    spec.time_constant_s = drift_time_constant_s;
    for (int i = 0; i < 3; ++i) {
      spec.add(name + ".drift_" + "xyz"[i], "m", 0., sigma_drift[i]);
      spec.entries.back().process_sigma = sigma_drift[i];
    }
    return spec;
  }
};

/// ParamError for lists of a wrong length and contradictions.
inline GnssOptions gnss_options(const GnssParams& params) {
  const double drift = params.sigma_drift_m;
  GnssOptions options{
      .name = params.name,
      .p_AinI = params.p_AinI_m,
      .sigma_p_AinI = params.sigma_p_AinI_m,
      .t_AtoI_s = params.t_AtoI_s,
      .noise = {params.sigma_m, params.sigma_scale},
      .sigma_drift = {drift, drift, params.sigma_height_drift_m},
      .drift_time_constant_s = params.drift_time_constant_s,
      .frame = {},
      .alignment = {params.yaw_EtoG_rad, params.p_EinG_m},
      .sigma_yaw_rad = params.sigma_yaw_rad,
      .sigma_p_EinG_m = params.sigma_p_EinG_m,
      .alignment_sigma_rad = params.alignment_sigma_rad,
      .max_span_s = params.max_span_s,
      .gate_probability = params.gate_probability,
  };
  if (options.name.empty()) throw ParamError("name", "must not be empty");
  const auto origin = params.origin_deg;
  const bool position_is_given =
      options.sigma_p_EinG_m != kUnknownPositionM || !options.alignment.p_EinG.isZero(0.);
  if (origin.empty()) {
    if (position_is_given) throw ParamError("origin_deg", "is not given, but where it is in G");
    return options;
  }
  if (origin.size() != 2) throw ParamError("origin_deg", "needs two numbers");
  if (!(std::abs(origin[0]) <= 90.)) {
    throw ParamError("origin_deg", "has a latitude beyond 90 degrees");
  }
  if (!options.yaw_is_known()) {
    throw ParamError("origin_deg",
                     "needs a yaw that is known: sigma_yaw_rad must be at most "
                     "alignment_sigma_rad");
  }
  options.frame.emplace(origin[0], origin[1], params.origin_altitude_m);
  return options;
}

}  // namespace viwo::gnss
