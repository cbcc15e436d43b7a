// Where the factor of an epoch puts the clones, so that its tracks can be linearised there once
// more (VF-30).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class Relinearisation {
 public:
  /// Corrects the clones of `window` by `factor` alone, as the host would. Calibration and blocks
  /// stay: they are linearised where they are. Allocates: it is for first epochs.
  Relinearisation(const FilterView& prior, Window& window, const InformationFactor& factor);
  Relinearisation(const Relinearisation&) = delete;
  Relinearisation& operator=(const Relinearisation&) = delete;

  /// The filter with these clones; their errors are still counted from the prior. Lives as long as
  /// this.
  const FilterView& view() const { return view_; }
  /// Makes of a factor that was linearised there one of errors at the prior.
  void move_back(InformationFactor& factor) const;

 private:
  std::vector<CloneState> clones_;
  FilterView view_;
  Eigen::VectorXd dx_;  ///< of the window's columns
};

}  // namespace viwo::visual
