#include "viwo/filter/state_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

constexpr int kNumbersPerRotation = 9;
constexpr int kEntriesPerRotation = 3;

bool is_free(const BlockEntry& entry) { return entry.sigma > 0. || entry.process_sigma > 0.; }

bool is_held(const BlockSpec& spec) {
  return std::none_of(spec.entries.begin(), spec.entries.end(), is_free);
}

std::string entry_name(const std::string& name) { return "'" + name + "'"; }

std::string fault_of_entry(const BlockEntry& entry) {
  if (entry.name.empty()) return "an entry has no name";
  for (const double sigma : {entry.sigma, entry.process_sigma}) {
    if (!std::isfinite(sigma) || sigma < 0.) {
      return "a sigma of " + entry_name(entry.name) + " is negative or not finite";
    }
  }
  return "";
}

}  // namespace

std::string fault_of(const BlockSpec& spec) {
  const auto n = static_cast<int>(spec.entries.size());
  if (spec.name.empty()) return "it has no name";
  if (n == 0) return "it has no entries";
  if (spec.rotations < 0 || kEntriesPerRotation * spec.rotations > n) {
    return "its retraction is none: " + std::to_string(spec.rotations) + " rotations need " +
           std::to_string(kEntriesPerRotation * spec.rotations) + " entries, not " +
           std::to_string(n);
  }
  const int numbers = n + (kNumbersPerRotation - kEntriesPerRotation) * spec.rotations;
  if (static_cast<int>(spec.value.size()) != numbers) {
    return "its value has " + std::to_string(spec.value.size()) + " numbers, not " +
           std::to_string(numbers);
  }
  for (std::size_t i = 0; i < spec.entries.size(); ++i) {
    const BlockEntry& entry = spec.entries[i];
    if (std::string fault = fault_of_entry(entry); !fault.empty()) return fault;
    const auto same = [&](const BlockEntry& other) { return other.name == entry.name; };
    if (std::any_of(spec.entries.begin(), spec.entries.begin() + static_cast<std::ptrdiff_t>(i),
                    same)) {
      return "two of its entries are called " + entry_name(entry.name);
    }
  }
  for (const double number : spec.value) {
    if (!std::isfinite(number)) return "its value is not finite";
  }
  for (int i = 0; i < spec.rotations; ++i) {
    const Eigen::Map<const Eigen::Matrix3d> R(spec.value.data() + kNumbersPerRotation * i);
    if (!(R * R.transpose()).isIdentity(1e-6) || R.determinant() < 0.) {
      return "its retraction is none: rotation " + std::to_string(i) + " of its value is not one";
    }
  }
  if (spec.process != Process::kGaussMarkov) return "";
  if (spec.rotations > 0) return "a rotation cannot be a Gauss-Markov process";
  return spec.time_constant_s > 0. && std::isfinite(spec.time_constant_s)
             ? ""
             : "a Gauss-Markov process needs a time constant above zero";
}

std::string fault_of(const RoomSpec& spec) {
  if (spec.name.empty()) return "it has no name";
  if (spec.blocks < 0) return "it has room for less than no block";
  if (spec.entries >= 1 && spec.entries <= kMaxRoomEntries) return "";
  return "its blocks have " + std::to_string(spec.entries) + " entries, not 1 to " +
         std::to_string(kMaxRoomEntries);
}

bool is_pose(const BlockSpec& spec) {
  return spec.rotations == 1 && spec.entries.size() == kPoseSize;
}

void PriorCorrelations::append(const PriorCorrelations& other) {
  const Eigen::Index n = matrix.rows(), m = other.matrix.rows();
  entries.insert(entries.end(), other.entries.begin(), other.entries.end());
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(n + m, n + m);
  both.topLeftCorner(n, n) = matrix;
  both.bottomRightCorner(m, m) = other.matrix;
  matrix = std::move(both);
}

Eigen::MatrixXd PriorCorrelations::among(std::span<const std::string> names) const {
  const auto n = static_cast<Eigen::Index>(names.size());
  std::vector<std::pair<Eigen::Index, Eigen::Index>> known;  // where in the result, and where here
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto found = std::ranges::find(entries, names[static_cast<std::size_t>(i)]);
    if (found != entries.end()) known.emplace_back(i, found - entries.begin());
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Identity(n, n);
  for (const auto& [row, i] : known) {
    for (const auto& [column, j] : known) out(row, column) = matrix(i, j);
  }
  return out;
}

StateBlocks::StateBlocks(std::vector<BlockSpec> blocks, std::vector<RoomSpec> rooms,
                         int first_column)
    : first_column_(first_column), specs_(std::move(blocks)), rooms_(std::move(rooms)) {
  for (const BlockSpec& spec : specs_) {
    offset_.push_back(value_.size());
    value_.insert(value_.end(), spec.value.begin(), spec.value.end());
  }
  for (const RoomSpec& room : rooms_) {
    for (int i = 0; i < room.blocks; ++i) {
      offset_.push_back(value_.size());
      value_.resize(value_.size() + static_cast<std::size_t>(room.entries), 0.);
    }
  }
  // NOLINTNEXTLINE(cppcoreguidelines-prefer-member-initializer): they are filled above.
  first_ = value_;
  views_.resize(offset_.size());
  room_.assign(offset_.size(), -1);
  used_.assign(offset_.size(), false);

  int next = first_column;
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (specs_[i].group.empty()) place(i, next);
    if (specs_[i].process != Process::kConstant) moving_.push_back(i);
  }
  std::size_t block = specs_.size();
  for (std::size_t r = 0; r < rooms_.size(); ++r) {
    auto& free = free_.emplace_back();
    for (int i = 0; i < rooms_[r].blocks; ++i, ++block) {
      room_[block] = static_cast<int>(r);
      views_[block] = {next, rooms_[r].entries, 0, &value_[offset_[block]],
                       &first_[offset_[block]]};
      next += rooms_[r].entries;
      free.push_back({static_cast<int>(block)});
    }
    std::reverse(free.begin(), free.end());
  }
  first_watched_ = next;
  for (const BlockSpec& spec : specs_) {
    const auto same = [&](const BlockGroup& group) { return group.name == spec.group; };
    if (spec.group.empty() || std::any_of(groups_.begin(), groups_.end(), same)) continue;
    BlockGroup& group = groups_.emplace_back();
    group.name = spec.group;
    for (std::size_t i = 0; i < specs_.size(); ++i) {
      if (specs_[i].group != spec.group) continue;
      place(i, next);
      group.blocks.push_back({static_cast<int>(i)});
      if (is_pose(specs_[i]) && group.mount.index < 0) group.mount = group.blocks.back();
    }
  }
  columns_ = next - first_column;
}

void StateBlocks::place(std::size_t block, int& next) {
  const BlockSpec& spec = specs_[block];
  const int size = static_cast<int>(spec.entries.size());
  const int column = is_held(spec) ? -1 : next;
  if (column >= 0) next += size;
  views_[block] = {column, size, spec.rotations, &value_[offset_[block]], &first_[offset_[block]]};
}

std::vector<double> StateBlocks::value(std::size_t block) const {
  const double* const first = &value_[offset_[block]];
  return {first, first + specs_[block].value.size()};
}

void StateBlocks::set_prior(Covariance& covariance, const PriorCorrelations& correlations) const {
  std::vector<std::string> names(static_cast<std::size_t>(columns_));  // of rooms: none
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(columns_);
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    if (views_[i].column() < 0) continue;
    int column = views_[i].column() - first_column_;
    for (const BlockEntry& entry : specs_[i].entries) {
      names[static_cast<std::size_t>(column)] = entry.name;
      sigma[column++] = entry.sigma;
    }
  }
  covariance.set_block(first_column_,
                       sigma.asDiagonal() * correlations.among(names) * sigma.asDiagonal());
}

void StateBlocks::estimates(BlockId id, const Covariance& covariance,
                            std::vector<BlockEstimate>& out) const {
  const BlockView& block = view(id);
  const int rotations = specs_[index(id)].rotations;
  for (int i = 0; i < block.size(); ++i) {
    BlockEstimate& estimate = out.emplace_back();
    if (i < kEntriesPerRotation * rotations) {
      estimate.value = log_so3(block.rotation(i / kEntriesPerRotation))[i % kEntriesPerRotation];
    } else {
      estimate.value = block.numbers()[i - kEntriesPerRotation * rotations];
    }
    if (block.column() < 0) continue;
    const int column = block.column() + i;
    estimate.sigma = std::sqrt(covariance.matrix()(column, column));
  }
}

void StateBlocks::correct(const Eigen::VectorXd& dx, bool first_estimates) {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const BlockView& block = views_[i];
    if (block.column() < 0 || (room_[i] >= 0 && !used_[i])) continue;
    const int rotations = room_[i] < 0 ? specs_[i].rotations : 0;
    double* const value = &value_[offset_[i]];
    for (int r = 0; r < rotations; ++r) {
      Eigen::Map<Eigen::Matrix3d> R(value + kNumbersPerRotation * r);
      const Eigen::Vector3d turn = dx.segment<3>(block.column() + kEntriesPerRotation * r);
      // Exactly R for no correction.
      if (!turn.isZero(0.)) R = normalized_rotation(exp_so3(-turn) * R);
    }
    const int numbers = block.size() - kEntriesPerRotation * rotations;
    Eigen::Map<Eigen::VectorXd>(value + kNumbersPerRotation * rotations, numbers) +=
        dx.segment(block.column() + kEntriesPerRotation * rotations, numbers);
  }
  if (!first_estimates) first_ = value_;
}

void StateBlocks::propagate(double dt_s, Covariance& covariance) {
  for (const std::size_t i : moving_) {
    const BlockSpec& spec = specs_[i];
    const BlockView& block = views_[i];
    if (block.column() < 0) continue;
    double kept = 1., gained = dt_s;              // (F-25)
    if (spec.process == Process::kGaussMarkov) {  // (F-26)
      kept = std::exp(-dt_s / spec.time_constant_s);
      gained = 1. - kept * kept;
      for (std::size_t k = 0; k < spec.entries.size(); ++k) {
        double& value = value_[offset_[i] + k];
        value = spec.value[k] + kept * (value - spec.value[k]);
      }
    }
    for (int k = 0; k < block.size(); ++k) {
      const double sigma = spec.entries[static_cast<std::size_t>(k)].process_sigma;
      covariance.decay(block.column() + k, kept, gained * sigma * sigma);
    }
  }
}

std::string StateBlocks::not_finite() const {
  for (std::size_t i = 0; i < specs_.size(); ++i) {
    for (std::size_t k = 0; k < specs_[i].value.size(); ++k) {
      if (!std::isfinite(value_[offset_[i] + k])) return specs_[i].name;
    }
  }
  return "";
}

int StateBlocks::room_of(BlockId id) const {
  return id.index >= 0 && index(id) < room_.size() ? room_[index(id)] : -1;
}

void StateBlocks::add(const AddedBlock& block) {
  auto& free = free_[static_cast<std::size_t>(room_of(block.id))];
  free.erase(std::find(free.begin(), free.end(), block.id));
  used_[index(block.id)] = true;
  for (int k = 0; k < view(block.id).size(); ++k) {
    const std::size_t at = offset_[index(block.id)] + static_cast<std::size_t>(k);
    value_[at] = first_[at] = block.value[static_cast<std::size_t>(k)];
  }
}

void StateBlocks::drop(BlockId id) {
  used_[index(id)] = false;
  free_[static_cast<std::size_t>(room_of(id))].push_back(id);
}

void StateBlocks::rewrite(const BlockRewrite& block) {
  for (int k = 0; k < view(block.id).size(); ++k) {
    const std::size_t at = offset_[index(block.id)] + static_cast<std::size_t>(k);
    value_[at] = block.value[static_cast<std::size_t>(k)];
    first_[at] = block.first_estimate[static_cast<std::size_t>(k)];
  }
}

}  // namespace viwo
