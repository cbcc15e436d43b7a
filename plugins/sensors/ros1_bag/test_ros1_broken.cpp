// The sensor ros1_bag as the host loads it: what it drops, counts and refuses.
#include <limits>
#include <random>

#include "message_of.hpp"
#include "test_fixture.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::StartsWith;

TEST_F(Ros1Bag, NamesTheTopicsThatThereAre) {
  write_drive();
  const std::string in_file = " in " + file();
  EXPECT_THAT(error_of(section("imu_topic: /imu1")),
              HasSubstr("sensor.imu_topic: no topic '/imu1'" + in_file +
                        " - did you mean '/imu0'? - of type sensor_msgs/Imu there are: /imu0"));
  EXPECT_THAT(error_of(section("image_topics: [/camera]")),
              HasSubstr("sensor.image_topics: no topic '/camera'" + in_file +
                        " - of type sensor_msgs/Image or sensor_msgs/CompressedImage there are: "
                        "/cam0/image_raw, /cam1/image_raw"));
  EXPECT_THAT(error_of(section("odometry_topic: /odom")),
              HasSubstr("sensor.odometry_topic: no topic '/odom'" + in_file +
                        " - there is no topic of type nav_msgs/Odometry"));
  EXPECT_THAT(error_of(section("imu_topic: /truth")),
              HasSubstr("sensor.imu_topic: topic '/truth'" + in_file +
                        " is of type geometry_msgs/PoseStamped, needed is sensor_msgs/Imu - there "
                        "are: /imu0"));
}

TEST_F(Ros1Bag, NamesTheJointsThatThereAre) {
  write_drive();
  EXPECT_THAT(error_of(section("joint_topic: /joint_states, drive_joints: [drive_1, drive_3]")),
              HasSubstr("sensor.drive_joints: no joint 'drive_3' on topic '/joint_states' in " +
                        file() + " - did you mean 'drive_1'?"));
  EXPECT_THAT(error_of(section("joint_topic: /joint_states, drive_joints: [drive_1], "
                               "steer_joints: [rudder]")),
              HasSubstr("sensor.steer_joints: no joint 'rudder' on topic '/joint_states' in " +
                        file() + " - there are: steer_1, drive_1, arm, drive_2"));
}

TEST_F(Ros1Bag, RefusesParametersThatContradictEachOther) {
  write_drive();
  EXPECT_THAT(error_of(section("clock: stamp")),
              HasSubstr("sensor.path: nothing to read: give one of imu_topic, image_topics"));
  EXPECT_THAT(error_of(section("joint_topic: /joint_states")),
              HasSubstr("sensor.joint_topic: a joint_topic needs drive_joints"));
  EXPECT_THAT(error_of(section("imu_topic: /imu0, drive_joints: [a]")),
              HasSubstr("sensor.drive_joints: names of joints need the joint_topic"));
  EXPECT_THAT(error_of(section("pose_topic: /truth, odometry_topic: /o")),
              HasSubstr("sensor.odometry_topic: pose_topic and odometry_topic both give poses"));
  EXPECT_THAT(error_of(section("image_topics: [/cam0/image_raw, /cam0/image_raw]")),
              HasSubstr("sensor.image_topics: '/cam0/image_raw' is there twice"));
  EXPECT_THAT(error_of(section("imu_topic: /imu0, paths: [b.bag]")),
              HasSubstr("sensor.paths: names of bags need a folder as path"));
}

TEST_F(Ros1Bag, CountsStampsThatGoBackGapsAndValuesThatAreNoNumbers) {
  {
    Ros1Writer out(file());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::int64_t received = kStart;
    for (const std::int64_t ms : {0, 5, 3, 10, 500}) {
      out.write_imu("/imu0", {kStart + ms * kMs, received += kMs}, {}, {});
    }
    out.write_imu("/imu0", {kStart + 510 * kMs, received += kMs}, {0., nan, 0.}, {});
    out.close();
  }
  EXPECT_THAT(rejections_of(*make_sensor(section("imu_topic: /imu0, max_rejected_fraction: 0.4"))),
              ElementsAre("/imu0: stamp not after the previous one | 1 | a.bag: message 3",
                          "/imu0: gap longer than 0.2 s | 1 | a.bag: message 5",
                          StartsWith("/imu0: value that is not finite | 1 | ")));
  EXPECT_THAT(error_of(section("imu_topic: /imu0")), HasSubstr("2 of 6 messages rejected"));
  const auto later = testing::all_rejections(
      *make_sensor(section("imu_topic: /imu0, start_s: 0.001, max_rejected_fraction: 0.5")));
  ASSERT_EQ(later.size(), 3U);
  EXPECT_EQ(later[0].first, "a.bag: message 3") << "of the file, wherever the reading begins";
}

TEST_F(Ros1Bag, CountsAMessageThatIsBroken) {
  write_drive();
  // The number of names stands before the length of the first one.
  patch("steer_1", 3, -8, "\xff\xff\xff\x7f");
  const auto sensor = make_sensor(section(kAll));
  EXPECT_EQ(only<EncoderSample>(play(*sensor)).size(), 19U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(AllOf(
                  StartsWith("/joint_states: broken message: a list is longer than its message | "),
                  EndsWith(" | a.bag: message 3"))));
}

TEST_F(Ros1Bag, ABrokenImageIsAnErrorWhenItIsRead) {
  {
    Ros1Writer out(file());
    out.write_image("/cam0", {1, 1}, {3, 2, "mono8", false, 4, {1, 2, 3, 4, 5, 6}});
    std::vector<std::uint8_t> png = encode_png({2, 1, {17, 200}});
    png.resize(png.size() / 2);
    out.write_compressed_image("/cam1", {1, 1}, "png", png);
    out.write_image("/depth", {1, 1}, {1, 1, "32FC1", false, 4, {1, 2, 3, 4}});
    out.close();
  }
  const auto images = play_only<ImageSample>(section("image_topics: [/cam0, /cam1]"));
  ASSERT_EQ(images.size(), 2U);
  const auto error = [](const ImageSample& sample) {
    return testing::error_of([&] { read_image(sample); });
  };
  EXPECT_EQ(error(images[0]), file() +
                                  ": /cam0 message 1: an image of 3 x 2 mono8 in rows of 4 "
                                  "bytes has 6 bytes of pixels");
  EXPECT_EQ(error(images[1]), file() + ": /cam1 message 1: the image is cut short");
  EXPECT_THAT(error_of(section("image_topics: [/depth]")),
              HasSubstr(file() + "  topic '/depth' has images of encoding '32FC1': what is read "
                                 "is mono8, "));
}

TEST_F(Ros1Bag, SaysWhatToDoWithABagThatWasCutShort) {
  write_drive();
  const std::string whole = read();
  for (const double part : {0.01, 0.5, 0.99}) {
    fs::resize_file(file(), static_cast<std::uintmax_t>(part * static_cast<double>(whole.size())));
    const std::string error = error_of(section(kAll));
    EXPECT_THAT(error, HasSubstr(file() + "  is cut short or damaged: ")) << part;
    EXPECT_THAT(error, HasSubstr("`rosbag reindex " + file() + "`")) << part;
    std::ofstream(file(), std::ios::binary) << whole;
  }
  // As a recorder leaves it that was killed.
  patch("index_pos=", 1, 10, std::string(8, '\0'));
  EXPECT_THAT(error_of(section(kAll)),
              HasSubstr(file() + "  has no index: its recording was not ended - `rosbag reindex " +
                        file() + "` mends what can be mended"));
}

TEST_F(Ros1Bag, RefusesWhatIsNoBag) {
  EXPECT_THAT(error_of(section(kAll, "no.bag")),
              HasSubstr(file("no.bag") + "  cannot be read: No such file or directory"));
  std::ofstream(file("empty.bag")).flush();
  EXPECT_THAT(error_of(section(kAll, "empty.bag")), HasSubstr(file("empty.bag") + "  is empty"));
  std::ofstream(file("text.bag")) << "timestamp_ns,x\n1,2\n";
  EXPECT_THAT(error_of(section(kAll, "text.bag")),
              HasSubstr(file("text.bag") + "  is no ROS 1 bag"));
  std::ofstream(file("other.bag")) << "\x89MCAP0\r\n";
  EXPECT_THAT(error_of(section(kAll, "other.bag")), HasSubstr("did you mean type: ros2_bag?"));
}

TEST_F(Ros1Bag, RefusesADamagedChunk) {
  write_drive(200, "bz2");
  patch("BZh", 2, 60, std::string(40, '\x55'));
  EXPECT_THAT(error_of(section(kAll)), HasSubstr(file() + "  is damaged: "));
}

TEST_F(Ros1Bag, SurvivesBytesThatAreWrongAnywhere) {
  for (const std::string compression : {"none", "lz4"}) {
    write_drive(40, compression);
    const std::string whole = read();
    std::mt19937_64 random(5);
    int refused = 0;
    for (int k = 0; k < 300; ++k) {
      std::string content = whole;
      for (std::uint64_t i = 0; i <= random() % 3; ++i) {
        content[random() % content.size()] = static_cast<char>(random());
      }
      std::ofstream(file(), std::ios::binary) << content;
      try {
        for (const ImageSample& image : only<ImageSample>(play(*make_sensor(section(kAll))))) {
          read_image(image);
        }
      } catch (const InputError&) {
        ++refused;  // anything else, or a crash, ends the test
      }
    }
    EXPECT_GT(refused, 50) << compression;
    EXPECT_LT(refused, 299) << compression;
  }
}

/// A number as the format has it.
template <class T>
std::string raw(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

std::string with_length(const std::string& text) {
  return raw(static_cast<std::uint32_t>(text.size())) + text;
}

std::string record(const std::vector<std::string>& fields, const std::string& data) {
  std::string header;
  for (const std::string& field : fields) header += with_length(field);
  return with_length(header) + with_length(data);
}

/// A bag of one message in each of its chunks, which say to become so long.
std::string compressed_bag(const std::vector<std::uint32_t>& sizes, const std::string& bytes) {
  std::string out = "#ROSBAG V2.0\n" + record({"op=\x03", "index_pos=" + raw(std::uint64_t{13}),
                                               "conn_count=" + raw(std::uint32_t{1}),
                                               "chunk_count=" + raw(std::uint32_t{1})},
                                              "");
  for (const std::uint32_t size : sizes) {
    out += record({"op=\x05", "compression=bz2", "size=" + raw(size)}, bytes);
    out += record({"op=\x04", "ver=" + raw(std::uint32_t{1}), "conn=" + raw(std::uint32_t{0}),
                   "count=" + raw(std::uint32_t{1})},
                  std::string(12, '\0'));
  }
  return out + record({"op=\x07", "conn=" + raw(std::uint32_t{0}), "topic=/imu0"}, "");
}

TEST_F(Ros1Bag, RefusesWhatRosWouldBelieveBeyondTheEndOfARecord) {
  write_drive();
  const std::string whole = read();
  std::string content = whole;
  // The header that a publisher gave, in the index.
  content.replace(content.rfind("message_definition=") - 4, 4, raw(std::uint32_t{900'000}));
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section(kAll)), HasSubstr("the header of a record is wrong"));
  content = whole;  // two fields of one name, of which roscpp takes the last
  content.replace(content.find("ver="), 4, "op=\x04");
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section(kAll)), HasSubstr("the header of a record is wrong"));
  content = whole;
  const auto place = content.find("index_pos=") + 10;
  content[place] = static_cast<char>(content[place] ^ 1);
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section(kAll)),
              HasSubstr("there is no record where the index should begin"));
}

TEST_F(Ros1Bag, RefusesChunksThatTakeMoreThanARecordingDoes) {
  const auto error = [this](const std::vector<std::uint32_t>& sizes, const std::string& bytes) {
    std::ofstream(file(), std::ios::binary) << compressed_bag(sizes, bytes);
    return error_of(section("imu_topic: /imu0"));
  };
  EXPECT_THAT(error({200'000'000}, "BZh91"),
              HasSubstr("a chunk says to become 200000000 bytes, at most 134217728 are read"));
  EXPECT_THAT(error({100 << 20}, "BZh91"),
              HasSubstr("the chunks say to become more than 300 times as long as the file"));
  EXPECT_THAT(error({100}, "BZh91"), HasSubstr("cannot be decompressed: "));
  // 16 bytes: the length of a header, which is 2 GiB.
  const std::string lies(
      "\x42\x5a\x68\x39\x31\x41\x59\x26\x53\x59\x5e\x64\x96\x44\x00\x00\x04\x40"
      "\x80\xc0\x40\x00\x00\x80\x00\xa0\x00\x21\x21\xa0\xcd\x34\xd4\x18\xf1\x77"
      "\x24\x53\x85\x09\x05\xe6\x49\x64\x40",
      45);
  EXPECT_THAT(error({16}, lies), HasSubstr("at byte 0, a record goes beyond the end"));
}

TEST_F(Ros1Bag, RefusesMessagesThatAlternateBetweenLargeChunks) {
  const auto time_of = [](int k) { return kStart + (k < 500 ? 2 * k : 2 * (k - 500) + 1) * kMs; };
  {
    Ros1Writer out(file(), "bz2", 10'000'000);
    constexpr std::uint32_t kSide = 141;  // 20 kB
    for (int k = 0; k < 1000; ++k) {
      const std::int64_t t_ns = time_of(k);
      out.write_image(
          "/cam0", {t_ns, t_ns},
          {kSide, kSide, "mono8", false, kSide, std::vector<std::uint8_t>(kSide * kSide)});
    }
    out.close();
  }
  const auto refused = HasSubstr(" MiB would be decompressed - `rosbag decompress " + file() +
                                 "` makes it quick to read");
  EXPECT_THAT(error_of(section("image_topics: [/cam0]")), refused);
  // The same times, the later chunk's a second less and so many nanoseconds more.
  std::string content = read();
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto stamp = [](std::int64_t s, std::int64_t ns) {
    return raw(static_cast<std::uint32_t>(s)) + raw(static_cast<std::uint32_t>(ns));
  };
  for (int k = 500; k < 1000; ++k) {
    const std::int64_t s = time_of(k) / kSecond, ns = time_of(k) % kSecond;
    content.replace(content.rfind(stamp(s, ns)), 8, stamp(s - 1, ns + kSecond));
  }
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section("image_topics: [/cam0]")), refused);
}

TEST_F(Ros1Bag, RefusesAnIndexThatNamesAMessageAgainAndAgain) {
  {
    Ros1Writer out(file());
    for (int k = 0; k < 50; ++k) {
      const std::uint32_t side = k == 0 ? 100 : 1;
      out.write_image("/cam0", {kStart + k * kMs, kStart + k * kMs},
                      {side, side, "mono8", false, side, std::vector<std::uint8_t>(side * side)});
    }
    out.close();
  }
  std::string content = read();
  const auto entry = [&content](int k) {  // of the index, which stands behind the messages
    const std::int64_t t_ns = kStart + k * kMs;
    return content.rfind(raw(static_cast<std::uint32_t>(t_ns / 1'000'000'000)) +
                         raw(static_cast<std::uint32_t>(t_ns % 1'000'000'000)));
  };
  const std::string first = content.substr(entry(1) - 4, 4);  // the offset of the large image
  for (int k = 1; k < 49; ++k) content.replace(entry(k) + 8, 4, first);
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section("image_topics: [/cam0]")),
              HasSubstr("a chunk has a message that no index has"));
}

TEST_F(Ros1Bag, RefusesAHeadThatCountsOtherThingsThanThereAre) {
  for (const char* field : {"chunk_count=", "conn_count="}) {
    write_drive();
    patch(field, 1, static_cast<std::ptrdiff_t>(std::string(field).size()), raw(std::uint32_t{1}));
    EXPECT_THAT(error_of(section("imu_topic: /imu0")),
                HasSubstr("the head of the file counts other chunks or connections than there are"))
        << field;
  }
}

TEST_F(Ros1Bag, RefusesAnotherDefinitionOfASecondPublisher) {
  {
    Ros1Writer out(file());
    for (int k = 0; k < 4; ++k) {
      const std::int64_t t_ns = kStart + k * kMs;
      out.write_imu(k < 2 ? "/imu0" : "/imu1", {t_ns, t_ns}, {}, {});
    }
    out.close();
  }
  // The second becomes one of the same topic; its definition stands behind that of the first.
  std::string content = read();
  const std::string md5 = "6a62c6daae103f4ff57a132d6f95cec2";
  for (std::size_t at = 0; (at = content.find("/imu1", at)) != std::string::npos;) {
    content[at + 4] = '0';
    const std::size_t definition = content.find(md5, at);
    if (definition != std::string::npos) content[definition] = '7';
    ++at;
  }
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section("imu_topic: /imu0")), HasSubstr("has another definition of"));
}

TEST_F(Ros1Bag, RefusesAnotherDefinitionOfAMessage) {
  write_drive();
  std::string content = read();
  const std::string md5 = "6a62c6daae103f4ff57a132d6f95cec2";
  for (std::size_t at = 0; (at = content.find(md5, at)) != std::string::npos;) content[at] = '7';
  std::ofstream(file(), std::ios::binary) << content;
  EXPECT_THAT(error_of(section("imu_topic: /imu0")),
              HasSubstr("topic '/imu0' has another definition of sensor_msgs/Imu (md5 7a62c6daae10"
                        "3f4ff57a132d6f95cec2, known is " +
                        md5 + ")"));
}

}  // namespace
}  // namespace viwo
