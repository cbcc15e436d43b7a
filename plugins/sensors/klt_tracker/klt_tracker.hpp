// Sensor klt_tracker: images to feature tracks.
#pragma once

#include <cstdint>
#include <deque>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "camera_tracker.hpp"
#include "frame.hpp"
#include "image_groups.hpp"
#include "params.hpp"
#include "stereo_matcher.hpp"
#include "tracker_options.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::klt {

class KltTracker final : public Sensor {
 public:
  KltTracker(const Params& params, const HostServices& services);

  SampleTypes yields() const override { return sample_types<FeatureSample>(); }
  bool takes_input() const override { return true; }
  void connect(Sensor& input) override { input_ = &input; }
  Status next(Measurement& out) override;
  void rejections(std::vector<RejectionCount>& out) const override;

 private:
  /// What is kept of one camera's images.
  struct Eye {
    explicit Eye(const TrackerOptions& options) : maker(options) {}
    FrameMaker maker;
    Frame now, before;
    std::optional<std::int64_t> before_ns;  ///< none: nothing to follow points from
    bool is_read = false;                   ///< `now` is of this group
    bool repeats = false;                   ///< the image of this group is the one before
    int repeats_in_a_row = 0;
    std::string unreadable;
    std::exception_ptr failure;
    std::string other_size;        ///< of this image, when it is not the camera's
    int other_sizes = 0;           ///< such images in a row
    std::string first_other_size;  ///< what there is to say about the first of them
    bool has_fitted = false;       ///< there was an image of the camera's size

    /// Follows the points of this camera; or, for the right one of a pair, finds those of the
    /// camera before it.
    std::optional<CameraTracker> tracker;
    std::optional<StereoMatcher> matcher;
    int contradicting_pairs = 0;  ///< in a row
    bool told_contradiction = false;
    int pairs_without_matches = 0;  ///< in a row
    bool told_no_matches = false;
    int groups_without_pair = 0;  ///< before the first pair
    bool pair_seen = false;
  };

  /// Reads and prepares the images of a group, at the same time.
  void read(const ImageGroup& group);
  void read_one(const ImageSource* source, std::size_t camera, Eye& eye) const;
  /// Counts images that cannot be used. InputError when a camera's are not of this camera.
  void check(const ImageGroup& group);
  void check_size(std::size_t camera, const std::string& where);
  /// Follows and refills the points of one camera; ids are given later.
  void advance(std::size_t camera, std::int64_t t_ns);
  void give_ids(std::vector<Track>& tracks);
  /// The points of one camera; those of the right one of a pair are looked for now.
  FeatureSample points_of(std::size_t camera, const ImageGroup& group);
  void watch_stereo(const StereoCounts& counts, std::size_t right, std::int64_t t_ns);
  /// Warns when hardly a point of the left camera is found in the right one.
  void watch_matches(const StereoCounts& counts, std::size_t right, std::int64_t t_ns);
  /// Warns when left and right images do not come together.
  void watch_pair(const ImageGroup& group, std::size_t right);
  void process(const ImageGroup& group);
  /// At the end of the input: InputError when it had nothing that could be used.
  void check_end() const;

  HostServices services_;
  TrackerOptions options_;
  std::string chain_file_;
  double max_gap_s_, max_camera_dt_s_;
  std::vector<CameraView> cameras_;
  std::vector<Eye> eyes_;
  std::vector<std::size_t> followed_;  ///< the cameras with points of their own
  Sensor* input_ = nullptr;
  std::optional<ImageGroups> groups_;
  Rejections rejections_;
  std::int64_t images_ = 0, right_images_ = 0;  ///< that came; right ones that could be read
  /// Stereo pairs whose first image has points, and those of them with matches.
  std::int64_t pairs_with_points_ = 0, pairs_with_matches_ = 0;
  std::int64_t next_id_ = 0;
  std::deque<FeatureSample> ready_;
};

}  // namespace viwo::klt
