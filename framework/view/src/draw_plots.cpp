// The trajectory from above, and curves over time.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "canvas.hpp"

namespace viwo::view {
namespace {

constexpr int kMargin = 34;
constexpr double kLeastSpan_m = 1.;
/// Further away nothing is drawn right: OpenCV counts in 16 bits of a pixel.
constexpr double kFarthest_px = 30000.;

int to_pixel(double value) {
  return static_cast<int>(std::lround(std::clamp(value, -kFarthest_px, kFarthest_px)));
}

/// Metres on the ground to pixels: x to the right, y up, to one scale.
class GroundView {
 public:
  GroundView(const Scene& scene, const cv::Mat& area) : area_(area.size()) {
    const double inf = std::numeric_limits<double>::infinity();
    Eigen::Array2d low(inf, inf), high(-inf, -inf);
    const auto include = [&](const Eigen::Vector2d& p) {
      if (!p.allFinite()) return;
      low = low.min(p.array());
      high = high.max(p.array());
    };
    for (const Path& path : scene.paths) {
      for (const Eigen::Vector2d& p : path.points_m) include(p);
    }
    if (scene.body) include(scene.body->p_m);
    if (!(low <= high).all()) low = high = Eigen::Array2d::Zero();
    middle_ = 0.5 * (low + high).matrix();
    const Eigen::Array2d span = (high - low).max(kLeastSpan_m);
    scale_ = std::min((area.cols - 2 * kMargin) / span.x(), (area.rows - 2 * kMargin) / span.y());
  }

  double px_per_m() const { return scale_; }
  cv::Point operator()(const Eigen::Vector2d& p) const {
    return {to_pixel(0.5 * area_.width + scale_ * (p.x() - middle_.x())),
            to_pixel(0.5 * area_.height - scale_ * (p.y() - middle_.y()))};
  }

 private:
  cv::Size area_;
  Eigen::Vector2d middle_;
  double scale_ = 1.;
};

void draw_path(const Path& path, const GroundView& view, cv::Mat& area) {
  const cv::Scalar& colour = path.reference ? kReference : kEstimate;
  for (std::size_t i = 1; i < path.points_m.size(); ++i) {
    const Eigen::Vector2d &from = path.points_m[i - 1], &to = path.points_m[i];
    if (!from.allFinite() || !to.allFinite()) continue;
    cv::line(area, view(from), view(to), colour, path.reference ? 1 : 2, cv::LINE_AA);
  }
}

void draw_body(const Body& body, const GroundView& view, cv::Mat& area) {
  if (!body.p_m.allFinite() || !std::isfinite(body.yaw_rad)) return;
  constexpr double kArrow_px = 20.;
  const cv::Point at = view(body.p_m);
  const cv::Point tip(to_pixel(at.x + kArrow_px * std::cos(body.yaw_rad)),
                      to_pixel(at.y - kArrow_px * std::sin(body.yaw_rad)));
  cv::circle(area, at, 4, kText, cv::FILLED, cv::LINE_AA);
  cv::arrowedLine(area, at, tip, kText, 1, cv::LINE_AA, 0, 0.3);
}

/// 1, 2 or 5 times a power of ten, at most `length`.
double round_length(double length) {
  const double power = std::pow(10., std::floor(std::log10(length)));
  for (const double factor : {5., 2.}) {
    if (factor * power <= length) return factor * power;
  }
  return power;
}

void draw_scale(const GroundView& view, cv::Mat& area) {
  const double length_m = round_length(0.35 * area.cols / view.px_per_m());
  const int width = to_pixel(length_m * view.px_per_m()), y = area.rows - 12;
  cv::line(area, {10, y}, {10 + width, y}, kText, 1);
  for (const int x : {10, 10 + width}) cv::line(area, {x, y - 4}, {x, y + 4}, kText, 1);
  put_text(area, number(length_m) + " m", {10 + width + 8, y + 4}, kText);
}

/// Half of the range of y to show: all after the first fifth, which may be far larger.
double half_range(const Curve& curve) {
  double all = 0., later = 0.;
  if (curve.x.empty()) return 1.;
  const double later_x = curve.x.front() + 0.2 * (curve.x.back() - curve.x.front());
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    for (const double value : {curve.y[i], curve.low[i], curve.high[i]}) {
      if (!std::isfinite(value)) continue;
      all = std::max(all, std::abs(value));
      if (curve.x[i] >= later_x) later = std::max(later, std::abs(value));
    }
  }
  const double range = 1.15 * (later > 0. ? later : all);
  return range > 0. ? range : 1.;
}

/// Values of a curve to pixels of its area.
class CurveView {
 public:
  static constexpr int kTop = 20, kBottom = 6;

  CurveView(const Curve& curve, const cv::Mat& area)
      : range_(half_range(curve)), width_(area.cols), height_(area.rows - kTop - kBottom) {
    if (curve.x.empty()) return;
    begin_ = curve.x.front();
    span_ = std::max(curve.x.back() - begin_, 1e-9);
  }
  double range() const { return range_; }
  int x(double value) const { return to_pixel((value - begin_) / span_ * (width_ - 1)); }
  int y(double value) const { return to_pixel(kTop + 0.5 * (1. - value / range_) * (height_ - 1)); }

 private:
  double range_, begin_ = 0., span_ = 1.;
  int width_, height_;
};

void draw_band(const Curve& curve, const CurveView& view, cv::Mat& area) {
  for (std::size_t i = 1; i < curve.x.size(); ++i) {
    const double low0 = curve.low[i - 1], high0 = curve.high[i - 1];
    const double low1 = curve.low[i], high1 = curve.high[i];
    if (!std::isfinite(low0 + high0 + low1 + high1)) continue;
    const int x0 = view.x(curve.x[i - 1]), x1 = view.x(curve.x[i]);
    const std::array<cv::Point, 4> corners{
        cv::Point(x0, view.y(low0)), cv::Point(x0, view.y(high0)), cv::Point(x1, view.y(high1)),
        cv::Point(x1, view.y(low1))};
    cv::fillConvexPoly(area, corners.data(), 4, kBand);
  }
}

}  // namespace

void draw_trajectory(const Scene& scene, cv::Mat& area) {
  const GroundView view(scene, area);
  for (const bool reference : {true, false}) {
    for (const Path& path : scene.paths) {
      if (path.reference == reference) draw_path(path, view, area);
    }
  }
  if (scene.body) draw_body(*scene.body, view, area);
  draw_scale(view, area);
  int y = 16;
  for (const Path& path : scene.paths) {
    put_text(area, path.name, {10, y}, path.reference ? kReference : kEstimate);
    y += 16;
  }
  cv::rectangle(area, {0, 0}, {area.cols - 1, area.rows - 1}, kFrame);
}

void draw_curve(const Curve& curve, cv::Mat& area) {
  const CurveView view(curve, area);
  draw_band(curve, view, area);
  cv::line(area, {0, view.y(0.)}, {area.cols, view.y(0.)}, kReference, 1);
  for (std::size_t i = 1; i < curve.x.size(); ++i) {
    if (!std::isfinite(curve.y[i - 1] + curve.y[i])) continue;
    cv::line(area, {view.x(curve.x[i - 1]), view.y(curve.y[i - 1])},
             {view.x(curve.x[i]), view.y(curve.y[i])}, kEstimate, 1, cv::LINE_AA);
  }
  area.rowRange(0, CurveView::kTop - 4) = kBackground;
  put_text(area, curve.title, {5, 13}, kText);
  put_text(area, number(view.range()), {3, CurveView::kTop + 11}, kFaint, TextAt::kLeft, 0.36);
  put_text(area, number(-view.range()), {3, area.rows - 10}, kFaint, TextAt::kLeft, 0.36);
  cv::rectangle(area, {0, 0}, {area.cols - 1, area.rows - 1}, kFrame);
}

}  // namespace viwo::view
