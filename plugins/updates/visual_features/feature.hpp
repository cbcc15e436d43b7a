// One landmark: its place from its observations, and the linear system that they give.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "track_store.hpp"
#include "viwo/camera/camera_model.hpp"
#include "window.hpp"

namespace viwo::visual {

/// An observation of the feature at hand; ordered by clone, then camera.
struct Sight {
  int clone = 0;  ///< index in the window
  int camera = 0;
  const Observation* observation = nullptr;
};

/// All observations of a track whose clones are in the window, in the place of what is in `out`.
void collect_sights(const TrackStore& tracks, int track, const Window& window,
                    std::vector<Sight>& out);

struct TriangulationLimits {
  double min_distance_m = 0.1;
  double max_distance_m = 60.;
  double max_condition = 1e4;
};

enum class FeatureStatus : std::uint8_t { kOk, kParallax, kNotVisible, kDistance };

/// Rows of a sight by the calibration of its camera, and its residual behind them, transposed: one
/// multiple of the vector registers.
inline constexpr int kCalibrationRows = kCalibrationSize + 1;
using CalibrationRows = Eigen::Matrix<double, kCalibrationRows, 2>;

/// Two rows, divided by the standard deviation of the pixels.
struct LinearSight {
  int clone = 0;
  int column = 0;  ///< of the clone, in the factor
  int camera = 0;
  double t_s = 0.;                  ///< of the clone, from any instant on
  Eigen::Vector2d residual;         ///< measured - predicted, at the estimates
  Eigen::Matrix<double, 2, 3> H_f;  ///< by p_FinG
  Eigen::Matrix<double, 2, 6> H_x;  ///< by dtheta, dp of the clone
  CalibrationRows calibration;      ///< valid when the camera calibrates()
};

/// Rows of a sight of a point, all at the estimates: H_x may see a turn of the world, where these
/// are not the first ones, and is to be made blind for it (VF-25). False: the camera model has no
/// image of the point.
bool linearize_sight(const Window& window, const Sight& sight, const Eigen::Vector3d& p_FinG,
                     double inverse_sigma, LinearSight& row);

/// Finds p_FinG and its linear system. Keeps its storage.
class Feature {
 public:
  /// Allocates for tracks of up to `max_sights` observations.
  void start(int max_sights, double sigma_px, const TriangulationLimits& limits);
  void set_sigma(double sigma_px) { inverse_sigma_ = 1. / sigma_px; }

  /// All observations of a track whose clones are in the window; returns how many.
  int collect(const TrackStore& tracks, int track, const Window& window);

  /// Least squares of the pixel residuals, from the point next to all rays; anything but kOk: no
  /// use to linearise.
  FeatureStatus triangulate(const Window& window);

  /// After triangulate(): leaves out the sights that do not see the point of the others. Returns
  /// how many; 0 when none does so, or when no half of the sights agrees on a point (VF-22).
  int leave_out_strays();

  /// Rows at the estimates and point() that do not see a turn of the world. kNotVisible: a camera
  /// model has no image of the point.
  FeatureStatus linearize(const Window& window);

  const Eigen::Vector3d& point() const { return p_FinG_; }
  void set_point(const Eigen::Vector3d& p_FinG) { p_FinG_ = p_FinG; }
  const std::vector<Sight>& sights() const { return sights_; }
  const std::vector<LinearSight>& linear() const { return linear_; }

 private:
  /// Ray of a sight in G.
  struct Ray {
    Eigen::Vector3d origin;
    Eigen::Vector3d direction;
    Eigen::Matrix<double, 2, 3> J;  ///< d uv / d (p_FinG - origin) at `direction`
  };
  FeatureStatus intersect_rays();
  int mark_agreeing(const Eigen::Vector3d& point, std::vector<bool>& agrees) const;
  FeatureStatus refine();
  FeatureStatus check_distance() const;

  double inverse_sigma_ = 1.;
  TriangulationLimits limits_;
  Eigen::Vector3d p_FinG_ = Eigen::Vector3d::Zero();
  std::vector<Sight> sights_;
  std::vector<Ray> rays_;
  std::vector<LinearSight> linear_;
  std::vector<bool> agrees_, best_;  ///< of sights
};

}  // namespace viwo::visual
