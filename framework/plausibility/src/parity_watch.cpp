#include "viwo/plausibility/parity_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr double kMoves_rad_per_s = 0.1;
constexpr double kPiece_s = 2.;

}  // namespace

bool Parity::is_gross() const {
  if (!std::isfinite(rms) || !std::isfinite(speed) || refused > 0.5) return true;
  return drive_rad_per_s > kMoves_rad_per_s && rms > 0.2 * speed;
}

ParityWatch::ParityWatch(std::shared_ptr<const WheelModel> model) : model_(std::move(model)) {
  rows_.A.resize(model_->n_rows(), 3);
  rows_.b.resize(model_->n_rows());
}

void ParityWatch::add(const EncoderSample& sample, const Intrinsics& x_WI,
                      const TwistSolution* solution) {
  const double piece_s = seconds_between(piece_ns_, sample.t_ns);
  if (piece_ns_ == 0 || piece_s > kPiece_s || piece_s < 0.) end_piece(sample.t_ns);
  Sums now;
  if (solution == nullptr) {
    now.refused = 1.;
  } else if (!solution->rank_deficient &&
             model_->model().rows(sample, x_WI, false, rows_) == Status::kOk) {
    now.solved = 1.;
    now.squares = solution->e.squaredNorm();
    now.speeds = rows_.b.squaredNorm();
    const auto n_drive = static_cast<std::size_t>(model_->description().n_drive);
    for (std::size_t i = 0; i < n_drive; ++i) {
      now.rates += sample.drive_rad_per_s[i] * sample.drive_rad_per_s[i];
    }
  }
  for (Sums* sums : {&total_, &piece_}) {
    sums->squares += now.squares;
    sums->speeds += now.speeds;
    sums->rates += now.rates;
    sums->solved += now.solved;
    sums->refused += now.refused;
  }
}

void ParityWatch::end_piece(std::int64_t end_ns) {
  const Parity parity = parity_of(piece_);
  const double length_s = std::clamp(seconds_between(piece_ns_, end_ns), 0., 2. * kPiece_s);
  if (piece_.solved > 0. && parity.drive_rad_per_s > kMoves_rad_per_s) {
    driven_s_ += length_s;
    if (parity.is_gross()) {
      gross_s_ += length_s;
      if (first_gross_ns_ == 0) first_gross_ns_ = piece_ns_;
    }
  }
  piece_ = {};
  piece_ns_ = end_ns;
}

Parity ParityWatch::parity_of(const Sums& sums) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double n = sums.solved, all = n + sums.refused;
  const double n_drives = n * std::max(1, model_->description().n_drive);
  Parity parity;
  parity.rms = n > 0. ? std::sqrt(sums.squares / (n * model_->n_rows())) : kNone;
  parity.drive_rad_per_s = n > 0. ? std::sqrt(sums.rates / n_drives) : 0.;
  parity.speed = n > 0. ? std::sqrt(sums.speeds / n_drives) : 0.;
  parity.refused = all > 0. ? sums.refused / all : 0.;
  return parity;
}

}  // namespace viwo
