// Update visual_features: feature tracks of any number of cameras, as in the MSCKF (model.md).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feature.hpp"
#include "normal_equations.hpp"
#include "track_store.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class VisualFeatures final : public Update {
 public:
  /// Parameters: visual_features_params.hpp. ParamError when two of them contradict each other.
  VisualFeatures(const ParamSet& params, const HostServices& services);

  UpdateKind kind() const override { return UpdateKind::kBody; }
  /// InputError when there is no camera, or more clones than kMaxWindowClones.
  void start(const UpdateSetup& setup) override;
  /// Adds at most one information factor; never throws on bad data.
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override;
  void rejections(std::vector<RejectionCount>& out) const override;

 private:
  enum class Reason : std::uint8_t {
    kBadCamera,
    kBadPixel,
    kDuplicate,
    kNoRoom,
    kShort,
    kTooMany,
    kParallax,
    kNotVisible,
    kDistance,
    kGate,
    kCount
  };
  struct Rejections {
    std::int64_t count = 0;
    std::int64_t first_id = 0;
    std::int64_t first_t_ns = 0;
  };
  /// A track whose observations may be used now.
  struct Candidate {
    int track = 0;
    int length = 0;
    std::int64_t id = 0;
    bool lost = false;  ///< else it has an observation at the oldest clone, which leaves
  };

  void reject(Reason reason, std::int64_t id);
  void take_image(const FilterView& filter, const FeatureSample& sample, int slot);
  /// Fills candidates_, best first; drops lost tracks that are too short.
  void select(const FilterView& filter);
  void use(const Candidate& candidate, FactorSink& sink);
  bool passes_gate();

  double sigma_px_;
  double gate_probability_;
  int max_features_;
  int min_observations_;
  int max_tracks_;
  TriangulationLimits limits_;

  TrackStore tracks_;
  Window window_;
  Feature feature_;
  NormalEquations equations_;
  InformationFactor* factor_ = nullptr;  ///< of this epoch, once there is a feature
  std::vector<Candidate> candidates_;
  std::vector<std::int64_t> seen_epoch_;   ///< per track
  std::vector<std::int64_t> image_epoch_;  ///< per camera
  std::vector<double> gates_;              ///< threshold per degree of freedom
  std::int64_t epoch_ = 0;
  std::int64_t now_ns_ = 0;
  std::array<Rejections, static_cast<std::size_t>(Reason::kCount)> rejections_{};
};

}  // namespace viwo::visual
