// Parameters of the update, and the blocks of the state that follow from them.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "alignment.hpp"
#include "local_frame.hpp"
#include "viwo/api/block.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo::gnss {

inline constexpr double kUnknownPositionM = 1e3;  ///< the default of sigma_p_EinG_m

// clang-format off
inline constexpr std::array kGnssParams{
    ParamSpec{.name = "name", .type = ParamType::kString, .fallback = "gnss",
              .help = "in front of what is estimated; another one for a further receiver"},
    ParamSpec{.name = "p_AinI_m", .type = ParamType::kNumbers, .unit = "m",
              .fallback = "[0, 0, 0]", .help = "lever arm: where the antenna is seen from the IMU"},
    ParamSpec{.name = "sigma_p_AinI_m", .type = ParamType::kNumbers, .unit = "m",
              .fallback = "[0.05, 0.05, 0.05]", .min = 0.,
              .help = "how well that is known; 0 holds it"},
    ParamSpec{.name = "t_AtoI_s", .type = ParamType::kNumber, .unit = "s", .fallback = "0",
              .min = -10., .max = 10.,
              .help = "clock of the receiver: t_imu = stamp + t_AtoI; below 0 for stamps that are "
                      "late"},
    ParamSpec{.name = "sigma_m", .type = ParamType::kNumber, .unit = "m", .fallback = "1",
              .min = 0., .min_exclusive = true,
              .help = "noise of fixes that come without a covariance, per axis"},
    ParamSpec{.name = "sigma_scale", .type = ParamType::kNumber, .fallback = "1", .min = 0.,
              .min_exclusive = true, .help = "the sigmas of all fixes are taken so many times"},
    ParamSpec{.name = "sigma_drift_m", .type = ParamType::kNumber, .unit = "m", .fallback = "0",
              .min = 0.,
              .help = "error that consecutive fixes share, per horizontal axis; 0: none"},
    ParamSpec{.name = "sigma_height_drift_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0", .min = 0., .help = "the same, up"},
    ParamSpec{.name = "drift_time_constant_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "100", .min = 0., .min_exclusive = true,
              .help = "in which that error becomes another one"},
    ParamSpec{.name = "yaw_EtoG_rad", .type = ParamType::kNumber, .unit = "rad", .fallback = "0",
              .min = -6.3, .max = 6.3,
              .help = "how E (x east) is turned in G, about the vertical, counter-clockwise"},
    ParamSpec{.name = "sigma_yaw_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "3.2", .min = 0.,
              .help = "how well that is known; 3.2: not at all; 0 holds it"},
    ParamSpec{.name = "origin_deg", .type = ParamType::kNumbers, .unit = "deg", .fallback = "[]",
              .help = "with a known yaw: latitude and longitude of the origin of E; empty: that of "
                      "the first fix that is used"},
    ParamSpec{.name = "origin_altitude_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0", .help = "of that origin, above the ellipsoid"},
    ParamSpec{.name = "p_EinG_m", .type = ParamType::kNumbers, .unit = "m",
              .fallback = "[0, 0, 0]", .help = "where that origin is in G"},
    ParamSpec{.name = "sigma_p_EinG_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "1000", .min = 0.,
              .help = "how well that is known; 1000: not at all; 0 holds it"},
    ParamSpec{.name = "alignment_sigma_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0.2", .min = 0.001, .max = 0.3,
              .help = "fixes are used from when two of them tell the yaw so well"},
    ParamSpec{.name = "max_span_s", .type = ParamType::kNumber, .unit = "s", .fallback = "0.5",
              .min = 0., .min_exclusive = true,
              .help = "fixes between clones further apart are left out"},
    ParamSpec{.name = "gate_probability", .type = ParamType::kNumber, .fallback = "0.001",
              .min = 0., .max = 0.5, .help = "fixes less likely than this are left out; 0: none"},
};
// clang-format on

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

inline Eigen::Vector3d three(const ParamSet& params, const char* key) {
  const auto values = params.numbers(key);
  if (values.size() != 3) throw ParamError(key, "needs three numbers");
  return {values[0], values[1], values[2]};
}

/// ParamError for lists of a wrong length and contradictions.
inline GnssOptions gnss_options(const ParamSet& params) {
  const double drift = params.number("sigma_drift_m");
  GnssOptions options{
      .name = params.text("name"),
      .p_AinI = three(params, "p_AinI_m"),
      .sigma_p_AinI = three(params, "sigma_p_AinI_m"),
      .t_AtoI_s = params.number("t_AtoI_s"),
      .noise = {params.number("sigma_m"), params.number("sigma_scale")},
      .sigma_drift = {drift, drift, params.number("sigma_height_drift_m")},
      .drift_time_constant_s = params.number("drift_time_constant_s"),
      .frame = {},
      .alignment = {params.number("yaw_EtoG_rad"), three(params, "p_EinG_m")},
      .sigma_yaw_rad = params.number("sigma_yaw_rad"),
      .sigma_p_EinG_m = params.number("sigma_p_EinG_m"),
      .alignment_sigma_rad = params.number("alignment_sigma_rad"),
      .max_span_s = params.number("max_span_s"),
      .gate_probability = params.number("gate_probability"),
  };
  if (options.name.empty()) throw ParamError("name", "must not be empty");
  const auto origin = params.numbers("origin_deg");
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
  options.frame.emplace(origin[0], origin[1], params.number("origin_altitude_m"));
  return options;
}

}  // namespace viwo::gnss
