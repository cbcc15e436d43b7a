#include "viwo/series/lag.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/SVD>

namespace viwo::series {
namespace {

constexpr int kParts = 10;
constexpr double kLeastRate = 0.03;  ///< rad/s, standard deviation: what turns less tells no time
constexpr double kFewest_s = 5.;     ///< of cells that both have
constexpr double kAlike = 0.8;       ///< correlation of two that say the same

/// Sums over pairs of cells.
struct Sums {
  double n = 0.;
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();
  double aa = 0., bb = 0., ab = 0.;

  void add(const Eigen::Vector3d& of_a, const Eigen::Vector3d& of_b) {
    n += 1.;
    a += of_a;
    b += of_b;
    aa += of_a.squaredNorm();
    bb += of_b.squaredNorm();
    ab += of_a.dot(of_b);
  }
  Sums& operator+=(const Sums& o) {
    n += o.n, a += o.a, b += o.b, aa += o.aa, bb += o.bb, ab += o.ab;
    return *this;
  }
  double variance_a() const { return n > 0. ? aa / n - (a / n).squaredNorm() : 0.; }
  double covariance() const { return n > 0. ? ab / n - a.dot(b) / (n * n) : 0.; }
  double correlation() const {
    const double of_b = n > 0. ? bb / n - (b / n).squaredNorm() : 0.;
    const double product = variance_a() * of_b;
    return product > 0. ? covariance() / std::sqrt(product) : 0.;
  }
};

/// Of all lags, in cells from -most to most.
using ByLag = std::vector<Sums>;

/// The place of the largest |correlation|, between cells; nothing at the ends. A correlation of the
/// opposite sign counts only if it is clearly larger: what swings correlates with itself half a
/// swing later.
struct Peak {
  double place = 0.;
  std::size_t cell = 0;
};
std::optional<Peak> peak_of(const ByLag& sums) {
  std::vector<double> r(sums.size());
  std::transform(sums.begin(), sums.end(), r.begin(),
                 [](const Sums& s) { return s.correlation(); });
  auto best = std::max_element(r.begin(), r.end());
  const auto least = std::min_element(r.begin(), r.end());
  constexpr double kClearly = 1.1;
  if (-*least > kClearly * *best) best = least;
  const auto i = static_cast<std::size_t>(best - r.begin());
  if (i == 0 || i + 1 == r.size()) return {};
  const double bend = r[i - 1] - 2. * r[i] + r[i + 1];
  if (bend == 0.) return {};
  return Peak{static_cast<double>(i) + 0.5 * (r[i - 1] - r[i + 1]) / bend, i};
}

std::array<ByLag, kParts> sums_by_part(const RateGrid& a, const RateGrid& b, int most) {
  std::array<ByLag, kParts> parts;
  parts.fill(ByLag(static_cast<std::size_t>(2 * most + 1)));
  const auto n = static_cast<int>(std::min(a.size(), b.size()));
  for (int i = most; i + most < n; ++i) {
    if (!a.has(static_cast<std::size_t>(i))) continue;
    ByLag& part = parts[static_cast<std::size_t>(static_cast<std::int64_t>(i) * kParts / n)];
    for (int lag = -most; lag <= most; ++lag) {
      const auto j = static_cast<std::size_t>(i + lag);
      if (b.has(j)) {
        part[static_cast<std::size_t>(lag + most)].add(a[static_cast<std::size_t>(i)], b[j]);
      }
    }
  }
  return parts;
}

ByLag total_of(const std::array<ByLag, kParts>& parts, int without) {
  ByLag total(parts[0].size());
  for (int p = 0; p < kParts; ++p) {
    if (p == without) continue;
    for (std::size_t i = 0; i < total.size(); ++i)
      total[i] += parts[static_cast<std::size_t>(p)][i];
  }
  return total;
}

/// Means over so many cells.
std::vector<std::optional<Eigen::Vector3d>> coarse(const RateGrid& grid, std::size_t cells) {
  std::vector<std::optional<Eigen::Vector3d>> means(grid.size() / cells);
  for (std::size_t k = 0; k < means.size(); ++k) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = k * cells; i < (k + 1) * cells; ++i) sum += grid[i];
    if (sum.allFinite()) means[k] = sum / static_cast<double>(cells);
  }
  return means;
}

/// Half a minute to both sides, to a part of a tenth of a second. What turns alike only where most
/// of the time is left out is no lag.
std::optional<Lag> far_lag(const RateGrid& a, const RateGrid& b) {
  constexpr std::size_t kCells = 10;
  constexpr double kStep_s = kCells * RateGrid::kCell_s, kLeastShare = 0.7;
  const auto of_a = coarse(a, kCells), of_b = coarse(b, kCells);
  const auto n = static_cast<int>(std::min(of_a.size(), of_b.size()));
  const int most = std::min(300, n / 3);
  ByLag sums(static_cast<std::size_t>(2 * most + 1));
  for (int i = 0; i < n; ++i) {
    if (!of_a[static_cast<std::size_t>(i)]) continue;
    for (int lag = std::max(-most, -i); lag <= std::min(most, n - 1 - i); ++lag) {
      const auto& there = of_b[static_cast<std::size_t>(i + lag)];
      if (!there) continue;
      sums[static_cast<std::size_t>(lag + most)].add(*of_a[static_cast<std::size_t>(i)], *there);
    }
  }
  const Sums& middle = sums[static_cast<std::size_t>(most)];
  const std::optional<Peak> peak = peak_of(sums);
  if (!peak) return {};
  const Sums& there = sums[peak->cell];
  const double least = kLeastShare * std::max(middle.variance_a(), kLeastRate * kLeastRate);
  if (there.n * kStep_s < 2. * kFewest_s ||
      there.n < kLeastShare * (n - std::abs(static_cast<int>(peak->cell) - most)) ||
      there.variance_a() < least) {
    return {};
  }
  Lag lag;
  lag.lag_s = (peak->place - most) * kStep_s;
  lag.sigma_s = kStep_s / std::sqrt(12.);
  lag.correlation = there.correlation();
  lag.at_zero = middle.correlation();
  lag.slope = there.covariance() / there.variance_a();
  lag.rate_rad_per_s = std::sqrt(there.variance_a());
  return lag;
}

std::optional<Lag> near_lag(const RateGrid& a, const RateGrid& b, double most_s) {
  const int most = static_cast<int>(std::lround(most_s / RateGrid::kCell_s));
  const auto parts = sums_by_part(a, b, most);
  const ByLag total = total_of(parts, -1);
  const Sums& middle = total[static_cast<std::size_t>(most)];
  if (middle.n * RateGrid::kCell_s < kFewest_s) return {};
  if (middle.variance_a() < kLeastRate * kLeastRate) return {};
  const std::optional<Peak> peak = peak_of(total);
  if (!peak) return {};
  const auto seconds = [&](double place) { return (place - most) * RateGrid::kCell_s; };
  const Sums& there = total[peak->cell];
  Lag lag;
  lag.lag_s = seconds(peak->place);
  lag.correlation = there.correlation();
  lag.at_zero = middle.correlation();
  lag.slope = there.covariance() / there.variance_a();
  lag.rate_rad_per_s = std::sqrt(middle.variance_a());
  // Jackknife: what correlates over time within a tenth does no harm.
  std::vector<double> without;
  for (int p = 0; p < kParts; ++p) {
    if (parts[static_cast<std::size_t>(p)][static_cast<std::size_t>(most)].n == 0.) continue;
    const std::optional<Peak> other = peak_of(total_of(parts, p));
    if (!other) return {};
    without.push_back(seconds(other->place));
  }
  if (without.size() < 3) return {};
  const auto n = static_cast<double>(without.size());
  double mean = 0., squares = 0.;
  for (const double lag_s : without) mean += lag_s / n;
  for (const double lag_s : without) squares += (lag_s - mean) * (lag_s - mean);
  lag.sigma_s = std::sqrt((n - 1.) / n * squares);
  for (int p = 0; p < kParts; ++p) {
    const ByLag& part = parts[static_cast<std::size_t>(p)];
    const std::optional<Peak> own = peak_of(part);
    if (!own || part[own->cell].variance_a() < kLeastRate * kLeastRate) continue;
    if (std::abs(part[own->cell].correlation()) < 0.9) continue;
    const double part_s = static_cast<double>(a.size()) * RateGrid::kCell_s / kParts;
    lag.parts.emplace_back((p + 0.5) * part_s, seconds(own->place));
  }
  return lag;
}

}  // namespace

std::optional<Lag> find_lag(const RateGrid& a, const RateGrid& b, double most_s) {
  std::optional<Lag> near = near_lag(a, b, most_s);
  const double r = near ? std::abs(near->correlation) : 0.;
  if (r >= kAlike) return near;
  const std::optional<Lag> far = far_lag(a, b);
  const bool is_found = far && (!near || std::abs(far->lag_s) > most_s) &&
                        std::abs(far->correlation) > std::max(kAlike, 1.25 * r);
  return is_found ? far : near;
}

std::optional<Eigen::Matrix3d> rotation_between(const RateGrid& a, const RateGrid& b) {
  constexpr std::int64_t kMostLag = 50, kStep = 2;
  constexpr double kLeastShare = 0.1;
  const auto n = static_cast<std::int64_t>(std::min(a.size(), b.size()));
  std::optional<Eigen::Matrix3d> found;
  double best = 0.;
  for (std::int64_t lag = -kMostLag; lag <= kMostLag; lag += kStep) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
    double count = 0., squares_a = 0., squares_b = 0.;
    for (std::int64_t i = kMostLag; i + kMostLag < n; ++i) {
      const auto k = static_cast<std::size_t>(i), j = static_cast<std::size_t>(i + lag);
      if (!a.has(k) || !b.has(j)) continue;
      H += b[j] * a[k].transpose();
      mean_a += a[k];
      mean_b += b[j];
      squares_a += a[k].squaredNorm();
      squares_b += b[j].squaredNorm();
      count += 1.;
    }
    if (count < 100.) continue;
    H = H / count - mean_b * mean_a.transpose() / (count * count);
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (svd.singularValues().sum() <= best) continue;
    best = svd.singularValues().sum();
    const double all = std::sqrt((squares_a / count - (mean_a / count).squaredNorm()) *
                                 (squares_b / count - (mean_b / count).squaredNorm()));
    // What has nothing in common is turned into each other by noise.
    if (best < kAlike * all || svd.singularValues()[1] < kLeastShare * svd.singularValues()[0]) {
      found.reset();
      continue;
    }
    Eigen::Matrix3d U = svd.matrixU();
    if ((U * svd.matrixV().transpose()).determinant() < 0.) U.col(2) *= -1.;
    found = U * svd.matrixV().transpose();
  }
  return found;
}

}  // namespace viwo::series
