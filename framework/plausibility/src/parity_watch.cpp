#include "viwo/plausibility/parity_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr double kMoves_rad_per_s = 0.1;
constexpr double kPiece_s = 0.5;

}  // namespace

bool Parity::is_gross() const {
  if (!std::isfinite(rms) || !std::isfinite(speed) || refused > 0.5) return true;
  return drive_rad_per_s > kMoves_rad_per_s && rms > 0.2 * speed;
}

void ParityWatch::Sums::operator+=(const Sums& other) {
  squares += other.squares;
  speeds += other.speeds;
  rates += other.rates;
  solved += other.solved;
  refused += other.refused;
}

void ParityWatch::Means::reset(int n_rows) {
  e.setZero(n_rows);
  e_squares.setZero(n_rows);
  b.setZero(n_rows);
  rates.fill(0.);
  sums = {};
}

ParityWatch::ParityWatch(std::shared_ptr<const WheelModel> model) : model_(std::move(model)) {
  rows_.A.resize(model_->n_rows(), 3);
  rows_.b.resize(model_->n_rows());
  piece_.reset(model_->n_rows());
}

bool ParityWatch::add(const EncoderSample& sample, const Intrinsics& x_WI,
                      const TwistSolution* solution) {
  const double piece_s = seconds_between(piece_ns_, sample.t_ns);
  const bool begins = piece_ns_ == 0 || piece_s > kPiece_s || piece_s < 0.;
  const bool was_gross = begins && end_piece(sample.t_ns);
  const auto n_drive = static_cast<std::size_t>(model_->description().n_drive);
  Sums now;
  if (solution == nullptr) {
    now.refused = 1.;
  } else if (!solution->rank_deficient &&
             model_->model().rows(sample, x_WI, false, rows_) == Status::kOk) {
    now.solved = 1.;
    now.squares = solution->e.squaredNorm();
    now.speeds = rows_.b.squaredNorm();
    piece_.e += solution->e;
    piece_.e_squares += solution->e.cwiseAbs2();
    piece_.b += rows_.b;
  } else {
    return was_gross;
  }
  for (std::size_t i = 0; i < n_drive; ++i) {
    now.rates += sample.drive_rad_per_s[i] * sample.drive_rad_per_s[i];
    piece_.rates[i] += sample.drive_rad_per_s[i];
  }
  piece_.sums += now;
  total_ += now;
  return was_gross;
}

ParityWatch::Sums ParityWatch::mean_of_piece() const {
  Sums mean;
  const double solved = piece_.sums.solved, refused = piece_.sums.refused;
  if (!(solved + refused > 0.)) return mean;
  for (const double sum : piece_.rates) mean.rates += std::pow(sum / (solved + refused), 2);
  (solved > refused ? mean.solved : mean.refused) = 1.;
  if (!(mean.solved > 0.)) return mean;
  for (Eigen::Index i = 0; i < piece_.e.size(); ++i) {
    // Without what the mean of so many has by chance.
    const double e = piece_.e[i] / solved;
    const double chance = (piece_.e_squares[i] / solved - e * e) / std::max(1., solved - 1.);
    mean.squares += std::max(0., e * e - chance);
    mean.speeds += std::pow(piece_.b[i] / solved, 2);
  }
  return mean;
}

bool ParityWatch::end_piece(std::int64_t end_ns) {
  const Sums mean = mean_of_piece();
  const Parity parity = parity_of(mean);
  const double length_s = std::clamp(seconds_between(piece_ns_, end_ns), 0., 2. * kPiece_s);
  const bool drives = parity.drive_rad_per_s > kMoves_rad_per_s;
  const bool is_gross = drives && parity.is_gross();
  if (drives) driven_s_ += length_s;
  if (is_gross) {
    gross_s_ += length_s;
    gross_ += mean;
    if (first_gross_ns_ == 0) first_gross_ns_ = piece_ns_;
  }
  piece_.reset(model_->n_rows());
  piece_ns_ = end_ns;
  return is_gross;
}

Parity ParityWatch::parity_of(const Sums& sums) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double n = sums.solved, all = n + sums.refused;
  const double n_drives = std::max(1, model_->description().n_drive);
  Parity parity;
  parity.rms = n > 0. ? std::sqrt(sums.squares / (n * model_->n_rows())) : kNone;
  parity.drive_rad_per_s = all > 0. ? std::sqrt(sums.rates / (all * n_drives)) : 0.;
  parity.speed = n > 0. ? std::sqrt(sums.speeds / (n * n_drives)) : 0.;
  parity.refused = all > 0. ? sums.refused / all : 0.;
  return parity;
}

}  // namespace viwo
