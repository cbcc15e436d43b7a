// What the tracker makes of images that are broken, missing, dark, late or of another camera.
#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "image_groups.hpp"
#include "test_drive.hpp"

namespace viwo::klt {
namespace {

using ::testing::HasSubstr;

TEST(KltTracker, TracksOverAnImageThatCannotBeRead) {
  std::vector<Measurement> input = drive(4, 1);
  input[2] = ImageSample{stamp_of(2), 0, std::make_shared<BrokenImage>()};
  const Played played = track(input, section({}, 1));
  ASSERT_EQ(played.samples.size(), 3U);
  EXPECT_GT(common(played.samples[1], played.samples[2]), 170U);
  const RejectionCount& count = played.rejections.at("image that cannot be read");
  EXPECT_EQ(count.count, 1);
  EXPECT_EQ(count.of, 4) << "too many are a doubt";
  EXPECT_EQ(count.first, "camera 0 at 5.200000000 s: b.png: the image is cut short");
}

TEST(KltTracker, TracksTheLeftImageAloneWhenTheRightOneIsMissing) {
  std::vector<Measurement> input = drive(4, 2);
  input.erase(input.begin() + 3);  // right, second pair
  const Played played = track(input, section());
  ASSERT_EQ(played.samples.size(), 7U);
  const auto left = played.of(0);
  EXPECT_EQ(left.size(), 4U);
  EXPECT_GT(common(left[1], left[2]), 185U);
  EXPECT_GT(common(left[2], played.of(1).back()), 170U);
  EXPECT_TRUE(played.rejections.empty());
}

TEST(KltTracker, CountsARightImageWithoutItsLeftOne) {
  std::vector<Measurement> input = drive(4, 2);
  input.erase(input.begin() + 2);  // left, second pair
  const Played played = track(input, section());
  EXPECT_EQ(played.samples.size(), 6U);
  const RejectionCount& count = played.rejections.at("right image without its left one");
  EXPECT_EQ(count.count, 1);
  EXPECT_EQ(count.first, "camera 1 at 5.100000000 s");
  EXPECT_GT(common(played.of(0)[0], played.of(0)[1]), 170U);
}

// A driver that sends each image twice, or hangs: the camera did not stand still meanwhile.
TEST(KltTracker, LeavesOutImagesThatRepeatTheOneBefore) {
  const std::vector<Measurement> once = drive(4, 1);
  std::vector<Measurement> twice;
  for (const Measurement& one : once) {
    ImageSample image = *one.view().get_if<ImageSample>();
    twice.push_back(one);
    image.t_ns += 30'000'000;
    twice.emplace_back(image);
  }
  const Played played = track(twice, section({}, 1));
  const Played expected = track(once, section({}, 1));
  ASSERT_EQ(played.samples.size(), expected.samples.size());
  EXPECT_EQ(common(played.of(0)[0], played.of(0)[3]), common(expected.of(0)[0], expected.of(0)[3]));
  const RejectionCount& count =
      played.rejections.at("image that repeats the one before to the last bit");
  EXPECT_EQ(count.count, 4);
  EXPECT_EQ(count.of, 8);
}

// Rendered without noise, or a video: whoever stands sees the same for long, and has not gone.
TEST(KltTracker, FollowsWhatStandsInImagesThatAreTheSameForLong) {
  const std::vector<Measurement> once = drive(3, 1);
  std::vector<Measurement> rest(once.begin(), once.begin() + 2);
  ImageSample image = *once[1].view().get_if<ImageSample>();
  for (int i = 0; i < 20; ++i) {
    image.t_ns += 50'000'000;
    rest.emplace_back(image);
  }
  ImageSample last = *once[2].view().get_if<ImageSample>();
  last.t_ns = image.t_ns + 100'000'000;
  rest.emplace_back(last);
  const Played played = track(rest, section({}, 1));
  ASSERT_EQ(played.samples.size(), 3U + 17U);
  EXPECT_EQ(played.rejections.begin()->second.count, 3);
  EXPECT_GT(common(played.samples[1], played.samples.back()), 150U);
}

TEST(ImageGroups, DoNotWaitForACameraThatIsSilentForLong) {
  // GIVEN a camera 1 that is gone from 0.3 s to 2.7 s
  std::vector<Measurement> images;
  for (int i = 0; i < 30; ++i) {
    for (int camera = 0; camera < (i < 3 || i > 27 ? 2 : 1); ++camera) {
      images.emplace_back(sample_of(Image{}, camera, stamp_of(i)));
    }
  }
  FakeInput input(std::move(images));
  ImageGroups groups(2, kPeriodNs / 10);
  Rejections rejections;
  ImageGroup group;
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(groups.next(input, rejections, group)) << i;
    EXPECT_EQ(group.images[0].t_ns, stamp_of(i));
    EXPECT_EQ(group.images[1].source != nullptr, i < 3 || i == 29) << i;
    // Up to 2 s of silence the next image is looked at, to see whether one of camera 1 comes.
    const std::size_t ahead = i > 2 && i < 23 ? 1 : 0;
    const auto of_groups = static_cast<std::size_t>(i + std::min(i + 1, 3) + 1);
    if (i < 28) {
      EXPECT_EQ(input.taken(), of_groups + ahead) << i;
    }
  }
  EXPECT_FALSE(groups.next(input, rejections, group));
  std::vector<RejectionCount> counts;
  rejections.append_to(counts);
  ASSERT_EQ(counts.size(), 1U);
  EXPECT_EQ(counts.front().first, "camera 1 at 7.800000000 s");
}

TEST(KltTracker, LeavesTheStampOfAnImageAloneInTheClockOfItsCamera) {
  std::vector<Measurement> input = drive(3, 2);
  input.erase(input.begin() + 2);  // left, second pair
  const Played played = track(input, section("stereo: false\n"));
  const auto right = played.of(1);
  ASSERT_EQ(right.size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(right[static_cast<std::size_t>(i)].t_ns, stamp_of(i));
  EXPECT_TRUE(played.rejections.empty());
}

TEST(KltTracker, StartsAnewAfterALongGapAndAfterDarkness) {
  // GIVEN images 0 to 2, then none for 0.6 s, then 8 to 10, of which 9 is dark
  std::vector<Measurement> input = drive(11, 1);
  input[9] = sample_of({424, 400, std::vector<std::uint8_t>(424 * 400, 2)}, 0, stamp_of(9));
  input.erase(input.begin() + 3, input.begin() + 8);
  const auto left = track(input, section({}, 1)).of(0);
  ASSERT_EQ(left.size(), 6U);
  EXPECT_GT(common(left[1], left[2]), 180U);
  // THEN there is a sample for the dark one, too, and no id comes back
  EXPECT_TRUE(left[4].points.empty());
  EXPECT_EQ(left[4].t_ns, stamp_of(9));
  for (const auto& [from, to] : {std::pair{2U, 3U}, {2U, 5U}, {3U, 5U}}) {
    EXPECT_GT(left[to].points.size(), 190U);
    EXPECT_EQ(common(left[from], left[to]), 0U);
    EXPECT_LT(*ids_of(left[from]).rbegin(), *ids_of(left[to]).begin());
  }
}

TEST(KltTracker, CountsImagesWhoseStampsGoBack) {
  std::vector<Measurement> input = drive(4, 1);
  input[2] = sample_of(rig().render(2, 0), 0, stamp_of(0));
  const Played played = track(input, section({}, 1));
  EXPECT_EQ(played.samples.size(), 3U);
  const RejectionCount& count =
      played.rejections.at("image whose stamp is not after the previous one");
  EXPECT_EQ(count.count, 1);
  EXPECT_EQ(count.first, "camera 0 at 5.000000000 s");
}

TEST(KltTracker, GoesOnWithAClockThatIsSetBack) {
  // GIVEN four pairs of images, and six more of a clock that was set back by two seconds
  std::vector<Measurement> input = drive(10, 2);
  for (int i = 4; i < 10; ++i) {
    for (const int camera : {0, 1}) {
      input[static_cast<std::size_t>(2 * i + camera)] =
          sample_of(rig().render(i, camera), camera, stamp_of(i) - 2'000'000'000);
    }
  }
  const Played played = track(input, section({}, 2), /*is_set_back=*/true);
  // THEN the third of them says so, and points are followed from there on
  EXPECT_EQ(played.rejections.at("image whose stamp is not after the previous one").count, 4);
  EXPECT_EQ(played.rejections.at("clock of the images set back: they are taken from here on").count,
            1);
  const auto left = played.of(0), right = played.of(1);
  ASSERT_EQ(left.size(), 8U);
  ASSERT_EQ(right.size(), 8U);
  EXPECT_EQ(common(left[3], left[4]), 0U);
  EXPECT_GT(common(left[4], left[5]), 180U);
  EXPECT_EQ(left[7].t_ns, stamp_of(9) - 2'000'000'000);
}

TEST(KltTracker, GoesOnWithAClockThatIsSetBackWhileAnImageIsMissing) {
  std::vector<Measurement> input = drive(20, 2);
  for (int i = 4; i < 20; ++i) {
    for (const int camera : {0, 1}) {
      input[static_cast<std::size_t>(2 * i + camera)] =
          sample_of(rig().render(i, camera), camera, stamp_of(i) - 2'000'000'000);
    }
  }
  input.erase(input.begin() + 7);  // the right one of the last pair before
  const Played played = track(input, section({}, 2), /*is_set_back=*/true);
  EXPECT_LE(played.rejections.at("image whose stamp is not after the previous one").count, 5);
  EXPECT_GE(played.of(0).size(), 17U);
  EXPECT_GE(played.of(1).size(), 16U);
}

/// `n` images of camera 0, those of [from, to) of another size.
std::vector<Measurement> drive_with_small_images(int n, int from, int to) {
  std::vector<Measurement> input = drive(n, 1);
  for (int i = from; i < to; ++i) {
    input[static_cast<std::size_t>(i)] =
        sample_of({320, 240, std::vector<std::uint8_t>(320 * 240, 99)}, 0, stamp_of(i));
  }
  return input;
}

TEST(KltTracker, TracksOverAnImageOfAnotherSize) {
  const Played played = track(drive_with_small_images(4, 2, 3), section({}, 1));
  ASSERT_EQ(played.samples.size(), 3U);
  EXPECT_GT(common(played.samples[1], played.samples[2]), 170U);
  const RejectionCount& count = played.rejections.at("image of another size than the camera's");
  EXPECT_EQ(count.count, 1);
  EXPECT_EQ(count.first, "camera 0 at 5.200000000 s: 320 x 240 pixels");
}

/// An image whose size is known, and whose pixels take hours.
class LargeImage final : public ImageSource {
 public:
  void read(Image&) const override { ADD_FAILURE() << "nobody asked for the pixels"; }
  void read_of_size(int, int, Image& out) const override { out = {32768, 1024, {}}; }
};

TEST(KltTracker, DecodesNoImageOfAnotherSize) {
  std::vector<Measurement> input = drive(4, 1);
  input[2] = ImageSample{stamp_of(2), 0, std::make_shared<LargeImage>()};
  const Played played = track(input, section({}, 1));
  EXPECT_EQ(played.samples.size(), 3U);
  EXPECT_EQ(played.rejections.at("image of another size than the camera's").first,
            "camera 0 at 5.200000000 s: 32768 x 1024 pixels");
}

TEST(KltTracker, RefusesImagesThatAreAllOrTenInARowOfAnotherSize) {
  const auto failure = [](int n, int from, int to) {
    return failure_of(drive_with_small_images(n, from, to), section({}, 1));
  };
  const auto refusal = [](const char* stamp) {
    return "the image of camera 0 at " + std::string(stamp) +
           " has 320 x 240 pixels, but cam0 of " + temporary("chain.yaml").string() +
           " has 424 x 400 pixels: is the calibration that of another camera?";
  };
  EXPECT_THAT(failure(2, 0, 2), HasSubstr(refusal("5.000000000 s")));
  EXPECT_THAT(failure(12, 1, 11), HasSubstr(refusal("5.100000000 s")));
  EXPECT_EQ(failure(12, 1, 10), "");
  EXPECT_EQ(failure(2, 0, 1), "");
}

struct Told {
  std::vector<std::string> warnings;
  std::vector<FeatureSample> samples;
  std::vector<RejectionCount> rejections;
};

/// What the tracker says of `input` while it runs.
Told told_of(const std::vector<Measurement>& input) {
  static std::vector<std::string> warnings;
  warnings.clear();
  PluginRegistry own({VIWO_TEST_PLUGIN_DIR},
                     [](const PluginInfo&, LogLevel level, std::string_view text) {
                       if (level == LogLevel::kWarning) warnings.emplace_back(text);
                     });
  FakeInput images(input);
  config::Errors errors;
  const auto sensor =
      own.make_sensor(config::parse(section(), "test.yaml"), "sensor", 1, errors).object;
  errors.throw_if_any();
  sensor->connect(images);
  Told told;
  told.samples = only<FeatureSample>(play(*sensor));
  sensor->rejections(told.rejections);
  told.warnings = warnings;
  return told;
}

TEST(KltTracker, WarnsOnceWhenTheCamerasAreSwapped) {
  for (const bool swapped : {false, true}) {
    std::vector<Measurement> input = drive(13, 2);
    for (Measurement& measurement : input) {
      ImageSample image = *measurement.get_if<ImageSample>();
      if (swapped) image.camera = 1 - image.camera;
      measurement = image;
    }
    const Told told = told_of(input);
    if (!swapped) {
      EXPECT_TRUE(told.warnings.empty());
      EXPECT_TRUE(told.rejections.empty());
      continue;
    }
    ASSERT_EQ(told.warnings.size(), 1U);
    EXPECT_THAT(told.warnings[0], HasSubstr("the two cameras are probably swapped"));
    ASSERT_EQ(told.rejections.size(), 1U);
    EXPECT_EQ(told.rejections[0].reason, "stereo pair that contradicts the extrinsics");
    EXPECT_EQ(told.rejections[0].count, 13);
    EXPECT_EQ(told.rejections[0].of, 13);
    EXPECT_LT(told.samples.back().points.size(), 60U);
  }
}

TEST(KltTracker, WarnsOnceWhenTheSecondCameraSeesNothingOfTheFirst) {
  std::mt19937 random(1);
  std::vector<Measurement> input;
  for (int i = 0; i < 12; ++i) {
    Image noise = rig().render(i, 1);
    for (std::uint8_t& pixel : noise.pixels) pixel = static_cast<std::uint8_t>(random());
    input.emplace_back(sample_of(rig().render(i, 0), 0, stamp_of(i)));
    input.emplace_back(sample_of(std::move(noise), 1, stamp_of(i)));
  }
  const Told told = told_of(input);
  ASSERT_EQ(told.warnings.size(), 1U);
  EXPECT_THAT(told.warnings[0], HasSubstr("points of camera 0 are found in camera 1, which by "));
  ASSERT_EQ(told.rejections.size(), 1U);
  EXPECT_EQ(told.rejections[0].count, 12);
  EXPECT_EQ(told.rejections[0].of, 12);
}

TEST(KltTracker, WarnsOnceWhenLeftAndRightDoNotComeTogether) {
  // GIVEN right images behind the left ones, and before them though they come later
  for (const std::int64_t offset_ns : {5'000'000, -5'000'000}) {
    std::vector<Measurement> input = drive(12, 2);
    for (Measurement& measurement : input) {
      ImageSample image = *measurement.get_if<ImageSample>();
      if (image.camera == 1) image.t_ns += offset_ns;
      measurement = image;
    }
    EXPECT_THAT(told_of(input).warnings,
                ::testing::ElementsAre("no pair of images yet: the nearest stamps differ by 5.0 "
                                       "ms, max_camera_dt_s is 0.003"));
  }
  EXPECT_THAT(told_of(drive(12, 1)).warnings,
              ::testing::ElementsAre("no pair of images yet: only camera 0 gives images"));
  EXPECT_TRUE(told_of(drive(9, 1)).warnings.empty());
}

TEST(KltTracker, SaysWhatIsWrongWithItsParameters) {
  write_png(temporary("small.png"), {32, 24, std::vector<std::uint8_t>(32 * 24, 0)});
  EXPECT_THAT(error_of(section("mask0: " + temporary("small.png").string() + "\n")),
              HasSubstr("small.png has 32 x 24 pixels, camera 0 has 424 x 400 pixels"));
  EXPECT_THAT(error_of(section("mask1: /no/such.png\n")),
              HasSubstr("/no/such.png: the image is missing or cannot be read"));
  EXPECT_THAT(error_of(section("n_cameras: 2\n", 1)), HasSubstr("there are only 1 cameras in"));
  EXPECT_THAT(error_of("type: klt_tracker\ncameras: " + chain_file(2, 0.02) + "\n"),
              HasSubstr("timeshift_cam_imu of cam0 and cam1 differ by 0.016000 s"));
  EXPECT_EQ(error_of("type: klt_tracker\ncameras: " + chain_file(2, 0.02) + "\nn_cameras: 1\n"),
            "");
}

TEST(KltTracker, SaysThatItsInputHasNoImages) {
  EXPECT_EQ(failure_of({ImuSample{}, ImuSample{}}, section()),
            "klt_tracker: its input gives no image of camera 0 or 1, only 2 other measurements");
}

}  // namespace
}  // namespace viwo::klt
