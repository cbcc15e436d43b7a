// What the tracker makes of good images.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core/utility.hpp>

#include "camera_tracker.hpp"
#include "stereo_matcher.hpp"
#include "test_drive.hpp"

namespace viwo::klt {
namespace {

struct Errors {
  double rmse_px = 0.;  ///< per coordinate
  double max_px = 0.;
  int count = 0;
};

/// Of the points of one camera, against the places on the walls where the left image first saw
/// them.
Errors errors_of(const Played& played, int camera) {
  std::map<std::int64_t, Eigen::Vector3d> truth;
  Errors errors;
  double sum = 0.;
  for (const FeatureSample& sample : played.samples) {
    const auto image = static_cast<int>((sample.t_ns - kStartNs) / kPeriodNs);
    const CameraView& view = rig().cameras[static_cast<std::size_t>(sample.camera)];
    const CameraPose pose = rig().pose(image, sample.camera);
    for (const FeaturePoint& point : sample.points) {
      const Eigen::Vector2d measured(point.u_px, point.v_px);
      const auto found = truth.find(point.id);
      if (found == truth.end()) {
        EXPECT_EQ(sample.camera, 0);
        truth[point.id] = Room::hit(pose.p_CinW, pose.R_CtoW * unproject(view, measured).value());
        continue;
      }
      if (sample.camera != camera) continue;
      Eigen::Vector2d uv;
      EXPECT_TRUE(project(view, pose.R_CtoW.transpose() * (found->second - pose.p_CinW), uv));
      sum += (uv - measured).squaredNorm();
      errors.max_px = std::max(errors.max_px, (uv - measured).norm());
      ++errors.count;
    }
  }
  errors.rmse_px = std::sqrt(0.5 * sum / errors.count);
  return errors;
}

TEST(KltTracker, StaysOnItsPointsToATenthOfAPixel) {
  const Played played = track(drive(12, 2), section());
  const Errors left = errors_of(played, 0), right = errors_of(played, 1);
  EXPECT_LT(left.rmse_px, 0.1);
  EXPECT_LT(right.rmse_px, 0.1);
  EXPECT_LT(left.max_px, 1.5);
  EXPECT_LT(right.max_px, 1.5);
  EXPECT_GT(left.count, 11 * 160);
  EXPECT_GT(right.count, 12 * 180);
}

TEST(KltTracker, DriftsTwiceAsMuchWithoutRefinement) {
  const std::vector<Measurement> images = drive(12, 1);
  const Errors with = errors_of(track(images, section({}, 1)), 0);
  const Errors without = errors_of(track(images, section("refine: false\n", 1)), 0);
  EXPECT_LT(with.rmse_px, 0.085);
  EXPECT_GT(without.rmse_px, 2. * with.rmse_px);
  EXPECT_LT(without.rmse_px, 0.25);
}

TEST(KltTracker, KeepsTheIdsOfWhatItFollows) {
  const auto left = track(drive(6, 1), section({}, 1)).of(0);
  ASSERT_EQ(left.size(), 6U);
  for (std::size_t i = 0; i + 1 < left.size(); ++i) {
    EXPECT_GT(common(left[i], left[i + 1]), 185U);
    EXPECT_NEAR(static_cast<double>(left[i].points.size()), 200., 5.);
  }
  EXPECT_GT(common(left.front(), left.back()), 150U);
}

TEST(KltTracker, GivesOneSamplePerImageWithTheStampOfThatImage) {
  // GIVEN a second camera whose stamps are half a millisecond off, and other measurements
  std::vector<Measurement> input;
  for (int i = 0; i < 3; ++i) {
    input.emplace_back(ImuSample{stamp_of(i) - 1000, {}, {}});
    input.emplace_back(sample_of(rig().render(i, 1), 1, stamp_of(i) - 500'000));
    input.emplace_back(sample_of(rig().render(i, 0), 0, stamp_of(i)));
  }
  const Played played = track(input, section());
  // THEN there are pairs, each image in the clock of its camera, in time order
  ASSERT_EQ(played.samples.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const int camera = 1 - static_cast<int>(i % 2);
    EXPECT_EQ(played.samples[i].camera, camera);
    EXPECT_EQ(played.samples[i].t_ns, stamp_of(static_cast<int>(i / 2)) - camera * 500'000);
    EXPECT_GT(played.samples[i].points.size(), 180U);
  }
  EXPECT_TRUE(played.rejections.empty());
}

TEST(KltTracker, GivesEachCameraItsOwnPointsWithoutStereo) {
  const Played played = track(drive(4, 2), section("stereo: false\n"));
  ASSERT_EQ(played.samples.size(), 8U);
  for (std::size_t i = 0; i < 8; i += 2) {
    EXPECT_EQ(common(played.samples[i], played.samples[i + 1]), 0U);
    EXPECT_GT(played.samples[i + 1].points.size(), 185U);
  }
  EXPECT_GT(common(played.samples[1], played.samples[7]), 150U);
}

TEST(SharedView, IsWhatBothCamerasSeeFarAway) {
  const CameraView left = rig().cameras[0];
  EXPECT_GT(shared_view(left, rig().cameras[1]), 0.85);
  EXPECT_EQ(shared_view(left, left), 1.);
  CameraView turned = left;
  turned.R_ItoC = exp_so3(Eigen::Vector3d(0., M_PI, 0.)) * left.R_ItoC;
  EXPECT_LT(shared_view(left, turned), 0.4);  // the corners see more than a hemisphere
  turned.R_ItoC = exp_so3(Eigen::Vector3d(0., M_PI / 2., 0.)) * left.R_ItoC;
  EXPECT_NEAR(shared_view(left, turned), 0.5, 0.15);  // they see 170 degrees
}

TEST(KltTracker, FollowsTwoPairsAsItFollowsEachOfThem) {
  // GIVEN two pairs that see different things
  constexpr int kImages = 4, kElsewhere = 20;
  std::vector<Measurement> input;
  for (int i = 0; i < kImages; ++i) {
    for (int camera = 0; camera < 4; ++camera) {
      const int place = camera < 2 ? i : i + kElsewhere;
      input.emplace_back(sample_of(rig().render(place, camera % 2), camera, stamp_of(i)));
    }
  }
  const Played four = track(input, section({}, 4));
  const Played two = track(drive(kImages, 2), section());
  ASSERT_EQ(four.samples.size(), 4U * kImages);
  for (std::size_t i = 0; i < kImages; ++i) {
    const auto of = [i](const Played& played, int camera) { return played.of(camera)[i]; };
    // THEN the first one is followed as if it was alone
    for (const int camera : {0, 1}) {
      const auto &points = of(four, camera).points, &alone = of(two, camera).points;
      ASSERT_EQ(points.size(), alone.size());
      for (std::size_t k = 0; k < points.size(); ++k) {
        EXPECT_EQ(points[k].u_px, alone[k].u_px);
        EXPECT_EQ(points[k].v_px, alone[k].v_px);
      }
    }
    // AND points are shared within a pair, and between pairs never
    EXPECT_GT(common(of(four, 0), of(four, 1)), 180U);
    EXPECT_GT(common(of(four, 2), of(four, 3)), 150U);
    for (const int camera : {2, 3}) EXPECT_EQ(common(of(four, 0), of(four, camera)), 0U);
  }
}

TEST(KltTracker, GivesTheSameBitsAtEveryRunAndForAnyNumberOfThreads) {
  const std::vector<Measurement> images = drive(5, 2);
  const int threads = cv::getNumThreads();
  for (const char* parameters : {"", "stereo: false\nhistogram_method: clahe\n"}) {
    std::vector<Played> all;
    for (const int n : {1, 2, 2}) {
      cv::setNumThreads(n);
      all.push_back(track(images, section(parameters)));
    }
    for (const Played& played : all) {
      ASSERT_EQ(played.samples.size(), 10U);
      for (std::size_t i = 0; i < 10; ++i) {
        const auto& points = played.samples[i].points;
        const auto& first = all.front().samples[i].points;
        ASSERT_EQ(points.size(), first.size());
        for (std::size_t k = 0; k < points.size(); ++k) {
          EXPECT_EQ(points[k].id, first[k].id);
          EXPECT_EQ(points[k].u_px, first[k].u_px);
          EXPECT_EQ(points[k].v_px, first[k].v_px);
        }
      }
    }
  }
  cv::setNumThreads(threads);
}

TEST(KltTracker, DrawsOfAnotherCameraOrSeedAreOthers) {
  // Image k of a camera draws with its seed + k.
  std::set<std::uint64_t> seeds;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (std::size_t camera = 0; camera < 2; ++camera) {
      for (std::uint64_t k = 0; k < 1000; ++k) seeds.insert(camera_seed(seed, camera) + k);
    }
  }
  EXPECT_EQ(seeds.size(), 40'000U);
}

TEST(KltTracker, DropsWhatMovesOnItsOwn) {
  // GIVEN a square in front of the cameras that goes up while the cameras go to the side
  const auto run = [](const std::string& parameters) {
    std::vector<Measurement> input;
    for (int i = 0; i < 6; ++i) {
      const Mover mover{Eigen::Vector3d(0., 0.5 - 0.06 * i, 1.4), 0.7};
      input.emplace_back(sample_of(rig().render(i, 0, mover), 0, stamp_of(i)));
    }
    const auto left = track(input, section(parameters, 1)).of(0);
    // Followed points on the square, and others.
    std::pair<int, int> counts;
    for (int i = 1; i < 6; ++i) {
      const auto before = ids_of(left[static_cast<std::size_t>(i - 1)]);
      const CameraPose pose = rig().pose(i, 0);
      for (const FeaturePoint& point : left[static_cast<std::size_t>(i)].points) {
        if (!before.contains(point.id)) continue;
        const Eigen::Vector3d direction =
            pose.R_CtoW *
            unproject(rig().cameras[0], Eigen::Vector2d(point.u_px, point.v_px)).value();
        const Eigen::Vector3d at =
            pose.p_CinW + (1.4 - pose.p_CinW.z()) / direction.z() * direction;
        const bool on = direction.z() > 0. && std::abs(at.x()) < 0.65 &&
                        std::abs(at.y() - (0.5 - 0.06 * i)) < 0.65;
        ++(on ? counts.first : counts.second);
      }
    }
    return counts;
  };
  const auto all = run("ransac: false\n");
  const auto rigid = run("ransac: true\n");
  EXPECT_GT(all.first, 60);
  EXPECT_LT(rigid.first, all.first / 5);
  EXPECT_GT(rigid.second, all.second * 95 / 100);
}

TEST(KltTracker, LosesNothingByTurningOrStanding) {
  for (const double yaw : {0., 0.05}) {
    std::vector<Measurement> input;
    for (int i = 0; i < 5; ++i) {
      const CameraPose pose{exp_so3(Eigen::Vector3d(0., yaw * i, 0.)), Eigen::Vector3d::Zero()};
      input.emplace_back(
          sample_of(rig().left.render(pose, 1.5, static_cast<std::uint64_t>(i)), 0, stamp_of(i)));
    }
    const auto without = track(input, section("ransac: false\n", 1)).of(0);
    const auto with = track(input, section({}, 1)).of(0);
    EXPECT_GE(common(with.front(), with.back()) + 3, common(without.front(), without.back()));
    EXPECT_GT(common(with.front(), with.back()), yaw > 0. ? 150U : 198U);
  }
}

TEST(KltTracker, FindsNewPointsAgainWhileTheCameraTurns) {
  // GIVEN a camera that turns by 0.3 rad from image to image, faster and faster until then
  const std::vector<double> yaws{0., 0.1, 0.3, 0.6, 0.9, 1.2};
  std::vector<Measurement> input;
  std::vector<CameraPose> poses;
  for (std::size_t i = 0; i < yaws.size(); ++i) {
    poses.push_back({exp_so3(Eigen::Vector3d(0., yaws[i], 0.)), Eigen::Vector3d::Zero()});
    input.emplace_back(
        sample_of(rig().left.render(poses[i], 1.5, i), 0, stamp_of(static_cast<int>(i))));
  }
  const auto left = track(input, section({}, 1)).of(0);
  // THEN points that are new in an image are found in the next one, if they are in it
  const CameraView& view = rig().cameras[0];
  const Eigen::Vector2d size(view.width_px, view.height_px);
  int in_sight = 0, found = 0;
  for (std::size_t i = 2; i + 1 < left.size(); ++i) {
    const auto before = ids_of(left[i - 1]), after = ids_of(left[i + 1]);
    for (const FeaturePoint& point : left[i].points) {
      if (before.contains(point.id)) continue;
      const auto ray = unproject(view, Eigen::Vector2d(point.u_px, point.v_px));
      Eigen::Vector2d uv;
      if (!project(view, poses[i + 1].R_CtoW.transpose() * (poses[i].R_CtoW * ray.value()), uv) ||
          (uv - 0.5 * size).cwiseAbs().cwiseQuotient(size).maxCoeff() > 0.45) {
        continue;
      }
      ++in_sight;
      if (after.contains(point.id)) ++found;
    }
  }
  EXPECT_GT(in_sight, 30);
  EXPECT_GT(found, 0.7 * in_sight) << found << " of " << in_sight;  // 0.03 from where they were
}

TEST(KltTracker, RespectsMasksOfBothCameras) {
  Image mask{424, 400, std::vector<std::uint8_t>(424 * 400, 0)};
  std::fill(mask.pixels.begin() + 424 * 250, mask.pixels.end(), std::uint8_t{255});
  write_png(temporary("mask0.png"), mask);
  std::fill(mask.pixels.begin() + 424 * 200, mask.pixels.end(), std::uint8_t{255});
  write_png(temporary("mask1.png"), mask);
  const Played played =
      track(drive(5, 2), section("mask0: " + temporary("mask0.png").string() +
                                 "\nmask1: " + temporary("mask1.png").string() + "\n"));
  for (const FeatureSample& sample : played.samples) {
    EXPECT_GT(sample.points.size(), 60U);
    for (const FeaturePoint& point : sample.points) {
      EXPECT_LT(point.v_px, sample.camera == 0 ? 249.5 : 199.5);
    }
  }
}

}  // namespace
}  // namespace viwo::klt
