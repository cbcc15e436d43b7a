#include "viwo/sim/ground.hpp"

#include <cmath>

namespace viwo::sim {

Ground Ground::uneven(double amplitude_m, double wavelength_m) {
  struct Shape {
    double share, length, direction_rad, phase_rad;
  };
  // Directions and lengths without a common period, so that no two places are the same.
  constexpr std::array kShapes{Shape{0.45, 1., 0.3, 0.4}, Shape{0.35, 1.37, 1.9, 1.1},
                               Shape{0.2, 0.73, 2.8, 2.3}};
  Ground ground;
  for (std::size_t i = 0; i < kShapes.size(); ++i) {
    const Shape& shape = kShapes[i];
    const double number = 2. * M_PI / (shape.length * wavelength_m);
    ground.waves_[i] = {
        shape.share * amplitude_m,
        {number * std::cos(shape.direction_rad), number * std::sin(shape.direction_rad)},
        shape.phase_rad};
  }
  return ground;
}

double Ground::height(const Eigen::Vector2d& p) const {  // (SIM-4)
  double z = 0.;
  for (const Wave& wave : waves_) {
    z += wave.amplitude_m *
         (std::sin(wave.wave_vector.dot(p) + wave.phase_rad) - std::sin(wave.phase_rad));
  }
  return z;
}

Eigen::Vector2d Ground::gradient(const Eigen::Vector2d& p) const {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  for (const Wave& wave : waves_) {
    slope +=
        wave.amplitude_m * std::cos(wave.wave_vector.dot(p) + wave.phase_rad) * wave.wave_vector;
  }
  return slope;
}

}  // namespace viwo::sim
