// One landmark: its place from its observations, and the linear system that they give.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "track_store.hpp"
#include "triangulation.hpp"
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
  Eigen::Matrix<double, 2, 3> H_f;  ///< by the direction of the point; of a track by (VF-26)
  Eigen::Vector2d by_rho;           ///< by its inverse distance
  Eigen::Matrix<double, 2, 6> H_x;  ///< by dtheta, dp of the clone
  CalibrationRows calibration;      ///< valid when the camera calibrates()
};

/// Rows of a sight of a point, all at the estimates: H_x may see a turn of the world, where these
/// are not the first ones, and is to be made blind for it (VF-25). False: the camera model has no
/// image of the point.
bool linearize_sight(const Window& window, const Sight& sight, const InversePoint& point,
                     double inverse_sigma, LinearSight& row);

/// Finds a point and its linear system. Keeps its storage.
class Feature {
 public:
  /// Allocates for tracks of up to `max_sights` observations. `exact`: rows are derivatives,
  /// without what is known of the noise of the point (HostServices::exact).
  void start(int max_sights, double sigma_px, double min_distance_m, bool exact = false);
  void set_sigma(double sigma_px) { sigma_px_ = sigma_px; }

  /// All observations of a track whose clones are in the window; returns how many.
  int collect(const TrackStore& tracks, int track, const Window& window);
  /// Sights that were collected before, from the same window.
  void take(std::span<const Sight> sights) { sights_.assign(sights.begin(), sights.end()); }

  /// Least squares of the pixel residuals, and what is known of distances besides; anything but
  /// kOk: no use to linearise.
  FeatureStatus triangulate(Window& window);

  /// After triangulate(): leaves out the sights that do not see the point of the others. Returns
  /// how many; 0 when none does so, or when no half of the sights agrees on a point (VF-22).
  int leave_out_strays();

  /// Rows at the estimates and the point that do not see a turn of the world. kNotVisible: a camera
  /// model has no image of the point.
  FeatureStatus linearize(Window& window);

  const MetRays& met() const { return met_; }
  /// After triangulate(): derivative of rho, as found, by dtheta and dp of the clones: a way that
  /// is taken for longer than it is makes points farther that are told by it, and a turn feigns a
  /// distance (VF-29). The place of the first camera in its IMU turns with it by too little to
  /// count.
  Eigen::Ref<const Eigen::VectorXd> rho_by_poses(const Window& window);
  /// It was used: others will be about as far.
  void remember_distance();
  /// After linearize(): what is left out of a row, in sigmas of a pixel, where it is most (VF-30).
  double second_order() const { return second_order_; }
  /// Whether its rows have the noise of pixels alone (VF-27).
  bool has_plain_noise() const { return has_plain_noise_; }
  void set_point(const Eigen::Vector3d& p_FinG);
  /// What is known of rho besides, where the rays tell nothing. Else it would be known from where
  /// the rays begin, and with it where the world is.
  double information_of_rho() const {
    return met_.point.rho != 0. ? 0. : visual::information_of_rho(min_distance_m_);
  }
  const std::vector<Sight>& sights() const { return sights_; }
  const std::vector<LinearSight>& linear() const { return linear_; }

 private:
  void leave_to_noise(Window& window);
  bool is_of_scene(Window& window);

  double sigma_px_ = 1., min_distance_m_ = 0.1;
  bool exact_ = false;
  MetRays met_;
  FoundDistances distances_;
  double found_rho_ = 0., found_variance_ = 0.;  ///< of the last track
  bool is_of_scene_ = false, has_plain_noise_ = true;
  double second_order_ = 0.;
  Eigen::VectorXd by_clones_, P_by_clones_;  ///< derivatives of rho
  std::vector<Sight> sights_;
  std::vector<Ray> rays_;
  std::vector<LinearSight> linear_;
  std::vector<bool> agrees_, best_;  ///< of sights
};

}  // namespace viwo::visual
