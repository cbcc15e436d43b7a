// Update visual_features: feature tracks of any number of cameras, as in the MSCKF, and landmarks
// in the state (model.md).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "chi2_gate.hpp"
#include "feature.hpp"
#include "landmarks.hpp"
#include "normal_equations.hpp"
#include "track_store.hpp"
#include "visual_features_params.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class VisualFeatures final : public Update {
 public:
  /// Parameters: visual_features_params.hpp. ParamError when two of them contradict each other.
  VisualFeatures(const Params& params, const HostServices& services);

  /// InputError when there is no camera.
  void declare(Declarations& host) override;
  /// InputError when there are more clones than kMaxWindowClones.
  void start(const UpdateSetup& setup) override;
  /// Adds at most one information factor; never throws on bad data.
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override;
  void settle(const FilterView& filter, BlockEdits& edits) override;
  void rejections(std::vector<RejectionCount>& out) const override;
  void noises(std::vector<NoiseFound>& out) const override;
  std::span<const Landmark> landmarks() const { return landmarks_.all(); }

 private:
  /// A track whose observations may be used now.
  struct Candidate {
    int track = 0;
    int length = 0;
    std::int64_t id = 0;
    bool lost = false;             ///< else it has an observation at the oldest clone, which leaves
    double seconds_in_sight = 0.;  ///< from now on, of one that may become a landmark
  };

  /// What was not used for one reason. Counting it allocates nothing.
  struct Dropped {
    const char* reason;
    std::int64_t count, first_id, first_ns;
  };
  void reject(const char* reason, std::int64_t id, std::int64_t count = 1);
  void take_image(const FeatureSample& sample);
  /// Fills candidates_, best first; drops lost tracks that are too short.
  void select(const FilterView& filter);
  /// As many of them as there is room for landmarks: those that will be seen longest.
  void choose_landmarks();
  /// Whether it had a point, and was taken or left to the gate.
  bool use(const Candidate& candidate, FactorSink& sink);
  /// Puts the prepared track into the factor.
  void add(const Candidate& candidate, FactorSink& sink);
  bool passes_gate();
  void tell_noise();
  /// Of the gate.
  double threshold(int dof) const {
    return thresholds_.empty() ? std::numeric_limits<double>::infinity()
                               : thresholds_[static_cast<std::size_t>(dof)];
  }
  FeatureStatus try_feature(bool& passes);
  /// Linearises the tracks of this epoch where their factor puts the clones.
  void linearise_again(const FilterView& prior);
  /// The factor of this epoch, with the columns of the window.
  InformationFactor& factor(FactorSink& sink);

  Params params_;
  bool exact_ = false;

  std::vector<CameraPrior> cameras_;
  std::vector<CameraBlocks> blocks_;  ///< of each camera
  StreamId images_;
  RoomId room_;

  TrackStore tracks_;
  Window window_;
  Feature feature_;
  NormalEquations equations_;
  Chi2Gate gate_;
  Landmarks landmarks_;
  NoiseScale noise_{50., 2000., 10.};  ///< of sigma_px
  int weighed_ = 0;                    ///< tracks of this epoch that told it
  /// What the track that passes_gate() was asked for last has to tell of it: what the gate has, or
  /// that it is beyond so much.
  struct Told {
    double beyond = 0.;
  };
  std::optional<Told> told_;
  InformationFactor* factor_ = nullptr;  ///< of this epoch, once there is a feature
  struct Used {
    int track;
    std::size_t n_sights;
  };
  std::vector<Used> used_;          ///< tracks that are in the factor, still in the store
  std::vector<Sight> used_sights_;  ///< of these, without strays
  double second_order_ = 0.;        ///< largest of them
  std::vector<Candidate> candidates_;
  std::vector<double> seconds_;           ///< in sight, of candidates
  std::vector<std::int64_t> seen_epoch_;  ///< per track
  std::vector<double> thresholds_;        ///< of each of the two tests of a track, per dof
  std::int64_t epoch_ = 0;
  std::uint64_t images_now_ = 0;  ///< bit of each camera that has an image in this epoch
  std::int64_t now_ns_ = 0;
  std::int64_t tried_ = 0;        ///< tracks that had a point
  bool moves_ = false;            ///< the point of the track that passes_gate() was asked for
  std::vector<Dropped> dropped_;  ///< in the order of their first times; room for all reasons
};

}  // namespace viwo::visual
