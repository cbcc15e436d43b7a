// Rendered images against rays that are followed here, in other words and in double precision.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "some_room.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/rendering/image_renderer.hpp"

namespace viwo::rendering {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

CameraView fisheye() {
  CameraView out;
  out.distortion = CameraDistortion::kEquidistant;
  out.width_px = 424;
  out.height_px = 400;
  out.intrinsics << 141., 140.5, 208., 199., -0.003, 0.054, -0.052, 0.011;
  return out;
}

CameraView pinhole() {
  CameraView out;
  out.width_px = 320;
  out.height_px = 241;
  out.intrinsics << 230., 229., 159., 120., -0.1, 0.02, 1e-3, -5e-4;
  return out;
}

/// Level, looking along `yaw` of G.
CameraPose looking(double yaw, const Vector3d& p, double down = 0.) {
  Matrix3d forward;  // C in axes x forward, y left, z up
  forward << 0., 0., 1., -1., 0., 0., 0., -1., 0.;
  return {Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(down, Vector3d::UnitY()) *
              forward,
          p};
}

constexpr float kTexelsPerM = 100.F;
constexpr int kTexture = 256;  // hence a period of 2.56 m

/// 127 + 60 cos(4 pi x / kTexture + phase) + 50 cos(8 pi y / kTexture)
double pattern(double x, double y, double phase) {
  return 127. + 60. * std::cos(4. * M_PI * x / kTexture + phase) +
         50. * std::cos(8. * M_PI * y / kTexture);
}

Face patterned(double phase) {
  std::vector<float> grey;
  for (int y = 0; y < kTexture; ++y) {
    for (int x = 0; x < kTexture; ++x) grey.push_back(static_cast<float>(pattern(x, y, phase)));
  }
  const auto shift = static_cast<float>(10. * phase);
  return {std::make_shared<const Texture>(kTexture, grey), kTexelsPerM, shift, 2.F * shift};
}

Block block_at(const Vector3d& centre, const Vector3d& half, double yaw, double first_phase) {
  Block out;
  out.centre = centre.cast<float>();
  out.half = half.cast<float>();
  out.cosine = static_cast<float>(std::cos(yaw));
  out.sine = static_cast<float>(std::sin(yaw));
  for (std::size_t i = 0; i < 6; ++i) {
    out.faces[i] = patterned(first_phase + 0.7 * static_cast<double>(i));
  }
  return out;
}

struct Seen {
  double distance = std::numeric_limits<double>::infinity();
  int block = -1;  ///< 0: the room
  std::size_t face = 0;
  double cosine = 0.;
  Vector2d texel;
};

/// Tries the six rectangles of a block, one by one.
void look_at(const Block& block, int number, const Vector3d& p, const Vector3d& d, Seen& seen) {
  const double yaw = std::atan2(static_cast<double>(block.sine), static_cast<double>(block.cosine));
  const Matrix3d R = Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d from = R * (p - block.centre.cast<double>()), along = R * d;
  const Vector3d half = block.half.cast<double>();
  for (int a = 0; a < 3; ++a) {
    for (const int side : {-1, 1}) {
      const double t = (side * half[a] - from[a]) / along[a];
      const Vector3d at = from + t * along;
      const int b = (a + 1) % 3, c = (a + 2) % 3;
      if (!(t > 0.) || t > seen.distance) continue;
      if (std::abs(at[b]) > half[b] || std::abs(at[c]) > half[c]) continue;
      seen.distance = t;
      seen.block = number;
      seen.face = static_cast<std::size_t>(2 * a + (side > 0 ? 1 : 0));
      seen.cosine = std::abs(along[a]);
      const Face& face = block.faces[seen.face];
      seen.texel = {static_cast<double>(face.x) + at[b] * static_cast<double>(face.texels_per_m),
                    static_cast<double>(face.y) + at[c] * static_cast<double>(face.texels_per_m)};
    }
  }
}

Seen look(const TexturedRoom& room, const Vector3d& p, const Vector3d& d) {
  Seen seen;
  look_at(room.room, 0, p, d, seen);
  int number = 0;
  for (const Block& block : room.blocks) look_at(block, ++number, p, d, seen);
  return seen;
}

std::optional<Seen> look(const TexturedRoom& room, const CameraView& camera, const CameraPose& pose,
                         const Vector2d& uv) {
  const auto ray = unproject(camera, uv);
  return ray ? std::optional(look(room, pose.p_CinG, pose.R_CtoG * *ray)) : std::nullopt;
}

double grey_of(const Image& image, int u, int v) {
  return static_cast<double>(image.pixels[static_cast<std::size_t>(v * image.width_px + u)]);
}

double interpolated(const Image& image, const Vector2d& uv) {
  const int u = static_cast<int>(uv.x()), v = static_cast<int>(uv.y());
  const double a = uv.x() - u, b = uv.y() - v;
  return (1. - b) * ((1. - a) * grey_of(image, u, v) + a * grey_of(image, u + 1, v)) +
         b * ((1. - a) * grey_of(image, u, v + 1) + a * grey_of(image, u + 1, v + 1));
}

TexturedRoom patterned_room() {
  TexturedRoom room;
  room.room = block_at({0.3, -0.2, 1.}, {3., 2.5, 1.2}, 0., 0.);
  room.blocks.push_back(block_at({1.6, 0.5, 0.3}, {0.4, 0.25, 0.5}, 0.6, 5.));
  room.blocks.push_back(block_at({1.2, -1.2, 0.9}, {0.3, 0.02, 0.3}, -1.2, 10.));
  room.blocks.push_back(block_at({-1.5, 0.4, 0.2}, {0.2, 0.6, 0.4}, 2.4, 15.));
  return room;
}

TEST(ImageRenderer, ShowsTheFaceAndThePlaceThatEachRayMeets) {
  const auto room = std::make_shared<const TexturedRoom>(patterned_room());
  for (const CameraView& camera : {fisheye(), pinhole()}) {
    const ImageRenderer renderer(camera, room);
    for (const double yaw : {0.1, 1.7, -2.6}) {
      const CameraPose pose = looking(yaw, {0.1, -0.1, 0.4}, 0.1);
      Image image;
      renderer.render(pose, {}, image);
      ASSERT_EQ(image.width_px, camera.width_px);
      ASSERT_EQ(image.pixels.size(), static_cast<std::size_t>(camera.width_px * camera.height_px));
      int checked = 0, on_blocks = 0;
      for (int v = 1; v + 1 < camera.height_px; v += 3) {
        for (int u = 1; u + 1 < camera.width_px; u += 3) {
          const auto seen = look(*room, camera, pose, {u, v});
          if (!seen || seen->cosine < 0.5) continue;  // long footprints smooth the pattern
          const auto same = [&](int du, int dv) {
            const auto near = look(*room, camera, pose, {u + du, v + dv});
            return near && near->block == seen->block && near->face == seen->face;
          };
          if (!same(1, 0) || !same(-1, 0) || !same(0, 1) || !same(0, -1)) continue;
          const Block& block = seen->block == 0
                                   ? room->room
                                   : room->blocks[static_cast<std::size_t>(seen->block) - 1];
          const double phase = static_cast<double>(block.faces[seen->face].x) / 10.;
          ASSERT_NEAR(grey_of(image, u, v), pattern(seen->texel.x(), seen->texel.y(), phase), 5.)
              << u << " " << v << " block " << seen->block << " face " << seen->face;
          ++checked;
          on_blocks += seen->block > 0 ? 1 : 0;
        }
      }
      EXPECT_GT(checked, 2000);
      const bool wide = camera.distortion == CameraDistortion::kEquidistant;
      EXPECT_GT(on_blocks, wide ? 100 : -1) << yaw;
    }
  }
}

std::shared_ptr<const TexturedRoom> some_room() {
  static const auto kRoom =
      std::make_shared<const TexturedRoom>(make_room(some_options(), some_path()));
  return kRoom;
}

/// How well one image predicts another: differences of grey at the same points of the world, and
/// the mean shift in pixels that explains them best.
struct Match {
  double rms = 0.;
  double rms_shifted = 0.;  ///< one pixel beside
  Vector2d shift = Vector2d::Zero();
  int n = 0;
};

Match match(const CameraPose& first, const CameraPose& second) {
  const CameraView camera = fisheye();
  const ImageRenderer renderer(camera, some_room());
  Image a, b;
  renderer.render(first, {}, a);
  renderer.render(second, {}, b);
  Match out;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Vector2d right_side = Vector2d::Zero();
  for (int v = 20; v < camera.height_px - 20; ++v) {
    for (int u = 20; u < camera.width_px - 20; ++u) {
      const auto seen = look(*some_room(), camera, first, {u, v});
      // What is slanted or far looks different from elsewhere, smoothed differently.
      if (!seen || seen->cosine < 0.4) continue;
      const Vector3d p_G =
          first.p_CinG + seen->distance * (first.R_CtoG * *unproject(camera, Vector2d(u, v)));
      const Vector3d p_C = second.R_CtoG.transpose() * (p_G - second.p_CinG);
      Vector2d uv;
      if (!project(camera, p_C, uv) || uv.minCoeff() < 5. || uv.x() > camera.width_px - 6. ||
          uv.y() > camera.height_px - 6. || std::abs(p_C.norm() / seen->distance - 1.) > 0.15) {
        continue;
      }
      // Hidden there, or too close to an edge.
      bool hidden = false;
      for (const auto& at : {Vector2d(-2., -2.), Vector2d(2., -2.), Vector2d(-2., 2.),
                             Vector2d(2., 2.), Vector2d(0., 0.)}) {
        const auto there = look(*some_room(), camera, second, uv + at);
        hidden = hidden || !there || there->block != seen->block || there->face != seen->face;
      }
      if (hidden) continue;
      const double difference = interpolated(b, uv) - grey_of(a, u, v);
      const Vector2d gradient(
          0.5 * (interpolated(b, uv + Vector2d(1., 0.)) - interpolated(b, uv - Vector2d(1., 0.))),
          0.5 * (interpolated(b, uv + Vector2d(0., 1.)) - interpolated(b, uv - Vector2d(0., 1.))));
      normal += gradient * gradient.transpose();
      right_side -= difference * gradient;
      out.rms += difference * difference;
      const double beside = interpolated(b, uv + Vector2d(1., 0.)) - grey_of(a, u, v);
      out.rms_shifted += beside * beside;
      ++out.n;
    }
  }
  out.rms = std::sqrt(out.rms / out.n);
  out.rms_shifted = std::sqrt(out.rms_shifted / out.n);
  out.shift = normal.inverse() * right_side;
  return out;
}

TEST(ImageRenderer, OnePointOfTheWorldLooksTheSameFromTwoPlaces) {
  const CameraPose first = looking(0.2, {1., 0.1, 0.2}, 0.1);
  const CameraPose moved = looking(0.26, {1.05, 0.12, 0.22}, 0.08);
  const CameraPose beside = looking(
      0.2, Vector3d(1., 0.1, 0.2) - 0.063 * Vector3d(-std::sin(0.2), std::cos(0.2), 0.), 0.1);
  for (const CameraPose& second : {moved, beside}) {
    const Match found = match(first, second);
    EXPECT_GT(found.n, 50000);
    EXPECT_LT(found.rms, 4.);  // mostly of the interpolation here
    EXPECT_GT(found.rms_shifted, 3. * found.rms);
    EXPECT_LT(found.shift.norm(), 0.005);
  }
}

TEST(ImageRenderer, EdgesMoveSmoothlyWithTheCamera) {
  const auto plain = [](float grey) {
    Face face;
    face.texture = std::make_shared<const Texture>(8, std::vector<float>(64, grey));
    return face;
  };
  TexturedRoom room = patterned_room();
  room.blocks.resize(1);
  room.room.faces.fill(plain(50.F));
  room.blocks[0] = block_at({2., 1., 0.4}, {0.2, 1.2, 0.5}, 0., 0.);  // until y = -0.2
  room.blocks[0].faces.fill(plain(200.F));
  CameraView camera = pinhole();
  camera.intrinsics.tail<4>().setZero();
  const ImageRenderer renderer(camera, std::make_shared<const TexturedRoom>(room));
  Image image;
  double worst = 0.;
  for (int i = 0; i < 40; ++i) {
    const double y = 0.3 + 1e-3 * i;  // 0.13 px
    renderer.render(looking(0., {0., y, 0.4}), {}, image);
    // It fills the left of the row; a pixel reaches half a pixel to both sides of its centre.
    double edge = -0.5;
    for (int u = 0; u < camera.width_px; ++u) edge += (grey_of(image, u, 120) - 50.) / 150.;
    const double expected = camera.intrinsics[2] - camera.intrinsics[0] * (-0.2 - y) / 1.8;
    worst = std::max(worst, std::abs(edge - expected));
  }
  EXPECT_LT(worst, 0.075);  // a sixteenth, and rounding
}

TEST(ImageRenderer, NoiseHasItsSigmaAndFollowsFromItsSeed) {
  const CameraView camera = fisheye();
  const ImageRenderer renderer(camera, some_room());
  const CameraPose pose = looking(0.2, {1., 0.1, 0.2});
  Image clean, noisy, again, other;
  renderer.render(pose, {1., 0., 7}, clean);
  renderer.render(pose, {1., 4., 7}, noisy);
  renderer.render(pose, {1., 4., 7}, again);
  renderer.render(pose, {1., 4., 8}, other);
  EXPECT_EQ(noisy.pixels, again.pixels);
  EXPECT_NE(noisy.pixels, other.pixels);
  double mean = 0., square = 0., neighbours = 0., seeds = 0., last = 0., n = 0.;
  for (std::size_t i = 0; i < clean.pixels.size(); ++i) {
    const double value = static_cast<double>(clean.pixels[i]);
    if (value < 30. || value > 225.) continue;  // the noise could be clipped
    const double e = static_cast<double>(noisy.pixels[i]) - value;
    mean += e;
    square += e * e;
    neighbours += e * last;
    seeds += e * (static_cast<double>(other.pixels[i]) - value);
    last = e;
    n += 1.;
  }
  ASSERT_GT(n, 1e5);
  EXPECT_NEAR(mean / n, 0., 5. * 4. / std::sqrt(n));
  // Rounding of both images adds a sixth.
  EXPECT_NEAR(std::sqrt(square / n - 1. / 6.), 4., 5. * 4. / std::sqrt(2. * n));
  EXPECT_NEAR(neighbours / n, 0., 5. * 16. / std::sqrt(n));
  EXPECT_NEAR(seeds / n, 1. / 12., 5. * 16. / std::sqrt(n));  // the rounding of `clean` is in both
}

TEST(ImageRenderer, GivesTheSameBitsInEveryThread) {
  const ImageRenderer renderer(fisheye(), some_room());
  const auto pose = [](std::size_t i) {
    return looking(0.1 * static_cast<double>(i), {1., 0.1, 0.2});
  };
  std::vector<Image> alone(8), together(8);
  for (std::size_t i = 0; i < 8; ++i) renderer.render(pose(i), {1., 2., i}, alone[i]);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] { renderer.render(pose(i), {1., 2., i}, together[i]); });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(alone[i].pixels, together[i].pixels) << i;
}

TEST(ImageRenderer, RowsOfARollingShutterAreThoseOfImagesOfTheirTimes) {
  CameraView rolling = pinhole();
  rolling.line_delay_s = 5e-5;
  const ImageRenderer renderer(rolling, some_room()), global(pinhole(), some_room());
  CameraPose pose = looking(0.2, {1., 0.1, 0.2});
  Image image, other;
  renderer.render(pose, {}, image);
  global.render(pose, {}, other);
  EXPECT_EQ(image.pixels, other.pixels) << "a camera that does not move";
  pose.v_CinG = {0.5, 0.3, 0.};
  pose.w_CinC = {0.2, 1., -0.3};
  renderer.render(pose, {}, image);
  EXPECT_NE(image.pixels, other.pixels);
  for (const int row : {0, 60, 120, 200, 240}) {
    const double t_s = 5e-5 * (row - 120.);
    CameraPose then = pose;
    then.p_CinG += t_s * pose.v_CinG;
    const Vector3d turn = t_s * pose.w_CinC;
    then.R_CtoG = pose.R_CtoG * Eigen::AngleAxisd(turn.norm(), turn.normalized());
    if (row == 120) then = pose;
    global.render(then, {}, other);
    // Next to an edge its neighbours above and below are of other times.
    int different = 0;
    for (int u = 0; u < image.width_px; ++u)
      different += grey_of(image, u, row) != grey_of(other, u, row);
    EXPECT_LE(different, image.width_px / 50) << "row " << row;
  }
}

TEST(ImageRenderer, PixelsWithoutARayAreBlack) {
  CameraView camera = fisheye();
  camera.intrinsics.tail<4>() << -0.2, 0., 0., 0.;  // folds back at 1.29 rad
  const ImageRenderer renderer(camera, some_room());
  Image image;
  renderer.render(looking(0.2, {1., 0.1, 0.2}), {1., 30., 1}, image);
  const double edge = 140. * std::sqrt(1. / 0.6) * (2. / 3.);
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const double r = std::hypot(u - 208., v - 199.);
      if (r <= edge + 2.) continue;
      ASSERT_EQ(grey_of(image, u, v), 0.) << u << " " << v;
    }
  }
  EXPECT_GT(grey_of(image, 208, 199), 0.);
  int lit = 0;
  for (const std::uint8_t value : image.pixels) lit += value > 0 ? 1 : 0;
  EXPECT_GT(lit, 0.9 * M_PI * std::pow(edge - 12., 2));
}

TEST(ImageRenderer, VignettingDarkensTheCornersAndGainEverything) {
  TexturedRoom room = patterned_room();
  Face plain;
  plain.texture = std::make_shared<const Texture>(8, std::vector<float>(64, 100.F));
  room.room.faces.fill(plain);
  room.blocks.clear();
  CameraView camera = pinhole();
  camera.width_px = 321;
  const ImageRenderer renderer(camera, std::make_shared<const TexturedRoom>(room), 0.4);
  Image image;
  renderer.render(looking(0., {0., 0., 0.5}), {2., 0., 0}, image);
  EXPECT_EQ(grey_of(image, 160, 120), 200.);
  EXPECT_EQ(grey_of(image, 0, 0), 120.);
  EXPECT_EQ(grey_of(image, 320, 240), 120.);
  EXPECT_NEAR(grey_of(image, 0, 120), 200. * (1. - 0.4 * 160. * 160. / (160. * 160. + 120. * 120.)),
              1.);
}

}  // namespace
}  // namespace viwo::rendering
