// The cameras of the simulator: what they see, and their truth where it differs from the file.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include <Eigen/Geometry>

#include "test_simulator.hpp"
#include "viwo/api/rig.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

/// The largest mean squared distance [m^2] of the rays to a landmark from the point that is nearest
/// to them, over the landmarks with ten rays or more: the rays leave the true states, through
/// `cameras`, at the stamps plus their t_CtoI. Computed on its own from what the sensor yields.
double largest_miss(const std::vector<Measurement>& all, const std::vector<CameraView>& cameras) {
  std::map<std::int64_t, StateSample> states;
  for (const auto& state : only<StateSample>(all)) states[state.t_ns] = state;
  struct Rays {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double c = 0.;
    int n = 0;
  };
  std::map<std::int64_t, Rays> rays_of;
  for (const auto& image : only<FeatureSample>(all)) {
    const CameraView& cam = cameras[static_cast<std::size_t>(image.camera)];
    const StateSample& state = states.at(image.t_ns + std::llround(1e9 * cam.t_CtoI_s));
    const Eigen::Quaterniond q_ItoG(state.q_ItoG_xyzw[3], state.q_ItoG_xyzw[0],
                                    state.q_ItoG_xyzw[1], state.q_ItoG_xyzw[2]);
    const Eigen::Vector3d p_CinI = -cam.R_ItoC.transpose() * cam.p_IinC;
    const Eigen::Vector3d p_CinG = q_ItoG * p_CinI + Eigen::Vector3d(state.p_IinG_m.data());
    for (const FeaturePoint& point : image.points) {
      const auto ray = unproject(cam, {point.u_px, point.v_px});
      if (!ray) return HUGE_VAL;
      const Eigen::Vector3d d = q_ItoG * (cam.R_ItoC.transpose() * *ray);
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
      Rays& rays = rays_of[point.id];
      rays.A += across;
      rays.b += across * p_CinG;
      rays.c += p_CinG.dot(across * p_CinG);
      ++rays.n;
    }
  }
  int checked = 0;
  double largest = 0.;
  for (const auto& [id, rays] : rays_of) {
    if (rays.n < 10) continue;
    const Eigen::Vector3d p = rays.A.inverse() * rays.b;
    largest = std::max(largest, std::abs(rays.c - p.dot(rays.b)) / rays.n);
    ++checked;
  }
  EXPECT_GT(checked, 30);
  return largest;
}

/// The pair of the file that the sensors here have, read on its own.
std::vector<CameraView> file_cameras() {
  return log::read_kalibr_cameras(std::string(VIWO_TEST_SOURCE_DIR) +
                                  "/configs/cameras/t265_like.yaml");
}

/// Camera k as the true values have it; what these do not tell is the file's.
CameraView true_camera(const std::map<std::string, double>& truth, int k) {
  const std::string name = "cam" + std::to_string(k) + ".";
  const auto three = [&](const std::string& stem) {
    return Eigen::Vector3d(truth.at(name + stem + "_x"), truth.at(name + stem + "_y"),
                           truth.at(name + stem + "_z"));
  };
  CameraView camera = file_cameras()[static_cast<std::size_t>(k)];
  camera.R_ItoC = exp_so3(three("theta_ItoC"));
  camera.p_IinC = three("p_IinC");
  int i = 0;
  for (const char* entry : {"fx", "fy", "cx", "cy", "d1", "d2", "d3", "d4"}) {
    camera.intrinsics[i++] = truth.at(name + entry);
  }
  camera.t_CtoI_s = truth.at(name + "t_CtoI");
  return camera;
}

TEST(Simulator, FeatureDirectionsAndTrueStatesAgreeOnStaticLandmarks) {
  const auto all = play(*make_sensor(
      section_of("duration_s: 5, noise: false, n_cameras: 2, features: 40, ground: uneven, "
                 "camera_phase_s: 0.0137, rpy_ItoO_rad: [0.02, 0.05, -0.1]")));
  EXPECT_LT(largest_miss(all, file_cameras()),
            1e-11);  // rounding, which is another on each machine
}

TEST(Simulator, TracksAndStampsAreThoseOfTheTrueCameras) {
  const auto all = play(*make_sensor(section_of(
      "duration_s: 5, noise: false, n_cameras: 2, features: 40, ground: uneven" + kWrongCameras)));
  const auto truth = calibration_of(all);
  const std::vector<CameraView> cameras{true_camera(truth, 0), true_camera(truth, 1)};
  EXPECT_EQ(cameras[0].t_CtoI_s, 0.004);
  EXPECT_EQ(cameras[1].t_CtoI_s, -0.0025);
  EXPECT_LT(largest_miss(all, cameras), 1e-11);
  // Each kind of errors is there: with the file's numbers in its place the rays do not meet.
  const auto miss_with = [&](auto&& put_back) {
    std::vector<CameraView> mixed = cameras;
    for (std::size_t k = 0; k < 2; ++k) put_back(mixed[k], file_cameras()[k]);
    return largest_miss(all, mixed);
  };
  using Camera = CameraView;
  EXPECT_GT(miss_with([](Camera& c, const Camera& file) { c.R_ItoC = file.R_ItoC; }), 1e-6);
  EXPECT_GT(miss_with([](Camera& c, const Camera& file) { c.p_IinC = file.p_IinC; }), 1e-6);
  for (const int i : {0, 1, 2, 3, 4, 5, 6, 7}) {
    EXPECT_GT(
        miss_with([i](Camera& c, const Camera& file) { c.intrinsics[i] = file.intrinsics[i]; }),
        1e-9)
        << i;
  }
}

TEST(Simulator, ACamerasClockMovesItsStampsAndNothingElse) {
  const std::string rest = "duration_s: 2, n_cameras: 2, features: 30";
  const auto right = play_only<FeatureSample>(section_of(rest));
  const auto all = play(*make_sensor(section_of(rest + ", camera_clock_error_s: [0.0213]")));
  const auto moved = only<FeatureSample>(all);
  ASSERT_EQ(moved.size(), right.size());
  for (std::size_t i = 0; i < moved.size(); ++i) {
    EXPECT_EQ(moved[i].t_ns, right[i].t_ns - 21'300'000);
    EXPECT_EQ(moved[i].camera, right[i].camera);
    for (std::size_t k = 0; k < moved[i].points.size(); ++k) {
      EXPECT_EQ(moved[i].points[k].u_px, right[i].points[k].u_px);
    }
  }
  EXPECT_EQ(calibration_of(all).at("cam1.t_CtoI"), 0.0213);
}

TEST(Simulator, TheTruthOfACameraIsTheFilesUnlessErrorsAreAskedForAndItsDrawIsItsOwn) {
  const auto truth = [](const std::string& rest, std::uint64_t seed = 1) {
    return calibration_of(play(*make_sensor(section_of("duration_s: 0.1, " + rest), seed)));
  };
  const auto file = file_cameras();
  const auto plain = truth("n_cameras: 2");
  for (int k = 0; k < 2; ++k) {
    const CameraView camera = true_camera(plain, k);
    const CameraView& expected = file[static_cast<std::size_t>(k)];
    EXPECT_NEAR((camera.R_ItoC - expected.R_ItoC).norm(), 0., 1e-12);
    EXPECT_EQ(camera.p_IinC, expected.p_IinC);
    EXPECT_EQ(camera.intrinsics, expected.intrinsics);
    EXPECT_EQ(camera.t_CtoI_s, expected.t_CtoI_s);
  }
  EXPECT_FALSE(truth("features: 0").contains("cam0.fx"));
  const std::string wrong = ", sigma_true_camera_focal_px: 3";
  const auto both = truth("n_cameras: 2" + wrong);
  EXPECT_EQ(both.at("cam0.fx"), truth("n_cameras: 1" + wrong).at("cam0.fx"));
  EXPECT_EQ(both.at("cam0.fx"),
            truth("sigma_true_camera_orientation_rad: 0.1" + wrong).at("cam0.fx"));
  EXPECT_NE(both.at("cam0.fx") - file[0].intrinsics[0], both.at("cam1.fx") - file[1].intrinsics[0]);
  EXPECT_NE(both.at("cam0.fx"), truth("n_cameras: 2" + wrong, 2).at("cam0.fx"));
}

TEST(CameraFiles, LookForwardFromAnImuThatIsAlignedWithTheBase) {
  for (const char* name : {"t265_like", "pinhole"}) {
    for (const CameraView& cam : log::read_kalibr_cameras(std::string(VIWO_TEST_SOURCE_DIR) +
                                                          "/configs/cameras/" + name + ".yaml")) {
      const Eigen::Vector3d forward = cam.R_ItoC.transpose().col(2);
      EXPECT_GT(forward.x(), 0.99) << name;
      EXPECT_LE(forward.z(), 1e-12) << name;  // level, or down
      const Eigen::Vector2d centre(0.5 * cam.width_px, 0.5 * cam.height_px);
      const auto ray = unproject(cam, centre);
      ASSERT_TRUE(ray.has_value());
      EXPECT_GT(ray->z(), 0.99) << name;
    }
  }
  const auto pair = file_cameras();
  const auto place = [](const CameraView& cam) -> Eigen::Vector3d {
    return -cam.R_ItoC.transpose() * cam.p_IinC;
  };
  EXPECT_NEAR((place(pair[0]) - place(pair[1]) - Eigen::Vector3d(0., 0.063, 0.)).norm(), 0., 1e-12);
}

}  // namespace
}  // namespace viwo
