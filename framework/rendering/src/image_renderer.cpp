#include "viwo/rendering/image_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <random>

#include <Eigen/LU>

#include "normal_table.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::rendering {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kTile = 16;
/// Below it a ray runs along a face and never meets it.
constexpr float kParallel = 1e-9F;

/// A block as a camera at one place sees it.
struct SeenBlock {
  const Block* block = nullptr;
  Vector3f p_CinB = Vector3f::Zero();      ///< the camera in the axes of the block, m
  Vector3f direction = Vector3f::UnitX();  ///< from the camera to the centre, in G
  float half_angle = 0.F;                  ///< of the sphere around it, rad
};

/// Where a ray meets a block.
struct Hit {
  const SeenBlock* on = nullptr;
  float distance = std::numeric_limits<float>::infinity();
  Vector3f d = Vector3f::Zero();  ///< direction of the ray in the axes of the block
  int axis = 0;
};

Vector3f turn(const Block& block, const Vector3f& v) {
  return {block.cosine * v.x() + block.sine * v.y(), block.cosine * v.y() - block.sine * v.x(),
          v.z()};
}

SeenBlock see(const Block& block, const Vector3f& p_CinG) {
  const Vector3f to_centre = block.centre - p_CinG;
  const float distance = to_centre.norm();
  const float radius = block.half.norm();
  // Within the sphere the block may be in any direction.
  const float half_angle =
      distance > radius ? std::asin(radius / distance) : static_cast<float>(M_PI);
  return {&block, -turn(block, to_centre), to_centre / std::max(distance, 1e-6F), half_angle};
}

/// 1 / d of a direction, also where it runs along an axis.
Vector3f inverse_of(const Vector3f& d) {
  const auto invert = [](float x) {
    return 1.F / (std::abs(x) < kParallel ? std::copysign(kParallel, x) : x);
  };
  return {invert(d.x()), invert(d.y()), invert(d.z())};
}

/// (IMG-1), from inside: the first wall.
Hit leave(const SeenBlock& room, const Vector3f& d_G) {
  Hit hit{&room, std::numeric_limits<float>::infinity(), turn(*room.block, d_G), 0};
  const Vector3f inverse = inverse_of(hit.d);
  for (int i = 0; i < 3; ++i) {
    const float t = (std::copysign(room.block->half[i], hit.d[i]) - room.p_CinB[i]) * inverse[i];
    if (t < hit.distance) {
      hit.distance = t;
      hit.axis = i;
    }
  }
  return hit;
}

/// (IMG-2), from outside: the last of the three faces that the ray passes, if it is inside of the
/// others by then.
void enter(const SeenBlock& seen, const Vector3f& d_G, Hit& hit) {
  const Vector3f d = turn(*seen.block, d_G);
  const Vector3f inverse = inverse_of(d);
  float in = 0.F, out = hit.distance;
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    const float reach = seen.block->half[i] * std::abs(inverse[i]);
    const float middle = -seen.p_CinB[i] * inverse[i];
    if (middle - reach > in) {
      in = middle - reach;
      axis = i;
    }
    out = std::min(out, middle + reach);
  }
  if (in > 0.F && in < out) hit = {&seen, in, d, axis};
}

/// What is painted where the ray ends.
float grey_at(const Hit& hit, float angle, bool inside) {
  const int a = hit.axis, b = (a + 1) % 3, c = (a + 2) % 3;
  const bool positive = (hit.d[a] > 0.F) == inside;
  const Face& face = hit.on->block->faces[static_cast<std::size_t>(2 * a + (positive ? 1 : 0))];
  const Vector3f p = hit.on->p_CinB + hit.distance * hit.d;
  const float across = angle * hit.distance * face.texels_per_m;
  const float cosine = std::max(std::abs(hit.d[a]), 1e-4F);
  // The footprint of a pixel is long where the ray goes along the face.
  const float slant = std::sqrt(std::max(1.F - cosine * cosine, 1e-12F));
  return face.texture->grey(face.x + p[b] * face.texels_per_m, face.y + p[c] * face.texels_per_m,
                            across, across / cosine, hit.d[b] / slant, hit.d[c] / slant);
}

/// At edges a pixel is the mean of these places, in pixels (IMG-6). With those of its neighbours
/// they are evenly spaced, so an edge that moves changes the image evenly.
constexpr std::array<std::array<float, 2>, 8> kEdgeSamples{{{-0.6875F, 0.0625F},
                                                            {-0.4375F, -0.4375F},
                                                            {-0.1875F, 0.6875F},
                                                            {-0.0625F, -0.1875F},
                                                            {0.0625F, 0.4375F},
                                                            {0.1875F, -0.6875F},
                                                            {0.4375F, 0.1875F},
                                                            {0.6875F, -0.0625F}}};

}  // namespace

/// One image at work.
class ImageRenderer::Painter {
 public:
  explicit Painter(const ImageRenderer& renderer)
      : rays_(renderer.rays_),
        width_(renderer.camera_.width_px),
        height_(renderer.camera_.height_px),
        world_(*renderer.room_),
        grey_(rays_.size(), 0.F),
        faces_(rays_.size(), kNothing) {}

  void move(const CameraPose& pose) {
    const Vector3f p_CinG = pose.p_CinG.cast<float>();
    R_CtoG_ = pose.R_CtoG.cast<float>();
    room_ = see(world_.room, p_CinG);
    blocks_.clear();
    for (const Block& block : world_.blocks) blocks_.push_back(see(block, p_CinG));
  }
  void paint(const Tile& tile);
  /// After all tiles have been painted.
  void smooth_edges(const Tile& tile);
  const std::vector<float>& grey() const { return grey_; }

 private:
  static constexpr int kNothing = -1;

  template <class Act>
  void each_pixel(const Tile& tile, const Act& act) const {
    for (int v = tile.y; v < tile.y + tile.height; ++v) {
      for (int u = tile.x; u < std::min(tile.x + kTile, width_); ++u) {
        const auto i = static_cast<std::size_t>(v * width_ + u);
        if (rays_[i].angle > 0.F) act(u, v, i);
      }
    }
  }
  void find_near(const Tile& tile);
  Hit trace(const Vector3f& d_C) const;
  int face_of(const Hit& hit) const;
  float grey_of(const Hit& hit, const Ray& ray) const {
    return grey_at(hit, ray.angle, hit.on == &room_);
  }
  /// The mean of several rays of a pixel: each face that they meet is looked up once, in the
  /// middle.
  float mean_grey(const Ray& ray, const Vector3f& right, const Vector3f& down) const;
  bool at_edge(int u, int v, std::size_t i) const;
  /// How the direction changes to the next pixel, `step` away.
  Vector3f slope(std::size_t i, std::size_t step, bool has_before, bool has_after) const;

  const std::vector<Ray>& rays_;
  const int width_, height_;
  const TexturedRoom& world_;
  Matrix3f R_CtoG_ = Matrix3f::Identity();
  SeenBlock room_;
  std::vector<SeenBlock> blocks_;
  std::vector<const SeenBlock*> near_;  ///< what the rays of the tile at work may meet
  std::vector<float> grey_;
  std::vector<int> faces_;  ///< which face a pixel shows
};

void ImageRenderer::Painter::find_near(const Tile& tile) {
  const Vector3f axis = R_CtoG_ * tile.axis;
  near_.clear();
  for (const SeenBlock& seen : blocks_) {
    const float angle = seen.half_angle + tile.half_angle;
    if (angle > static_cast<float>(M_PI) || axis.dot(seen.direction) > std::cos(angle)) {
      near_.push_back(&seen);
    }
  }
}

Hit ImageRenderer::Painter::trace(const Vector3f& d_C) const {
  const Vector3f d_G = R_CtoG_ * d_C;
  Hit hit = leave(room_, d_G);
  for (const SeenBlock* seen : near_) enter(*seen, d_G, hit);
  return hit;
}

int ImageRenderer::Painter::face_of(const Hit& hit) const {
  const auto block = hit.on == &room_ ? 0 : static_cast<int>(hit.on - blocks_.data()) + 1;
  return 6 * block + 2 * hit.axis + (hit.d[hit.axis] > 0.F ? 1 : 0);
}

void ImageRenderer::Painter::paint(const Tile& tile) {
  find_near(tile);
  each_pixel(tile, [&](int, int, std::size_t i) {
    const Ray& ray = rays_[i];
    const Hit hit = trace({ray.x, ray.y, ray.z});
    faces_[i] = face_of(hit);
    grey_[i] = ray.gain * grey_of(hit, ray);
  });
}

bool ImageRenderer::Painter::at_edge(int u, int v, std::size_t i) const {
  const auto row = static_cast<std::size_t>(width_);
  const auto differs = [&](std::size_t k) {
    return faces_[k] != kNothing && faces_[k] != faces_[i];
  };
  return (u > 0 && differs(i - 1)) || (u + 1 < width_ && differs(i + 1)) ||
         (v > 0 && differs(i - row)) || (v + 1 < height_ && differs(i + row));
}

Vector3f ImageRenderer::Painter::slope(std::size_t i, std::size_t step, bool has_before,
                                       bool has_after) const {
  const auto at = [&](std::size_t k) { return Vector3f(rays_[k].x, rays_[k].y, rays_[k].z); };
  const bool before = has_before && rays_[i - step].angle > 0.F;
  const bool after = has_after && rays_[i + step].angle > 0.F;
  if (before && after) return 0.5F * (at(i + step) - at(i - step));
  if (after) return at(i + step) - at(i);
  if (before) return at(i) - at(i - step);
  return Vector3f::Zero();
}

float ImageRenderer::Painter::mean_grey(const Ray& ray, const Vector3f& right,
                                        const Vector3f& down) const {
  struct Share {
    Hit sum;
    int face = kNothing;
    float n = 0.F;
  };
  std::array<Share, kEdgeSamples.size()> shares;
  for (const auto& at : kEdgeSamples) {
    const Hit hit = trace(Vector3f(ray.x, ray.y, ray.z) + at[0] * right + at[1] * down);
    const int face = face_of(hit);
    Share* share = shares.data();
    while (share->face != face && share->face != kNothing) ++share;
    if (share->face == kNothing) {
      *share = {hit, face, 1.F};
      continue;
    }
    share->sum.distance += hit.distance;
    share->sum.d += hit.d;
    share->n += 1.F;
  }
  float sum = 0.F;
  for (Share& share : shares) {
    if (share.face == kNothing) break;
    share.sum.distance /= share.n;
    share.sum.d /= share.n;
    sum += share.n * grey_of(share.sum, ray);
  }
  return sum / static_cast<float>(kEdgeSamples.size());
}

void ImageRenderer::Painter::smooth_edges(const Tile& tile) {
  bool looked = false;
  each_pixel(tile, [&](int u, int v, std::size_t i) {
    if (!at_edge(u, v, i)) return;
    if (!looked) find_near(tile);
    looked = true;
    const Ray& ray = rays_[i];
    const Vector3f right = slope(i, 1, u > 0, u + 1 < width_);
    const Vector3f down = slope(i, static_cast<std::size_t>(width_), v > 0, v + 1 < height_);
    grey_[i] = ray.gain * mean_grey(ray, right, down);
  });
}

ImageRenderer::ImageRenderer(const CameraView& camera, std::shared_ptr<const TexturedRoom> room,
                             double vignette)
    : camera_(camera), room_(std::move(room)) {
  make_rays(vignette);
  make_tiles();
}

void ImageRenderer::make_rays(double vignette) {
  const Vector2d middle(0.5 * (camera_.width_px - 1), 0.5 * (camera_.height_px - 1));
  rays_.resize(static_cast<std::size_t>(camera_.width_px) *
               static_cast<std::size_t>(camera_.height_px));
  std::size_t i = 0;
  for (int v = 0; v < camera_.height_px; ++v) {
    for (int u = 0; u < camera_.width_px; ++u, ++i) {
      const std::optional<Vector3d> ray = unproject(camera_, Vector2d(u, v));
      Vector2d uv;
      PixelJacobian J;
      if (!ray || !project(camera_, *ray, uv, J)) continue;
      // The pixel's larger extent: over the smaller singular value of J, whose third, along the
      // ray, is zero.
      const Eigen::Matrix2d JJ = J * J.transpose();
      const double mean = 0.5 * JJ.trace();
      const double smaller = mean - std::sqrt(std::max(mean * mean - JJ.determinant(), 0.));
      if (!(smaller > 1.)) continue;  // a pixel of more than a radian: the edge of the model
      const double gain = 1. - vignette * (uv - middle).squaredNorm() / middle.squaredNorm();
      rays_[i] = {static_cast<float>(ray->x()), static_cast<float>(ray->y()),
                  static_cast<float>(ray->z()), static_cast<float>(1. / std::sqrt(smaller)),
                  static_cast<float>(gain)};
    }
  }
}

void ImageRenderer::make_tiles() {
  // The rows of a tile are exposed at once.
  const int rows = camera_.line_delay_s > 0. ? 1 : kTile;
  for (int y = 0; y < camera_.height_px; y += rows) {
    for (int x = 0; x < camera_.width_px; x += kTile) {
      Tile tile{x, y, std::min(rows, camera_.height_px - y)};
      Vector3f sum = Vector3f::Zero();
      const auto each = [&](const auto& act) {
        for (int v = y; v < y + tile.height; ++v) {
          for (int u = x; u < std::min(x + kTile, camera_.width_px); ++u) {
            const Ray& ray = rays_[static_cast<std::size_t>(v * camera_.width_px + u)];
            if (ray.angle > 0.F) act(Vector3f(ray.x, ray.y, ray.z), ray.angle);
          }
        }
      };
      float angle = 0.F, cosine = 1.F;
      each([&](const Vector3f& d, float extent) {
        sum += d;
        angle = std::max(angle, extent);
      });
      if (!(angle > 0.F)) continue;  // no rays
      tile.axis = sum.normalized();
      each([&](const Vector3f& d, float) { cosine = std::min(cosine, d.dot(tile.axis)); });
      // Rays beside the outermost ones, and what float rounding of the cosine can hide.
      tile.half_angle = std::acos(std::clamp(cosine, -1.F, 1.F)) + angle + 1e-3F;
      tiles_.push_back(tile);
    }
  }
}

CameraPose CameraPose::after(double dt_s) const {
  CameraPose pose = *this;
  pose.R_CtoG = R_CtoG * exp_so3(dt_s * w_CinC);
  pose.p_CinG += dt_s * v_CinG;
  return pose;
}

template <class Act>
void ImageRenderer::each_tile(const CameraPose& pose, Painter& painter, const Act& act) const {
  const bool rolling = camera_.line_delay_s > 0.;
  int row = -1;
  painter.move(pose);
  for (const Tile& tile : tiles_) {
    if (rolling && tile.y != row) painter.move(pose.after(camera_.after_middle_s(tile.y)));
    row = tile.y;
    act(tile);
  }
}

void ImageRenderer::render(const CameraPose& pose, const Exposure& exposure, Image& out) const {
  Painter painter(*this);
  each_tile(pose, painter, [&](const Tile& tile) { painter.paint(tile); });
  each_tile(pose, painter, [&](const Tile& tile) { painter.smooth_edges(tile); });
  out.width_px = camera_.width_px;
  out.height_px = camera_.height_px;
  out.pixels.resize(rays_.size());
  static const NormalTable kNormal;
  std::mt19937_64 random(exposure.seed);
  const auto gain = static_cast<float>(exposure.gain);
  const auto sigma = static_cast<float>(exposure.noise_sigma);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    // Every pixel takes its draw, whether it has a ray or not (IMG-7).
    bits = i % 5 == 0 ? random() : bits >> NormalTable::kBits;
    const float value = gain * painter.grey()[i] + sigma * kNormal[bits];
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): it is positive
    const auto grey = static_cast<std::uint8_t>(std::clamp(value, 0.F, 255.F) + 0.5F);
    out.pixels[i] = rays_[i].angle > 0.F ? grey : std::uint8_t{0};
  }
}

}  // namespace viwo::rendering
