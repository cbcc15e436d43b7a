// Where points are found, and where they are fitted to.
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "detector.hpp"
#include "frame.hpp"
#include "neighbours.hpp"
#include "patch.hpp"
#include "test_scene.hpp"

namespace viwo::klt {
namespace {

CameraView pinhole(int width_px, int height_px) {
  CameraView camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.intrinsics << 200., 200., 0.5 * width_px, 0.5 * height_px, 0., 0., 0., 0.;
  return camera;
}

/// Grey level of a smooth texture, px.
double texture(double x, double y) {
  return 120. + 30. * std::sin(0.42 * x + 0.1 * y) + 30. * std::cos(0.37 * y - 0.15 * x) +
         25. * std::sin(0.21 * x - 0.55 * y + 1.) + 20. * std::cos(0.6 * x + 0.33 * y);
}

template <class Grey>
cv::Mat draw(int width_px, int height_px, Grey grey) {
  cv::Mat image(height_px, width_px, CV_8UC1);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      image.at<uchar>(y, x) = cv::saturate_cast<uchar>(grey(x, y));
    }
  }
  return image;
}

Image to_image(const cv::Mat& mat) { return {mat.cols, mat.rows, {mat.datastart, mat.dataend}}; }

/// Blurred as by a lens, with the noise of a camera.
Image as_seen(cv::Mat sharp) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0., 1.);
  cv::GaussianBlur(sharp, sharp, cv::Size(), 0.7);
  return to_image(draw(sharp.cols, sharp.rows,
                       [&](int x, int y) { return sharp.at<uchar>(y, x) + noise(random); }));
}

/// Whether a pixel is in one of the squares that end every `step` pixels.
bool in_square(int x, int y, int step, int side) {
  return x % step >= step - side && y % step >= step - side;
}

/// White squares on black.
Image squares(int width_px, int height_px, int step, int side) {
  return as_seen(draw(width_px, height_px,
                      [&](int x, int y) { return in_square(x, y, step, side) ? 220. : 30.; }));
}

TEST(Patch, FindsItsPlaceUnderAnAffineDeformationAndOtherLight) {
  // GIVEN an image, and the same deformed about (40, 40), with other brightness and contrast
  Eigen::Matrix2d A;
  A << 1.06, -0.09, 0.07, 0.95;
  const Eigen::Vector2d moved(43.4, 38.8);
  const cv::Mat before = draw(80, 80, texture);
  const cv::Mat after = draw(80, 80, [&](int x, int y) {
    const Eigen::Vector2d p =
        A.inverse() * (Eigen::Vector2d(x, y) - moved) + Eigen::Vector2d(40., 40.);
    return 0.6 * texture(p.x(), p.y()) + 40.;
  });
  // WHEN the patch is fitted from a pixel off
  PatchPose pose{Eigen::Vector2f(44.2F, 38.1F), Eigen::Matrix2f::Identity()};
  const float alike = Patch(before, Eigen::Vector2f(40.F, 40.F)).fit(after, pose);
  // THEN it is there, and knows how it is deformed
  EXPECT_GT(alike, 0.995F);
  EXPECT_NEAR(pose.u.x(), moved.x(), 0.03);
  EXPECT_NEAR(pose.u.y(), moved.y(), 0.03);
  EXPECT_LT((pose.A.cast<double>() - A).cwiseAbs().maxCoeff(), 0.01);
}

TEST(Patch, SaysWhenSomethingElseIsThere) {
  const cv::Mat before = draw(80, 80, texture);
  const cv::Mat other = draw(80, 80, [](int x, int y) { return texture(1.7 * y + 30., -x); });
  PatchPose pose{Eigen::Vector2f(40.F, 40.F), Eigen::Matrix2f::Identity()};
  EXPECT_LT(Patch(before, Eigen::Vector2f(40.F, 40.F)).fit(other, pose), 0.7F);
  // In a blank image, and at its border, there is nothing to compare.
  pose.u = Eigen::Vector2f(40.F, 40.F);
  EXPECT_EQ(Patch(before, pose.u).fit(cv::Mat::zeros(80, 80, CV_8UC1), pose), -1.F);
  pose = {Eigen::Vector2f(3.F, 40.F), Eigen::Matrix2f::Identity()};
  EXPECT_EQ(Patch(before, Eigen::Vector2f(40.F, 40.F)).fit(before, pose), -1.F);
}

/// All points of an image without any so far.
std::vector<cv::Point2f> detect(const CameraView& camera, const TrackerOptions& options,
                                const Image& image, const cv::Mat& mask = {}) {
  Frame frame;
  frame.pixels = image;
  FrameMaker(options).make(frame);
  std::vector<cv::Point2f> points;
  Detector(camera, options, mask).detect(frame, points);
  return points;
}

TEST(Detector, FindsTheCornersOfSquaresToAFractionOfAPixel) {
  const TrackerOptions options;
  const auto points = detect(pinhole(320, 240), options, squares(320, 240, 40, 20));
  ASSERT_GT(points.size(), 60U);
  for (const cv::Point2f& uv : points) {
    // Edges are half way between the last black and the first white pixel, or the other way round;
    // blur moves the corner that cornerSubPix sees inwards by a fraction of its width.
    for (const float at : {uv.x, uv.y}) {
      const double rest = std::fmod(at + 0.5, 20.);
      EXPECT_LT(std::min(rest, 20. - rest), 0.2) << uv;
    }
  }
}

TEST(Detector, GivesEachCellItsShareAndKeepsPointsApart) {
  TrackerOptions options;
  options.num_pts = 60;
  options.grid_x = 4;
  options.grid_y = 3;
  const auto points = detect(pinhole(320, 240), options, squares(320, 240, 16, 8));
  EXPECT_EQ(points.size(), 60U);
  std::vector<int> counts(12, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ++counts[static_cast<std::size_t>(static_cast<int>(points[i].y) / 80 * 4 +
                                      static_cast<int>(points[i].x) / 80)];
    for (std::size_t k = 0; k < i; ++k) {
      // Corners that are moved to a fraction of a pixel may come a little nearer.
      EXPECT_GT(cv::norm(points[i] - points[k]), options.min_px_dist - 2);
    }
  }
  for (const int count : counts) EXPECT_NEAR(count, 5, 1);
}

TEST(Detector, AddsToThePointsThatAreThereOnlyWhatIsLacking) {
  TrackerOptions options;
  options.num_pts = 60;
  Frame frame;
  frame.pixels = squares(320, 240, 16, 8);
  FrameMaker(options).make(frame);
  const Detector detector(pinhole(320, 240), options, {});
  std::vector<cv::Point2f> points;
  detector.detect(frame, points);
  const std::vector<cv::Point2f> all = points;
  ASSERT_EQ(all.size(), 60U);
  detector.detect(frame, points);
  EXPECT_EQ(points, all);
  points.erase(points.begin() + 10, points.begin() + 20);
  const std::vector<cv::Point2f> left = points;
  detector.detect(frame, points);
  EXPECT_EQ(points.size(), all.size());
  EXPECT_TRUE(std::equal(left.begin(), left.end(), points.begin()));
}

TEST(Detector, LeavesOutWhatIsMasked) {
  cv::Mat mask = cv::Mat::zeros(240, 320, CV_8UC1);
  mask.colRange(100, 320).setTo(255);
  const auto points = detect(pinhole(320, 240), TrackerOptions{}, squares(320, 240, 16, 8), mask);
  EXPECT_GT(points.size(), 20U);
  for (const cv::Point2f& uv : points) EXPECT_LT(uv.x, 99.6F);
}

TEST(Detector, IsNotKeptFromWeakCornersByStrongOnesUnderAMask) {
  // GIVEN cells of 80 x 80 px, the left half of each masked and full of corners
  TrackerOptions options;
  options.num_pts = 60;
  options.grid_x = 4;
  options.grid_y = 3;
  cv::Mat mask = cv::Mat::zeros(240, 320, CV_8UC1);
  const cv::Mat image = draw(320, 240, [&](int x, int y) {
    if (x % 80 >= 40) return in_square(x, y, 16, 8) ? 150. : 100.;
    mask.at<uchar>(y, x) = 255;
    return in_square(x, y, 8, 4) ? 220. : 30.;
  });
  const auto points = detect(pinhole(320, 240), options, as_seen(image), mask);
  EXPECT_EQ(points.size(), 60U);
  for (const cv::Point2f& uv : points) EXPECT_GT(std::fmod(uv.x, 80.F), 39.4F);
}

TEST(Detector, PrefersTheBestCellsWhenThereAreMoreCellsThanPoints) {
  // GIVEN five times as many cells as points, and more contrast in the lower half of the image
  TrackerOptions options;
  options.num_pts = 20;
  options.grid_x = 10;
  options.grid_y = 10;
  const cv::Mat image = draw(320, 240, [](int x, int y) {
    return !in_square(x, y, 16, 8) ? 30. : y < 120 ? 90. : 210.;
  });
  const auto points = detect(pinhole(320, 240), options, as_seen(image));
  EXPECT_EQ(points.size(), 20U);
  for (const cv::Point2f& uv : points) EXPECT_GT(uv.y, 110.F);
}

TEST(Neighbours, AreTheNearestThreeAndOneOfThemMayBeWrong) {
  Neighbours points;
  const std::vector<float> moved{7.F, 1.F, 2.F, 90.F, 3.F};
  points.add({50.F, 0.F}, 0);
  points.add({3.F, 4.F}, 1);
  EXPECT_FALSE(points.nearest({0.F, 0.F}).has_value());
  points.add({0.F, -2.F}, 2);
  points.add({1.F, 0.F}, 3);
  points.add({0.F, 40.F}, 4);
  const auto three = points.nearest({0.F, 0.F});
  ASSERT_TRUE(three.has_value());
  EXPECT_EQ(*three, (Neighbours::Three{3, 2, 1}));
  EXPECT_EQ(median(*three, [&](std::size_t i) { return moved[i]; }), 2.F);
}

TEST(Frame, IsBlankWhenDarkOrFlatButNotWhenDim) {
  TrackerOptions options;
  Frame frame;
  FrameMaker maker(options);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0., 2.);
  const cv::Mat dark = draw(320, 240, [&](int, int) { return 3. + noise(random); });
  frame.pixels = to_image(dark);
  maker.make(frame);
  EXPECT_TRUE(frame.blank);
  const cv::Mat white = draw(320, 240, [&](int, int) { return 250. + noise(random); });
  frame.pixels = to_image(white);
  maker.make(frame);
  EXPECT_TRUE(frame.blank);
  const cv::Mat dim = draw(320, 240, [](int x, int y) { return 0.1 * texture(x, y); });
  frame.pixels = to_image(dim);
  maker.make(frame);
  EXPECT_FALSE(frame.blank);
}

TEST(Frame, EqualisationFindsPointsInADimImage) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0., 0.5);
  const Image bright = squares(320, 240, 40, 20);
  const Image dim = to_image(draw(320, 240, [&](int x, int y) {
    return 5. + bright.pixels[static_cast<std::size_t>(320 * y + x)] / 13. + noise(random);
  }));
  TrackerOptions options;
  EXPECT_EQ(detect(pinhole(320, 240), options, dim).size(), 0U);
  options.histogram_method = Histogram::kEqualize;
  EXPECT_GT(detect(pinhole(320, 240), options, dim).size(), 40U);
  options.histogram_method = Histogram::kClahe;
  EXPECT_GT(detect(pinhole(320, 240), options, dim).size(), 40U);
}

/// Tracks may come nearer to each other than points are detected.
TEST(Detector, KeepsPointsAwayFromAllTracks) {
  TrackerOptions options;
  options.num_pts = 50;
  options.grid_x = options.grid_y = 2;
  const Detector detector(pinhole(320, 240), options, {});
  Frame frame;
  frame.blank = false;
  frame.image = cv::Mat(240, 320, CV_8UC1, cv::Scalar(40));
  cv::rectangle(frame.image, {111, 100}, {150, 140}, cv::Scalar(200), cv::FILLED);
  cv::GaussianBlur(frame.image, frame.image, {5, 5}, 1.);
  const cv::Point2f near{109.2F, 100.F};  // 9.2 px from the other one, 2 from the corner
  std::vector<cv::Point2f> points{{100.F, 100.F}, near};
  detector.detect(frame, points);
  EXPECT_GT(points.size(), 2U);
  for (std::size_t i = 2; i < points.size(); ++i) {
    EXPECT_GT(std::hypot(points[i].x - near.x, points[i].y - near.y), options.min_px_dist - 2.);
  }
}

}  // namespace
}  // namespace viwo::klt
