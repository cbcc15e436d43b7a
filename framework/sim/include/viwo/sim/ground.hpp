// What a simulated base drives on: a height over the horizontal plane.
#pragma once

#include <array>

#include <Eigen/Core>

namespace viwo::sim {

/// z = f(x, y) in G, smooth, f = 0 at the origin; flat or a few crossing waves.
class Ground {
 public:
  /// z = 0.
  Ground() = default;
  /// Waves of different directions and lengths around `wavelength_m` > 0; |z| stays below twice
  /// `amplitude_m`, the slope below 5.2 amplitude / wavelength.
  static Ground uneven(double amplitude_m, double wavelength_m);

  double height(const Eigen::Vector2d& p) const;             ///< m
  Eigen::Vector2d gradient(const Eigen::Vector2d& p) const;  ///< df/dx, df/dy

 private:
  struct Wave {
    double amplitude_m = 0.;
    Eigen::Vector2d wave_vector = Eigen::Vector2d::Zero();  ///< rad/m
    double phase_rad = 0.;
  };
  std::array<Wave, 3> waves_{};
};

}  // namespace viwo::sim
