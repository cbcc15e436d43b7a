// What is drawn where, against places computed here.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "canvas.hpp"
#include "message_of.hpp"
#include "viwo/view/scene.hpp"

namespace viwo::view {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr PictureSize kSize;

cv::Vec3b colour(const cv::Scalar& scalar) {
  return {cv::saturate_cast<uchar>(scalar[0]), cv::saturate_cast<uchar>(scalar[1]),
          cv::saturate_cast<uchar>(scalar[2])};
}

/// Pixel of a part of a picture.
cv::Vec3b at(const Picture& picture, const cv::Rect& area, int x, int y) {
  return as_mat(picture).at<cv::Vec3b>(area.y + y, area.x + x);
}

/// The colour of a thin line, of which some goes to the pixels beside it.
bool is_line(const cv::Vec3b& pixel, const cv::Scalar& scalar) {
  return cv::norm(pixel, colour(scalar), cv::NORM_INF) <= 60.;
}

/// A point that has been seen `images` times at the same place, but for the steps of its trail.
Track track(std::int64_t id, int images, std::vector<TrailPoint> trail) {
  return {id, images, std::move(trail)};
}

CameraImage camera(std::vector<Track> tracks, const Image* pixels = nullptr) {
  CameraImage image;
  image.name = "cam0";
  image.width_px = 640;
  image.height_px = 480;
  image.pixels = pixels;
  image.tracks = std::move(tracks);
  return image;
}

Scene scene_of(std::vector<CameraImage> cameras) {
  Scene scene;
  scene.cameras = std::move(cameras);
  return scene;
}

/// Where a pixel of a 640 x 480 image is in the area that shows it.
cv::Point place(const cv::Rect& area, double u, double v) {
  return {static_cast<int>(std::lround((u + 0.5) * area.width / 640. - 0.5)),
          static_cast<int>(std::lround((v + 0.5) * area.height / 480. - 0.5))};
}

/// Below the name of the camera.
constexpr int kBelowText = 22;

bool is_dark_field(const Picture& picture, const cv::Rect& area) {
  for (int y = kBelowText; y < area.height; ++y) {
    for (int x = 0; x < area.width; ++x) {
      if (at(picture, area, x, y) != colour(kDarkField)) return false;
    }
  }
  return true;
}

TEST(Draw, PutsAPointWhereItIsInTheImageInTheColourOfItsLength) {
  for (const int images : {1, 14, 40, 4000}) {
    const Scene scene = scene_of({camera({track(7, images, {{500., 100.}})})});
    const cv::Rect area = layout_of(scene, kSize).cameras.at(0);
    EXPECT_NEAR(static_cast<double>(area.width) / area.height, 640. / 480., 0.01);
    const Picture picture = draw(scene);
    const cv::Point p = place(area, 500., 100.);
    EXPECT_EQ(at(picture, area, p.x, p.y), colour(track_colour(images))) << images;
    EXPECT_EQ(at(picture, area, p.x + 12, p.y), colour(kDarkField));
  }
  EXPECT_EQ(colour(track_colour(kLongTrack)), cv::Vec3b(60, 60, 255)) << "red";
  EXPECT_EQ(track_colour(4000), track_colour(kLongTrack));
  EXPECT_EQ(colour(track_colour(1)), cv::Vec3b(255, 150, 60)) << "blue";
}

TEST(Draw, ShowsTheWayOfAPointOverTheLastImages) {
  const Scene scene = scene_of({camera({track(1, 3, {{100., 300.}, {300., 300.}, {500., 300.}})})});
  const cv::Rect area = layout_of(scene, kSize).cameras.at(0);
  const Picture picture = draw(scene);
  for (const double u : {150., 250., 350., 450.}) {
    const cv::Point p = place(area, u, 300.);
    EXPECT_TRUE(is_line(at(picture, area, p.x, p.y), track_colour(3))) << u;
    EXPECT_EQ(at(picture, area, p.x, p.y + 8), colour(kDarkField)) << u;
  }
}

TEST(Draw, LeavesOutPointsThatAreOutsideOfTheImageOrNotFinite) {
  const Scene scene = scene_of({camera(
      {track(1, 1, {{-3., 100.}}), track(2, 1, {{640., 100.}}), track(3, 1, {{100., -3.}}),
       track(4, 1, {{100., 480.}}), track(5, 1, {{kNaN, 100.}}), track(6, 1, {{1e300, -1e300}}),
       track(7, 2, {{-1e9, 240.}, {1e9, 240.}}), track(8, 0, {})})});
  EXPECT_TRUE(is_dark_field(draw(scene), layout_of(scene, kSize).cameras.at(0)));
}

TEST(Draw, RingsThePointsThatTwoCamerasSee) {
  const Scene scene =
      scene_of({camera({track(1, 1, {{200., 200.}}), track(2, 1, {{400., 200.}})}),
                camera({track(1, 1, {{210., 200.}}), track(3, 1, {{400., 200.}})})});
  const Layout layout = layout_of(scene, kSize);
  const Picture picture = draw(scene);
  const auto has_ring = [&](std::size_t i, double u) {
    const cv::Point p = place(layout.cameras.at(i), u, 200.);
    return is_line(at(picture, layout.cameras[i], p.x + 5, p.y), kText);
  };
  EXPECT_TRUE(has_ring(0, 200.));
  EXPECT_FALSE(has_ring(0, 400.));
  EXPECT_TRUE(has_ring(1, 210.));
  EXPECT_FALSE(has_ring(1, 400.));
}

TEST(Draw, ShowsThePixelsBehindThePoints) {
  Image image{640, 480, std::vector<std::uint8_t>(640 * 480, 200)};
  for (std::size_t v = 0; v < 240; ++v) {  // the upper left quarter is dark
    std::fill_n(image.pixels.begin() + static_cast<std::ptrdiff_t>(640 * v), 320, std::uint8_t{30});
  }
  const Scene scene = scene_of({camera({}, &image)});
  const cv::Rect area = layout_of(scene, kSize).cameras.at(0);
  const Picture picture = draw(scene);
  const auto shown = [&](double u, double v) {
    const cv::Point p = place(area, u, v);
    return at(picture, area, p.x, p.y);
  };
  EXPECT_EQ(shown(160., 120.), cv::Vec3b(30, 30, 30));
  EXPECT_EQ(shown(480., 120.), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(shown(160., 360.), cv::Vec3b(200, 200, 200));
}

TEST(Draw, ScalesAnImageByItsOwnSizeWhenTheCameraIsSaidToHaveAnother) {
  const Image half{320, 240, std::vector<std::uint8_t>(320 * 240, 10)};
  const Scene scene = scene_of({camera({track(1, 40, {{250., 50.}})}, &half)});
  const cv::Rect area = layout_of(scene, kSize).cameras.at(0);
  const cv::Point p = place(area, 500.5, 100.5);  // twice as fine
  EXPECT_EQ(at(draw(scene), area, p.x, p.y), colour(track_colour(40)));
}

TEST(Draw, TakesAnImageWithoutAllOfItsPixelsForNone) {
  const Image empty;
  const Image cut{640, 480, std::vector<std::uint8_t>(1000, 255)};
  for (const Image* image : {&empty, &cut}) {
    const Scene scene = scene_of({camera({}, image)});
    EXPECT_TRUE(is_dark_field(draw(scene), layout_of(scene, kSize).cameras.at(0)));
  }
}

TEST(Draw, GivesTheTrajectoryTheWholeWidthWithoutCameras) {
  const Layout layout = layout_of({}, kSize);
  EXPECT_TRUE(layout.cameras.empty());
  EXPECT_TRUE(layout.curves.empty());
  EXPECT_GT(layout.trajectory.width, 1260);
  EXPECT_GT(layout.trajectory.height, 680);
  const Picture picture = draw(Scene{});
  EXPECT_EQ(picture.bgr.size(), 3U * 1280U * 720U);
}

TEST(Draw, KeepsAllPartsApartAndInsideOfThePicture) {
  for (const std::size_t n_cameras : {1U, 2U, 3U, 4U, 8U}) {
    for (const std::size_t n_curves : {0U, 1U, 3U, 8U}) {
      Scene scene;
      scene.cameras.assign(n_cameras, camera({}));
      scene.curves.resize(n_curves);
      const Layout layout = layout_of(scene, kSize);
      std::vector<cv::Rect> parts{layout.header, layout.trajectory};
      parts.insert(parts.end(), layout.cameras.begin(), layout.cameras.end());
      parts.insert(parts.end(), layout.curves.begin(), layout.curves.end());
      ASSERT_EQ(parts.size(), 2 + n_cameras + n_curves);
      for (std::size_t i = 0; i < parts.size(); ++i) {
        EXPECT_EQ(parts[i] & cv::Rect(0, 0, 1280, 720), parts[i]);
        EXPECT_GT(parts[i].area(), 0);
        for (std::size_t k = 0; k < i; ++k) EXPECT_EQ((parts[i] & parts[k]).area(), 0);
      }
    }
  }
}

TEST(Draw, ShowsTheGroundToOneScaleWithXToTheRightAndYUp) {
  Scene scene;
  scene.paths = {{"estimate", false, {{0., 0.}, {0., 4.}, {2., 4.}}}};
  scene.body = Body{{2., 4.}, 0.};
  const cv::Rect area = layout_of(scene, kSize).trajectory;
  const double px_per_m = (area.height - 2 * 34) / 4.;  // higher than wide
  const auto pixel = [&](double x, double y) {
    return cv::Point(static_cast<int>(std::lround(0.5 * area.width + (x - 1.) * px_per_m)),
                     static_cast<int>(std::lround(0.5 * area.height - (y - 2.) * px_per_m)));
  };
  const Picture picture = draw(scene);
  for (const auto& [x, y] : {std::pair{0., 1.}, {0., 3.}, {1., 4.}}) {
    const cv::Point p = pixel(x, y);
    EXPECT_EQ(at(picture, area, p.x, p.y), colour(kEstimate)) << x << " " << y;
  }
  const cv::Point away = pixel(2., 1.), body = pixel(2., 4.);
  EXPECT_EQ(at(picture, area, away.x, away.y), colour(kBackground));
  EXPECT_EQ(at(picture, area, body.x, body.y), colour(kText));
  EXPECT_TRUE(is_line(at(picture, area, body.x + 12, body.y), kText)) << "looks along x";
  EXPECT_EQ(at(picture, area, body.x, body.y - 12), colour(kBackground));

  // The largest of 1, 2, 5, ... m that is at most 35 % of the width: 2 m.
  const int bar = static_cast<int>(std::lround(2. * px_per_m)), row = area.height - 12;
  ASSERT_LT(2. * px_per_m, 0.35 * area.width);
  ASSERT_GT(5. * px_per_m, 0.35 * area.width);
  EXPECT_EQ(at(picture, area, 10, row), colour(kText));
  EXPECT_EQ(at(picture, area, 10 + bar, row), colour(kText));
  EXPECT_EQ(at(picture, area, 10 + bar + 3, row), colour(kBackground));
}

TEST(Draw, LeavesOutWhatIsNotFiniteOnTheGround) {
  Scene scene;
  scene.paths = {{"estimate", false, {{0., 0.}, {kNaN, 1.}, {0., 4.}}}};
  scene.body = Body{{kNaN, 0.}, 0.};
  const cv::Rect area = layout_of(scene, kSize).trajectory;
  const Picture picture = draw(scene);
  EXPECT_EQ(at(picture, area, area.width / 2, area.height / 2), colour(kBackground));
}

TEST(Draw, ShowsACurveWithItsBandAndTheEndOfItLarge) {
  Scene scene;
  Curve curve{"r_1", {}, {}, {}, {}};
  for (int i = 0; i <= 100; ++i) {
    const bool late = i >= 20;  // before that everything is a hundred times as large
    curve.x.push_back(0.1 * i);
    curve.y.push_back(late ? 1. : 100.);
    curve.low.push_back(late ? -2. : -200.);
    curve.high.push_back(late ? 2. : 200.);
  }
  scene.curves = {curve};
  const cv::Rect area = layout_of(scene, kSize).curves.at(0);
  const Picture picture = draw(scene);
  const double range = 1.15 * 2., height = area.height - 26 - 1;
  const auto row = [&](double y) {
    return static_cast<int>(std::lround(20. + 0.5 * (1. - y / range) * height));
  };
  const int x = 3 * area.width / 5;
  EXPECT_TRUE(is_line(at(picture, area, x, row(1.)), kEstimate));
  EXPECT_EQ(at(picture, area, x, row(0.)), colour(kReference));
  EXPECT_EQ(at(picture, area, x, row(1.5)), colour(kBand));
  EXPECT_EQ(at(picture, area, x, row(-1.5)), colour(kBand));
  EXPECT_EQ(at(picture, area, x, row(2.2)), colour(kBackground));
  EXPECT_EQ(at(picture, area, x, row(-2.2)), colour(kBackground));
}

TEST(Draw, TakesCurvesOfNoneOneAndNotFinitePoints) {
  Scene scene;
  scene.curves = {{"none", {}, {}, {}, {}},
                  {"one", {1.}, {2.}, {1.}, {3.}},
                  {"same time", {1., 1.}, {2., 2.}, {1., 1.}, {3., 3.}},
                  {"NaN", {0., 1., 2.}, {kNaN, kNaN, kNaN}, {kNaN, 1., 1.}, {1., kNaN, 1.}},
                  {"zero", {0., 1.}, {0., 0.}, {0., 0.}, {0., 0.}},
                  {"huge", {0., 1.}, {1e300, -1e300}, {-1e300, -1e300}, {1e300, 1e300}}};
  EXPECT_EQ(draw(scene).bgr.size(), 3U * 1280U * 720U);
}

TEST(Draw, RefusesSizesThatDoNotFit) {
  const auto refusal = [](const Scene& scene, PictureSize size) {
    return testing::error_of<std::invalid_argument>([&] { draw(scene, size); });
  };
  EXPECT_EQ(refusal({}, {319, 720}), "view: a picture has at least 320 x 240 pixels");
  EXPECT_EQ(refusal({}, {320, 240}), "");
  Scene scene;
  scene.curves = {{"r_1", {0., 1.}, {0., 1.}, {0., 1.}, {0.}}};
  EXPECT_EQ(refusal(scene, kSize), "view: sizes of the curve 'r_1' do not fit");
}

TEST(Draw, GivesTheSamePictureForTheSameScene) {
  Scene scene = scene_of({camera({track(1, 5, {{10., 20.}, {30., 40.}})})});
  scene.status = "12.3 s";
  const Picture first = draw(scene);
  EXPECT_EQ(first.bgr, draw(scene).bgr);
  scene.status = "12.4 s";
  EXPECT_NE(first.bgr, draw(scene).bgr);
}

TEST(EncodePng, KeepsEveryPixel) {
  const Picture picture = draw(scene_of({camera({track(1, 5, {{10., 20.}, {300., 400.}})})}));
  const std::string png = encode_png(picture);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  const cv::Mat decoded =
      cv::imdecode(std::vector<uchar>(png.begin(), png.end()), cv::IMREAD_COLOR);
  ASSERT_EQ(decoded.size(), cv::Size(1280, 720));
  EXPECT_EQ(cv::norm(decoded, as_mat(picture), cv::NORM_INF), 0.);
  EXPECT_THROW(encode_png({}), std::invalid_argument);
}

TEST(Tracks, CountImagesInARowAndKeepTheLastPlaces) {
  Tracks tracks;
  for (int i = 0; i < 15; ++i) {
    std::vector<FeaturePoint> points{{9, 1. * i, 2. * i}};  // ids in any order
    if (i != 12) points.push_back({4, 5., 6.});
    tracks.add(points);
  }
  ASSERT_EQ(tracks.tracks().size(), 2U);
  const Track &lost = tracks.tracks()[0], &kept = tracks.tracks()[1];
  EXPECT_EQ(lost.id, 4);
  EXPECT_EQ(lost.images, 2) << "since it was lost";
  EXPECT_EQ(lost.trail.size(), 2U);
  EXPECT_EQ(kept.id, 9);
  EXPECT_EQ(kept.images, 15);
  ASSERT_EQ(kept.trail.size(), kTrailImages);
  EXPECT_EQ(kept.trail.front().u_px, 5.);
  EXPECT_EQ(kept.trail.back().u_px, 14.);
  EXPECT_EQ(kept.trail.back().v_px, 28.);
  tracks.add({});
  EXPECT_TRUE(tracks.tracks().empty());
}

TEST(RecentImages, MakeTheTracksOfAllImagesButForTheCountOfLongOnes) {
  Tracks all;
  RecentImages recent;
  EXPECT_TRUE(recent.points().empty());
  EXPECT_TRUE(recent.tracks().tracks().empty());
  for (int i = 0; i < 100; ++i) {
    // One is always there, others come for i, 7 or 50 images.
    std::vector<FeaturePoint> points{{1000, 1. * i, 2. * i}, {2000 + i / 7, 3. * i, i % 5 * 1.}};
    points.push_back({3000 + i / 50, 4. * i, 5.});
    points.push_back({i, 5., 6.});
    all.add(points);
    recent.add(points);
    EXPECT_EQ(recent.points().size(), points.size());
    const Tracks made = recent.tracks();
    ASSERT_EQ(made.tracks().size(), all.tracks().size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Track &expected = all.tracks()[k], &track = made.tracks()[k];
      EXPECT_EQ(track.id, expected.id);
      EXPECT_EQ(track.images, std::min(expected.images, kLongTrack));
      ASSERT_EQ(track.trail.size(), expected.trail.size());
      for (std::size_t n = 0; n < track.trail.size(); ++n) {
        EXPECT_EQ(track.trail[n].u_px, expected.trail[n].u_px);
        EXPECT_EQ(track.trail[n].v_px, expected.trail[n].v_px);
      }
    }
  }
}

}  // namespace
}  // namespace viwo::view
