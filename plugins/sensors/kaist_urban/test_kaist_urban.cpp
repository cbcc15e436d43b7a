// The sensor kaist_urban as the host loads it, on sequences whose content is known.
#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>

#include "message_of.hpp"
#include "support.hpp"
#include "test_sequence.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class KaistUrban : public testing::InFolder {
 protected:
  void SetUp() override {
    sequence_.duration_s = 1.;
    sequence_.write(folder_);
  }

  std::string yaml(const std::string& rest = "") const {
    return "{type: kaist_urban, path: " + folder_.string() + rest + "}";
  }
  /// With one kind alone.
  std::string only_yaml(const std::string& kind, const std::string& rest = "") const {
    std::string text;
    for (const char* other : {"imu", "wheels", "images", "reference"}) {
      if (other != kind) text += std::string(", ") + other + ": false";
    }
    return yaml(text + rest);
  }

  /// The message, with TMP for the sequence's folder.
  std::string refusal(const std::string& section) const {
    std::string text = error_of(section);
    const std::string name = folder_.string();
    for (std::size_t i = 0; (i = text.find(name, i)) != std::string::npos;) {
      text.replace(i, name.size(), "TMP");
    }
    return text;
  }

  kaist::TestSequence sequence_;
};

TEST_F(KaistUrban, TurnsCountsIntoTheMeanRatesBetweenTheRows) {
  write("sensor_data/encoder.csv", "1000000000,100,-50\n1010000000,141,-50\n1030000000,141,-40\n");
  const auto cells = play_only<EncoderSample>(only_yaml("wheels"));
  ASSERT_EQ(cells.size(), 2U);
  const double tick = 2. * M_PI / 4096.;
  EXPECT_EQ(cells[0].begin_ns, 1'000'000'000);
  EXPECT_EQ(cells[0].end_ns, 1'010'000'000);
  EXPECT_EQ(cells[0].t_ns, 1'005'000'000);
  EXPECT_EQ(cells[0].n_drive, 2);
  EXPECT_EQ(cells[0].n_steer, 0);
  EXPECT_NEAR(cells[0].drive_rad_per_s[0], 41. * tick / 0.01, 1e-9);
  EXPECT_DOUBLE_EQ(cells[0].drive_rad_per_s[1], 0.);
  EXPECT_DOUBLE_EQ(cells[1].drive_rad_per_s[0], 0.);
  EXPECT_NEAR(cells[1].drive_rad_per_s[1], 10. * tick / 0.02, 1e-9);
  const auto reversed = play_only<EncoderSample>(only_yaml("wheels", ", drive_scale: [1, -1]"));
  ASSERT_EQ(reversed.size(), 2U);
  EXPECT_EQ(reversed[0].drive_rad_per_s[0], cells[0].drive_rad_per_s[0]);
  EXPECT_EQ(reversed[1].drive_rad_per_s[1], -cells[1].drive_rad_per_s[1]);
}

TEST_F(KaistUrban, PrefersTheResolutionOfTheConfigurationToThatOfTheFile) {
  write("sensor_data/encoder.csv", "1000000000,0,0\n2000000000,10,20\n");
  const std::string resolution = ", encoder_resolution: 100, max_gap_s: 2";
  const auto expect = [&] {
    const auto cells = play_only<EncoderSample>(only_yaml("wheels", resolution));
    ASSERT_EQ(cells.size(), 1U);
    EXPECT_NEAR(cells[0].drive_rad_per_s[0], 0.2 * M_PI, 1e-12);
    EXPECT_NEAR(cells[0].drive_rad_per_s[1], 0.4 * M_PI, 1e-12);
  };
  expect();
  fs::remove(folder_ / "calibration/EncoderParameter.txt");
  expect();
}

TEST_F(KaistUrban, ReadsRatesAndSpecificForcesOfTheImu) {
  write("sensor_data/xsens_imu.csv",
        "1544581170000000000,1,2,3,4,5,6,7,0.1,-0.2,0.3,1.5,-2.5,9.75,14,15,16\r\n");
  const auto imu = play_only<ImuSample>(only_yaml("imu"));
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].t_ns, 1'544'581'170'000'000'000);
  EXPECT_EQ(imu[0].gyro_rad_per_s, (std::array{0.1, -0.2, 0.3}));
  EXPECT_EQ(imu[0].accel_m_per_s2, (std::array{1.5, -2.5, 9.75}));
}

TEST_F(KaistUrban, MakesQuaternionsOfRoundedMatricesAndKeepsPositions) {
  // 120 degrees about (1, 1, 1): x to y, y to z, z to x; rounding of 1e-4.
  write("global_pose.csv",
        "7,0,0,1.0001,327365.8125,1,0.0001,0,4151234.0625,0,0.9999,0,-22.5\n"
        "8,1,0,0,1,0,-1,0,2,0,0,-1,3\n");
  const auto poses = play_only<PoseSample>(only_yaml("reference"));
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].t_ns, 7);
  EXPECT_EQ(poses[0].p_BinW_m, (std::array{327365.8125, 4151234.0625, -22.5}));
  for (const double q : poses[0].q_BtoW_xyzw) {
    EXPECT_NEAR(q * (poses[0].q_BtoW_xyzw[3] > 0. ? 1. : -1.), 0.5, 1e-4);
  }
  double norm2 = 0.;
  for (const double q : poses[0].q_BtoW_xyzw) norm2 += q * q;
  EXPECT_NEAR(norm2, 1., 1e-14);
  EXPECT_NEAR(std::abs(poses[1].q_BtoW_xyzw[0]), 1., 1e-14);  // half a turn about x
}

TEST_F(KaistUrban, TurnsBayerImagesIntoGreyOnes) {
  const auto images = play_only<ImageSample>(only_yaml("images"));
  ASSERT_EQ(images.size(), 20U);
  for (int i = 0; i < 10; ++i) {
    const double grey =
        0.299 * sequence_.red(i) + 0.587 * sequence_.green(i) + 0.114 * sequence_.blue(i);
    for (int camera = 0; camera < 2; ++camera) {
      const ImageSample& sample = images[static_cast<std::size_t>(2 * i + camera)];
      EXPECT_EQ(sample.camera, camera);
      EXPECT_EQ(sample.t_ns, sequence_.image_stamp_ns(i));
      Image image;
      sample.source->read(image);
      ASSERT_EQ(image.width_px, 8);
      ASSERT_EQ(image.height_px, 6);
      ASSERT_EQ(image.pixels.size(), 48U);
      for (const std::uint8_t pixel : image.pixels) EXPECT_NEAR(pixel, grey, 1.) << i;
    }
  }
}

TEST_F(KaistUrban, GivesEachPixelTheColoursOfItsNeighbours) {
  // Red alone, from 0 in the first column pair to 255 in the last: grey is 0.299 of it everywhere.
  Image image = kaist::bayer_image(16, 8, 0, 0, 0);
  for (int v = 0; v < 8; v += 2) {
    for (int u = 0; u < 16; u += 2) {
      image.pixels[static_cast<std::size_t>(16 * v + u)] = static_cast<std::uint8_t>(16 * u);
    }
  }
  const std::string name = std::to_string(sequence_.image_stamp_ns(0)) + ".png";
  write_png(folder_ / "image/stereo_left" / name, image);
  const auto images = play_only<ImageSample>(only_yaml("images"));
  Image grey;
  images.at(0).source->read(grey);
  for (int v = 1; v < 7; ++v) {
    for (int u = 1; u < 14; ++u) {
      EXPECT_NEAR(grey.pixels[static_cast<std::size_t>(16 * v + u)], 0.299 * 16. * u, 1.)
          << u << " " << v;
    }
  }
}

TEST_F(KaistUrban, PlaysEverythingInTheOrderOfTime) {
  const auto all = play(*make_sensor(yaml()));  // which looks at the order
  EXPECT_EQ(only<PoseSample>(all).size(), 101U);
  EXPECT_EQ(only<ImuSample>(all).size(), 101U);
  EXPECT_EQ(only<EncoderSample>(all).size(), 100U);
  EXPECT_EQ(only<ImageSample>(all).size(), 20U);
  EXPECT_EQ(all.size(), 322U);
  EXPECT_THAT(kinds_of(*make_sensor(yaml())), ElementsAre("encoders", "images", "imu", "poses"));
  EXPECT_THAT(kinds_of(*make_sensor(only_yaml("images"))), ElementsAre("images"));
  // Left before right at the same stamp; nothing was dropped.
  EXPECT_EQ(only<ImageSample>(all)[0].camera, 0);
  EXPECT_EQ(only<ImageSample>(all)[1].camera, 1);
  EXPECT_THAT(rejections_of(*make_sensor(yaml())), ElementsAre());
}

TEST_F(KaistUrban, CutsAWholePartOut) {
  const auto all = play(*make_sensor(yaml(", start_s: 0.2, duration_s: 0.1")));
  const std::int64_t from_ns = sequence_.begin_ns + 200'000'000;
  const std::int64_t to_ns = from_ns + 100'000'000;
  const auto cells = only<EncoderSample>(all);
  ASSERT_EQ(cells.size(), 10U);
  EXPECT_EQ(cells.front().begin_ns, from_ns);
  EXPECT_EQ(cells.back().end_ns, to_ns);
  const auto imu = only<ImuSample>(all);
  ASSERT_EQ(imu.size(), 11U);
  EXPECT_EQ(imu.front().t_ns, from_ns);
  EXPECT_EQ(imu.back().t_ns, to_ns);
  EXPECT_EQ(only<PoseSample>(all).size(), 11U);
  ASSERT_EQ(only<ImageSample>(all).size(), 2U);
  EXPECT_EQ(only<ImageSample>(all)[0].t_ns, sequence_.image_stamp_ns(2));
  EXPECT_EQ(play(*make_sensor(yaml(", start_s: 0.95"))).size(), 5U + 6U + 6U);
}

TEST_F(KaistUrban, CountsWhatItDrops) {
  const std::string image = std::to_string(sequence_.image_stamp_ns(3)) + ".png";
  fs::remove(folder_ / "image/stereo_right" / image);
  EXPECT_THAT(rejections_of(*make_sensor(only_yaml("images"))),
              ElementsAre("image that is missing in stereo_right | 1 | stereo_stamp.csv:4"));
  const auto images = play_only<ImageSample>(only_yaml("images"));
  EXPECT_EQ(images.size(), 19U);

  std::string poses = "10,1,0,0,1,0,1,0,2,0,0,1,3\n";
  for (const char* row : {"20,1,0,0,1,0,1,0,2,0,0,0.9,3\n", "30,1,0,0,1,0,1,0,2,0,0,-1,3\n",
                          "40,nan,0,0,1,0,1,0,2,0,0,1,3\n", "50,1,0,0,1,0,1,0,inf,0,0,1,3\n",
                          "10,1,0,0,1,0,1,0,2,0,0,1,3\n", "900000000,1,0,0,1,0,1,0,2,0,0,1,3\n"}) {
    poses += row;
  }
  write("global_pose.csv", poses);
  EXPECT_THAT(rejections_of(*make_sensor(only_yaml("reference", ", max_rejected_fraction: 0.8"))),
              ElementsAre("pose whose matrix is no rotation | 3 | global_pose.csv:2",
                          "value that is not finite | 1 | global_pose.csv:5",
                          "stamp not after the previous one | 1 | global_pose.csv:6",
                          "gap longer than 0.2 s | 1 | global_pose.csv:7"));
  EXPECT_THAT(refusal(only_yaml("reference")),
              HasSubstr("TMP/global_pose.csv  5 of 7 data rejected, allowed is a fraction of 0.1: "
                        "pose whose matrix is no rotation (3, first at global_pose.csv:2); value "
                        "that is not finite (1, first at global_pose.csv:5); stamp not after the "
                        "previous one (1, first at global_pose.csv:6)"));
}

TEST_F(KaistUrban, DropsPosesWithoutANumberAnywhereInTheMatrix) {
  const std::vector<std::string> identity{"1", "0", "0", "0", "1", "0", "0", "0", "1"};
  std::string poses = "10,1,0,0,1,0,1,0,2,0,0,1,3\n";
  for (std::size_t k = 0; k < identity.size(); ++k) {
    poses += std::to_string(20 + 10 * k);
    for (std::size_t i = 0; i < identity.size(); ++i) {
      poses += "," + (i == k ? "nan" : identity[i]) + (i % 3 == 2 ? ",1" : "");
    }
    poses += "\n";
  }
  write("global_pose.csv", poses);
  const std::string yaml = only_yaml("reference", ", max_rejected_fraction: 0.95");
  EXPECT_THAT(rejections_of(*make_sensor(yaml)),
              ElementsAre("pose whose matrix is no rotation | 9 | global_pose.csv:2"));
  EXPECT_EQ(play_only<PoseSample>(yaml).size(), 1U);
}

TEST_F(KaistUrban, RefusesImagesOfWhichManyAreMissing) {
  for (const int i : {0, 4}) {
    fs::remove(folder_ / "image/stereo_left" /
               (std::to_string(sequence_.image_stamp_ns(i)) + ".png"));
  }
  EXPECT_THAT(refusal(only_yaml("images")),
              HasSubstr("TMP/sensor_data/stereo_stamp.csv  2 of 10 data rejected, allowed is a "
                        "fraction of 0.1: image that is missing in stereo_left (2, first at "
                        "stereo_stamp.csv:1)"));
}

TEST_F(KaistUrban, FindsABrokenImageWhenItIsRead) {
  const fs::path file =
      folder_ / "image/stereo_left" / (std::to_string(sequence_.image_stamp_ns(0)) + ".png");
  const auto why = [&] {
    const auto images = play_only<ImageSample>(only_yaml("images"));
    Image image;
    return testing::error_of([&] { images.at(0).source->read(image); });
  };
  EXPECT_EQ(why(), "");
  fs::resize_file(file, fs::file_size(file) - 20);
  EXPECT_EQ(why(), file.string() + ": the image is cut short");
  write_png(file, kaist::bayer_image(2, 2, 1, 2, 3));
  EXPECT_EQ(why(), file.string() + ": the image is too small for a Bayer pattern");
}

TEST_F(KaistUrban, NamesWhatIsMissingAndHowToDoWithoutIt) {
  const auto without = [&](const std::string& what) {
    fs::rename(folder_ / what, folder_.string() + "_moved");
    const std::string text = refusal(yaml());
    fs::rename(folder_.string() + "_moved", folder_ / what);
    return text;
  };
  EXPECT_THAT(without("sensor_data/encoder.csv"),
              HasSubstr("TMP/sensor_data/encoder.csv is missing: the counts of the wheel encoders "
                        "are in it (wheels: false does without) - there are: stereo_stamp.csv, "
                        "xsens_imu.csv"));
  EXPECT_THAT(without("sensor_data/xsens_imu.csv"),
              HasSubstr("TMP/sensor_data/xsens_imu.csv is missing: the inertial measurements are "
                        "in it (imu: false does without) - there are: encoder.csv, "
                        "stereo_stamp.csv"));
  EXPECT_THAT(without("sensor_data/stereo_stamp.csv"),
              HasSubstr("TMP/sensor_data/stereo_stamp.csv is missing: the stamps of the images are "
                        "in it (images: false does without) - there are: encoder.csv, "
                        "xsens_imu.csv"));
  EXPECT_THAT(without("global_pose.csv"),
              HasSubstr("TMP/global_pose.csv is missing: the reference poses are in it (reference: "
                        "false does without) - there are: calibration, image, sensor_data"));
  EXPECT_THAT(
      without("calibration"),
      HasSubstr("TMP/calibration/EncoderParameter.txt is missing: it says how many counts a "
                "turn of a wheel has (encoder_resolution: N does without); there is no "
                "folder calibration"));
  EXPECT_THAT(without("image/stereo_right"),
              HasSubstr("TMP/image/stereo_right is missing: the images of the right camera are in "
                        "it (images: false does without) - there are: stereo_left"));
  fs::remove(folder_ / "calibration/EncoderParameter.txt");
  EXPECT_THAT(refusal(yaml()), HasSubstr("; the folder calibration is empty"));
}

TEST_F(KaistUrban, SaysWhereARowIsWrong) {
  const auto refused = [&](const std::string& file, const std::string& text,
                           const std::string& kind, const std::string& message) {
    write(file, text);
    EXPECT_THAT(refusal(only_yaml(kind)), HasSubstr("TMP/" + file + message)) << text;
  };
  const std::string encoder = "sensor_data/encoder.csv", imu = "sensor_data/xsens_imu.csv";
  refused(encoder, "1,2,3\n2,3\n", "wheels",
          ":2  2 fields where a row has 3: timestamp_ns, left count, right count");
  refused(encoder, "1,2,3\n\n2,3,4.5\n", "wheels", ":3  field 3: '4.5' is not an integer");
  refused(encoder, "time,2,3\n", "wheels", ":1  field 1: 'time' is not an integer");
  refused(encoder, "5000000000000000000,2,3\n", "wheels",
          ":1  field 1: '5000000000000000000' is no stamp in nanoseconds");
  refused(encoder, "", "wheels", ":1  the file is empty");
  refused(encoder, "1,2,3\n", "wheels", "  has too few readings without a gap for a rate");
  refused(imu, "1,1,0,0,0,0,0,0\n", "imu",
          ":1  8 fields: the orientation alone, as in the first release of the dataset; angular "
          "rate and specific force are needed (17 fields): take the newer release of this sequence "
          "(imu: false does without)");
  refused(
      imu, "1,2\n", "imu",
      ":1  2 fields where a row has 17: timestamp_ns, quaternion (4), Euler angles (3), angular "
      "rate (3), specific force (3), magnetic field (3)");
  refused(imu, "1,1,0,0,0,0,0,0,1,x,1,1,1,1,1,1,1\n", "imu", ":1  field 10: 'x' is not a number");
  refused("global_pose.csv", "1\n", "reference",
          ":1  1 field where a row has 13: timestamp_ns, the 3 x 4 matrix [R | p] of the vehicle "
          "row after row");
  refused("sensor_data/stereo_stamp.csv", "1,2\n", "images",
          ":1  2 fields where a row has 1: timestamp_ns");
}

TEST_F(KaistUrban, RefusesAnEncoderResolutionThatIsNone) {
  const auto refused = [&](const std::string& text, const std::string& message) {
    write("calibration/EncoderParameter.txt", text);
    EXPECT_THAT(refusal(only_yaml("wheels")),
                HasSubstr("TMP/calibration/EncoderParameter.txt" + message));
  };
  refused("Encoder\nEncoder resolution: x\n", ":2  'x' is no number of counts");
  refused("Encoder resolution: 0\n", ":1  '0' is no number of counts");
  refused("Encoder wheel base: 1.5\n",
          "  has no line 'Encoder resolution: N' (encoder_resolution: N does without)");
}

TEST_F(KaistUrban, RefusesToReadNothing) {
  EXPECT_THAT(refusal(yaml(", imu: false, wheels: false, images: false, reference: false")),
              HasSubstr("nothing to read: imu, wheels, images and reference are all false"));
  EXPECT_THAT(refusal(yaml(", start_s: 2")),
              HasSubstr("nothing is left: what is read is 1 s long"));
  EXPECT_THAT(refusal("{type: kaist_urban, path: " + (folder_ / "none").string() + "}"),
              HasSubstr("TMP/none is no folder"));
}

}  // namespace
}  // namespace viwo
