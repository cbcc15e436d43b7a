// Bags in MCAP, from a writer that is not ours (test_data/README.md): they give what SQLite gives.
#include <cstring>
#include <fstream>
#include <thread>

#include "expect_same.hpp"
#include "ros2_writer.hpp"
#include "test_fixture.hpp"

namespace viwo {
namespace {

using testing::all_rejections;
using testing::text_of;

constexpr const char* kTopics =
    "imu_topic: /imu0, joint_topic: /joints, drive_joints: [drive], steer_joints: [steer], "
    "image_topics: [/cam0], pose_topic: /pose";

class Mcap : public Ros2Bag {
 protected:
  static std::string data(const std::string& name) {
    return std::string(VIWO_TEST_SOURCE_DIR) + "/plugins/sensors/ros2_bag/test_data/" + name;
  }
  static std::string section_of(const std::string& path, const std::string& rest = kTopics) {
    return "{type: ros2_bag, path: " + path + ", " + rest + "}";
  }
  std::string store(const std::string& content) const {
    std::ofstream(file("a.mcap"), std::ios::binary) << content;
    return file("a.mcap");
  }
  /// Where its record is.
  static std::size_t third_chunk(const std::string& content) {
    std::size_t at = 8;
    for (int chunks = 0;;) {
      if (content[at] == '\x06' && ++chunks == 3) return at;
      std::uint64_t length = 0;
      std::memcpy(&length, &content[at + 1], sizeof(length));
      at += 9 + length;
    }
  }
};

TEST_F(Mcap, GivesToTheBitWhatSqliteGives) {
  write_drive();
  const auto expected = play(*make_sensor(section(kTopics)));
  EXPECT_EQ(expected.size(), 50U);
  for (const char* name : {"plain.mcap", "lz4.mcap", "zstd.mcap", "unchunked.mcap",
                           "no_summary.mcap", "split", "split/split_0.mcap"}) {
    SCOPED_TRACE(name);
    const auto sensor = make_sensor(section_of(data(name)));
    const auto samples = play(*sensor);
    EXPECT_TRUE(all_rejections(*sensor).empty());
    if (std::string(name) != "split/split_0.mcap") {
      expect_same(expected, samples);
      expect_equal<EncoderSample>(expected, samples,
                                  [](const EncoderSample& x, const EncoderSample& y) {
                                    EXPECT_EQ(x.begin_ns, y.begin_ns);
                                  });
    } else {
      EXPECT_EQ(only<ImuSample>(samples).size(), 10U);
    }
  }
  const std::string piece = "imu_topic: /imu0, clock: reception, start_s: 0.04, duration_s: 0.02";
  const auto imu = play_only<ImuSample>(section_of(data("split"), piece));
  ASSERT_EQ(imu.size(), 5U);
  EXPECT_EQ(imu[0].t_ns, kStart + 41 * kMs);
}

TEST_F(Mcap, FindsTheFilesOfAFolderWhoseRecorderWasKilled) {
  for (const char* name : {"split_0.mcap", "split_1.mcap"}) {
    fs::copy(data("split/" + std::string(name)), folder_ / name);
  }
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "")).size(), 20U);
}

TEST_F(Mcap, GivesWhatIsBeforeACutAndSaysWhere) {
  write_drive();
  const auto whole = play(*make_sensor(section(kTopics)));
  for (const char* name :
       {"plain.mcap", "lz4.mcap", "zstd.mcap", "unchunked.mcap", "no_summary.mcap"}) {
    const std::string content = text_of(data(name));
    std::size_t most = 20;
    for (std::size_t size = content.size() - 1; size > content.size() / 2; size -= 97) {
      SCOPED_TRACE(std::string(name) + " of " + std::to_string(size));
      const auto sensor = make_sensor(
          section_of(store(content.substr(0, size)), "imu_topic: /imu0, image_topics: [/cam0]"));
      const auto imu = only<ImuSample>(play(*sensor));
      const auto expected = only<ImuSample>(whole);
      EXPECT_LE(imu.size(), most);  // all at first, never more of a shorter piece
      if (size + 1 == content.size()) {
        EXPECT_EQ(imu.size(), most);
      }
      most = imu.size();
      for (std::size_t i = 0; i < imu.size(); ++i) {
        EXPECT_EQ(imu[i].t_ns, expected[i].t_ns);
        EXPECT_EQ(imu[i].accel_m_per_s2, expected[i].accel_m_per_s2);
      }
      const auto rejections = all_rejections(*sensor);
      ASSERT_EQ(rejections.size(), 1U);
      EXPECT_THAT(rejections[0].reason, HasSubstr("file without its end"));
      EXPECT_THAT(rejections[0].first, ::testing::MatchesRegex("a.mcap: byte .*, .* bytes left"));
    }
    EXPECT_LT(most, 20U);
  }
}

/// In a compressed chunk, too, what is whole before the cut is given.
TEST_F(Mcap, GivesThePartOfAChunkThatIsBeforeACut) {
  bag::Ros2Writer out(file("one.mcap"), bag::mcap::Compression::kZstd, 1 << 30);
  for (int k = 0; k < 20'000; ++k) {
    out.write_imu("/imu0", {kStart + k * kMs, kStart + k * kMs}, {0.1 * k, 1. / (k + 1), 0.}, {});
  }
  out.close();
  const std::string content = text_of(file("one.mcap"));
  const auto imu = play_only<ImuSample>(
      section_of(store(content.substr(0, content.size() / 2)), "imu_topic: /imu0"));
  EXPECT_GT(imu.size(), 5'000U);
  EXPECT_LT(imu.size(), 20'000U);
  EXPECT_EQ(imu.back().gyro_rad_per_s[0], 0.1 * static_cast<double>(imu.size() - 1));
}

TEST_F(Mcap, AFileThatEndsWithZerosIsOneThatWasCut) {
  const std::string content = text_of(data("plain.mcap"));
  const auto sensor = make_sensor(section_of(
      store(content.substr(0, content.size() / 2) + std::string(5000, '\0')), "imu_topic: /imu0"));
  EXPECT_GT(play(*sensor).size(), 4U);
  // The chunk that has zeros at its end, and the end.
  const auto rejections = all_rejections(*sensor);
  ASSERT_EQ(rejections.size(), 2U);
  EXPECT_EQ(rejections[0].reason, "message of a chunk that has another check sum than it says");
  EXPECT_THAT(rejections[1].reason, HasSubstr("file without its end"));
}

TEST_F(Mcap, CountsTheMessagesOfAChunkThatIsDamaged) {
  for (const char* name : {"plain.mcap", "zstd.mcap"}) {
    SCOPED_TRACE(name);
    std::string content = text_of(data(name));
    const std::size_t at = third_chunk(content);
    content[at + 200] = static_cast<char>(content[at + 200] ^ 0x10);
    const auto sensor = make_sensor(section_of(store(content), "imu_topic: /imu0"));
    EXPECT_LT(play(*sensor).size(), 20U);
    EXPECT_GT(play(*make_sensor(section_of(store(content), "imu_topic: /imu0"))).size(), 10U);
    const auto rejections = all_rejections(*sensor);
    ASSERT_EQ(rejections.size(), 1U);
    EXPECT_THAT(rejections[0].reason, HasSubstr("message of a chunk that "));
    EXPECT_GE(rejections[0].count, 1);
    EXPECT_EQ(rejections[0].first, "a.mcap: byte " + std::to_string(at));
  }
}

TEST_F(Mcap, CountsTheMessagesOfAChunkThatCannotBeDecompressed) {
  bag::Ros2Writer out(file("one.mcap"), bag::mcap::Compression::kZstd, 20'000);
  for (int k = 0; k < 400; ++k) {
    out.write_imu("/imu0", {kStart + k * kMs, kStart + k * kMs}, {0.1 * k, 1. / (k + 1), 0.}, {});
  }
  out.close();
  std::string content = text_of(file("one.mcap"));
  const std::size_t at = third_chunk(content);
  std::fill_n(&content[at + 53], 16, '\xff');  // where the compressed bytes begin
  const auto sensor = make_sensor(section_of(store(content), "imu_topic: /imu0"));
  const auto n = static_cast<std::int64_t>(play(*sensor).size());
  const auto rejections = all_rejections(*sensor);
  ASSERT_EQ(rejections.size(), 1U);
  EXPECT_EQ(rejections[0].reason, "message of a chunk that cannot be decompressed");
  EXPECT_EQ(rejections[0].count, 400 - n);
  EXPECT_GT(rejections[0].count, 20);
  // Without indexes they are as many as others in that time.
  for (std::size_t i = 8; content[i] != '\x0f';) {
    std::uint64_t length = 0;
    std::memcpy(&length, &content[i + 1], sizeof(length));
    if (content[i] == '\x07') content[i] = '\x7f';  // a kind of record that nobody knows
    i += 9 + length;
  }
  const auto by_time = all_rejections(*make_sensor(section_of(store(content), "imu_topic: /imu0")));
  ASSERT_EQ(by_time.size(), 1U);
  EXPECT_NEAR(static_cast<double>(by_time[0].count), static_cast<double>(400 - n), 2.);
  EXPECT_THAT(by_time[0].first, HasSubstr(" s: their number is that of others in this time"));
}

TEST_F(Mcap, CountsAChunkWhoseKindIsNoneAnyMore) {
  std::string content = text_of(data("plain.mcap"));
  content[third_chunk(content)] = '\x7f';
  const auto sensor = make_sensor(section_of(store(content), "imu_topic: /imu0"));
  EXPECT_LT(play(*sensor).size(), 20U);
  const auto rejections = all_rejections(*sensor);
  ASSERT_EQ(rejections.size(), 1U);
  EXPECT_EQ(rejections[0].reason,
            "chunk that the summary counts and that is not there: what it held is lost");
  EXPECT_EQ(rejections[0].count, 1);
}

/// Of a file whose summary is longer than what is held of it at once.
TEST_F(Mcap, CountsAChunkOfManyWhoseKindIsNoneAnyMore) {
  {
    bag::Ros2Writer out(file("many.mcap"), bag::mcap::Compression::kNone, 1);  // each its own chunk
    for (int k = 0; k < 200; ++k) {
      out.write_imu("/imu0", {kStart + k * kMs, kStart + k * kMs}, {1. * k, 0., 0.}, {});
    }
    out.close();
  }
  std::string content = text_of(file("many.mcap"));
  EXPECT_THAT(all_rejections(*make_sensor(section_of(store(content), "imu_topic: /imu0"))),
              ::testing::IsEmpty());
  content[third_chunk(content)] = '\x7f';
  const auto rejections =
      all_rejections(*make_sensor(section_of(store(content), "imu_topic: /imu0")));
  ASSERT_EQ(rejections.size(), 1U);
  EXPECT_THAT(rejections[0].reason, HasSubstr("chunk that the summary counts"));
}

TEST_F(Mcap, CountsChunksThatStandWhereNoneIsRead) {
  const std::string whole = text_of(data("plain.mcap"));
  const std::size_t third = third_chunk(whole);
  std::uint64_t length = 0;
  std::memcpy(&length, &whole[third + 1], sizeof(length));
  const std::string chunk = whole.substr(third, 9 + length);
  std::size_t end = 8;  // of the data
  for (std::uint64_t n = 0; whole[end] != '\x0f'; end += 9 + n) {
    std::memcpy(&n, &whole[end + 1], sizeof(n));
  }
  const auto reasons = [&](const std::string& content) {
    std::vector<std::string> out;
    const auto sensor = make_sensor(section_of(store(content), "imu_topic: /imu0"));
    for (const auto& rejection : all_rejections(*sensor)) out.push_back(rejection.reason);
    return out;
  };
  EXPECT_THAT(reasons(whole), ::testing::IsEmpty());
  const std::string behind =
      whole.substr(0, end) + whole.substr(end, 13) + chunk + whole.substr(end + 13);
  EXPECT_THAT(reasons(behind),
              ::testing::Contains(HasSubstr("chunk or message behind the end of the data")));
}

TEST_F(Mcap, NamesTheDamageOfChunksThatDescribeTheChannels) {
  std::string content = text_of(data("plain.mcap"));
  content[content.size() - 60] = static_cast<char>(content[content.size() - 60] ^ 1);  // summary
  for (std::size_t at = content.find("/imu0"); at != std::string::npos;
       at = content.find("/imu0", at + 1)) {
    content[at + 1] = 'j';
  }
  const std::string error = error_of(section_of(store(content), "imu_topic: /imu0"));
  EXPECT_THAT(error, HasSubstr("no topic '/imu0'"));
  EXPECT_THAT(error, HasSubstr("; the bag is damaged, what is missing may have been there: "));
  EXPECT_THAT(error, HasSubstr("a.mcap: the chunk at byte "));
}

TEST_F(Mcap, NamesTheDamageWhereNoMessageIsLeft) {
  std::string content = text_of(data("plain.mcap"));
  for (std::size_t at = 8; content[at] != '\x0f';) {  // up to the end of the data
    std::uint64_t length = 0;
    std::memcpy(&length, &content[at + 1], sizeof(length));
    if (content[at] == '\x06') content[at + 200] = static_cast<char>(content[at + 200] ^ 0x10);
    at += 9 + length;
  }
  EXPECT_THAT(
      error_of(section_of(store(content), "imu_topic: /imu0")),
      HasSubstr("topic '/imu0' has no messages in the time that is read; the bag is damaged: "
                "message of a chunk that has another check sum than it says ("));
}

TEST_F(Mcap, ReadsWithoutASummaryThatIsDamaged) {
  std::string content = text_of(data("lz4.mcap"));
  content[content.size() - 60] = static_cast<char>(content[content.size() - 60] ^ 1);
  const auto sensor = make_sensor(section_of(store(content), "imu_topic: /imu0"));
  EXPECT_EQ(play(*sensor).size(), 20U);
  const auto rejections = all_rejections(*sensor);
  ASSERT_EQ(rejections.size(), 1U);
  EXPECT_THAT(rejections[0].reason, HasSubstr("summary that is damaged"));
}

/// As a recorder writes that gets messages late: chunks overlap in time.
TEST_F(Mcap, OrdersMessagesByReceptionWhicheverChunkTheyAreIn) {
  bag::Ros2Writer out(file("a.mcap"), bag::mcap::Compression::kNone, 1);  // each its own chunk
  for (const int k : {3, 1, 4, 0, 2, 5}) {
    out.write_imu("/imu0", {kStart + k * kMs, kStart + k * kMs}, {1. * k, 0., 0.}, {});
  }
  out.close();
  const auto sensor = make_sensor(section("imu_topic: /imu0", "a.mcap"));
  const auto imu = only<ImuSample>(play(*sensor));
  ASSERT_EQ(imu.size(), 6U);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(imu[static_cast<std::size_t>(k)].gyro_rad_per_s[0], k);
  EXPECT_TRUE(all_rejections(*sensor).empty());
}

TEST_F(Mcap, ReadsImagesAgainInAnyOrderFromSeveralThreads) {
  bag::Ros2Writer out(file("a.mcap"), bag::mcap::Compression::kZstd, 30'000);
  for (int k = 0; k < 100; ++k) {
    const std::vector<std::uint8_t> pixels(200 * 100, static_cast<std::uint8_t>(k));
    out.write_image("/cam0", {k * kMs, k * kMs}, {200, 100, "mono8", false, 200, pixels});
  }
  out.close();
  const auto images = play_only<ImageSample>(section("image_topics: [/cam0]", "a.mcap"));
  ASSERT_EQ(images.size(), 100U);
  std::array<int, 4> wrong{};
  std::vector<std::thread> threads;
  for (std::size_t thread = 0; thread < wrong.size(); ++thread) {
    threads.emplace_back([&, thread] {
      for (std::size_t i = 0; i < 200; ++i) {
        const std::size_t k = (i * 7 + thread * 11) % images.size();
        Image image;
        images[k].source->read(image);
        if (image.pixels.front() != k || image.pixels.back() != k) ++wrong[thread];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, ElementsAre(0, 0, 0, 0));
}

/// A recording of 400 MB of images is played in a small part of that.
TEST_F(Mcap, HoldsFewImagesAtOnce) {
  constexpr int kImages = 400;
  {
    bag::Ros2Writer out(file("a.mcap"), bag::mcap::Compression::kLz4);
    const std::vector<std::uint8_t> pixels(1000 * 1000, 7);
    for (int k = 0; k < kImages; ++k) {
      out.write_image("/cam0", {k * kMs, k * kMs}, {1000, 1000, "mono8", false, 1000, pixels});
    }
    out.close();
  }
  const auto before_mb = peak_mb();
  const auto images = play_only<ImageSample>(section("image_topics: [/cam0]", "a.mcap"));
  ASSERT_EQ(images.size(), static_cast<std::size_t>(kImages));
  Image image;
  for (const ImageSample& sample : images) sample.source->read(image);
  EXPECT_LT(peak_mb() - before_mb, 100);  // 32 MB of chunks are kept
}

}  // namespace
}  // namespace viwo
