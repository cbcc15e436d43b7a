// Files in MCAP that say what cannot be: clear errors, in little memory.
#include <random>

#include <zstd.h>

#include "mcap_records.hpp"
#include "mcap_writer.hpp"
#include "test_fixture.hpp"

namespace viwo {
namespace {

using bag::mcap::Buffer;
using bag::mcap::kChannel;
using bag::mcap::kChunk;
using bag::mcap::kFooter;
using bag::mcap::kHeader;
using bag::mcap::kMagic;
using bag::mcap::kMessage;
using bag::mcap::kSchema;
using ::testing::StartsWith;

class McapBroken : public Ros2Bag {
 protected:
  static Buffer schema(std::uint16_t id = 1, const std::string& text = "") {
    Buffer fields;
    fields.number(id).text("sensor_msgs/msg/Imu").text("ros2msg").text(text);
    Buffer out;
    out.record(kSchema, fields);
    return out;
  }
  static Buffer channel(std::uint16_t schema_id = 1, const std::string& encoding = "cdr",
                        const std::string& topic = "/imu0") {
    Buffer fields;
    fields.number(std::uint16_t{7}).number(schema_id).text(topic).text(encoding);
    Buffer out;
    out.record(kChannel, fields.number(std::uint32_t{0}));
    return out;
  }
  static Buffer message(std::int64_t t_ns = kStart, std::uint16_t id = 7) {
    const std::string data = imu(t_ns, 0.5);
    Buffer fields;
    fields.number(id).number(std::uint32_t{0}).number(t_ns).number(t_ns);
    fields.raw({reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    Buffer out;
    out.record(kMessage, fields);
    return out;
  }
  static Buffer chunk(const bag::Bytes& bytes, std::uint64_t whole_bytes,
                      const std::string& compression = "", std::uint64_t begin_ns = 1) {
    Buffer fields;
    fields.number(begin_ns).number(std::uint64_t{2}).number(whole_bytes).number(std::uint32_t{0});
    fields.text(compression).number(std::uint64_t{bytes.size()}).raw(bytes);
    Buffer out;
    out.record(kChunk, fields);
    return out;
  }
  static Buffer all(std::initializer_list<Buffer> parts) {
    Buffer out;
    for (const Buffer& part : parts) out.raw(part.bytes());
    return out;
  }

  /// A file with these records, with its end.
  void write(const Buffer& records) const {
    Buffer header, out, footer;
    header.text("ros2").text("");
    out.raw(kMagic).record(kHeader, header).raw(records.bytes());
    footer.number(std::uint64_t{0}).number(std::uint64_t{0}).number(std::uint32_t{0});
    out.record(kFooter, footer).raw(kMagic);
    const bag::Bytes& bytes = out.bytes();
    std::ofstream(file("a.mcap"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  std::string error(const Buffer& records, const std::string& rest = "imu_topic: /imu0") const {
    write(records);
    return error_of(section(rest, "a.mcap"));
  }
};

TEST_F(McapBroken, TheSmallestFileIsRead) {
  EXPECT_EQ(error(all({schema(), channel(), message()})), "");
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "a.mcap")).size(), 1U);
}

TEST_F(McapBroken, RefusesWhatIsNoMcap) {
  std::ofstream(file("a.mcap")).flush();
  EXPECT_THAT(error_of(section(kAll, "a.mcap")), HasSubstr(file("a.mcap") + "  is empty"));
  std::ofstream(file("a.mcap")) << "timestamp_ns,x\n";
  EXPECT_THAT(error_of(section(kAll, "a.mcap")), HasSubstr("a.mcap  is no MCAP file (version 0)"));
  EXPECT_THAT(error_of(section(kAll, "b.mcap")),
              HasSubstr(file("b.mcap") + "  cannot be read: No such file or directory"));
}

TEST_F(McapBroken, RefusesSizesThatCannotBe) {
  const std::uint64_t kHuge = 1'000'000'000'000'000'000;
  const auto before_mb = peak_mb();
  EXPECT_THAT(error(chunk({}, kHuge)),
              HasSubstr("a.mcap  is damaged: at byte 29, a chunk says to have 1000000000000000000 "
                        "bytes, at most 134217728 are read"));
  Buffer long_record;
  long_record.number(std::uint8_t{kMessage}).number(kHuge);
  EXPECT_THAT(error(long_record),
              HasSubstr("at byte 29, a record goes beyond the end of the file"));
  EXPECT_THAT(error(chunk(long_record.bytes(), long_record.size())),
              HasSubstr("in the chunk at byte 29, a record goes beyond the end of its chunk"));
  Buffer long_name, described;
  long_name.number(std::uint16_t{1}).number(std::uint32_t{0xffffffff});
  EXPECT_THAT(error(described.record(kSchema, long_name)),
              HasSubstr("at byte 29, a record ends within its fields"));
  EXPECT_THAT(error(chunk({}, 0, std::string(200, 'x'))), HasSubstr("at byte 29, a record ends"));
  EXPECT_LT(peak_mb() - before_mb, 50);
}

/// 10 kB that say to be 200 kB, and are 200 MB.
TEST_F(McapBroken, StopsAChunkThatBecomesLargerThanItSays) {
  const bag::Bytes zeros(200 << 20);
  bag::Bytes bomb(1 << 20);
  bomb.resize(ZSTD_compress(bomb.data(), bomb.size(), zeros.data(), zeros.size(), 19));
  ASSERT_LT(bomb.size(), 30'000U);
  write(all({schema(), channel(), message(), chunk(bomb, 200'000, "zstd")}));
  const auto before_mb = peak_mb();
  const auto sensor = make_sensor(section("imu_topic: /imu0", "a.mcap"));
  EXPECT_EQ(play(*sensor).size(), 1U);
  EXPECT_THAT(
      rejections_of(*sensor),
      ElementsAre(StartsWith("message of a chunk that is of another size than it says | ")));
  EXPECT_LT(peak_mb() - before_mb, 50);
}

TEST_F(McapBroken, ALargeClaimCostsNothing) {
  write(all({schema(), channel(), message(), chunk({1, 2, 3}, 60 << 20, "zstd")}));
  const auto before_mb = peak_mb();
  EXPECT_EQ(play_only<ImuSample>(section("imu_topic: /imu0", "a.mcap")).size(), 1U);
  EXPECT_LT(peak_mb() - before_mb, 50);
}

TEST_F(McapBroken, CountsAChunkWithinAChunk) {
  const Buffer inner = chunk(message().bytes(), message().bytes().size());
  const Buffer outer = all({schema(), channel(), message(), inner});
  write(chunk(outer.bytes(), outer.bytes().size()));
  const auto sensor = make_sensor(section("imu_topic: /imu0", "a.mcap"));
  EXPECT_EQ(play(*sensor).size(), 1U);
  EXPECT_THAT(rejections_of(*sensor), ::testing::Contains(HasSubstr("chunk within a chunk")));
}

/// Each message takes a place in memory until those before it have come, and the time of a message
/// that is broken, however short it is.
TEST_F(McapBroken, RefusesMoreMessagesThanAFileOfItsSizeHas) {
  Buffer fields;
  fields.number(std::uint16_t{7}).number(std::uint32_t{0}).number(kStart).number(kStart);
  Buffer one;
  one.record(kMessage, fields);
  for (const int count : {150'000, 600'000}) {
    Buffer many;
    many.raw(schema().bytes()).raw(channel().bytes());
    for (int i = 0; i < count; ++i) many.raw(one.bytes());
    bag::Bytes packed(ZSTD_compressBound(many.bytes().size()));
    packed.resize(
        ZSTD_compress(packed.data(), packed.size(), many.bytes().data(), many.bytes().size(), 3));
    const long before_mb = peak_mb();
    EXPECT_THAT(error(chunk(packed, many.bytes().size(), "zstd")),
                HasSubstr("there are too many messages in it"))
        << count;
    EXPECT_LT(peak_mb() - before_mb, 150) << count;
  }
}

TEST_F(McapBroken, RefusesChunksThatBecomeFarLongerThanTheFile) {
  Buffer many;
  for (int i = 0; i < 20; ++i) many.raw(chunk({1, 2, 3}, 20 << 20, "zstd").bytes());
  EXPECT_THAT(error(all({schema(), channel(), message(), many})),
              HasSubstr("the chunks say to become more than 300 times as long as the file"));
}

/// Each image would decompress a chunk: minutes for a file of some kB.
TEST_F(McapBroken, RefusesImagesThatAlternateBetweenLargeChunks) {
  Buffer description;
  Buffer fields;
  fields.number(std::uint16_t{1}).text("sensor_msgs/msg/Image").text("ros2msg").text("");
  description.record(kSchema, fields).raw(channel(1, "cdr", "/cam0").bytes());
  Buffer chunks[2];
  for (int k = 0; k < 600; ++k) {
    const std::string data = image(kStart + k * kMs, 0, 50'000);
    Buffer one;
    one.number(std::uint16_t{7}).number(std::uint32_t{0});
    one.number(kStart + k * kMs).number(kStart + k * kMs);
    one.raw({reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    chunks[k % 2].record(kMessage, one);
  }
  Buffer records = all({description});
  for (const Buffer& whole : chunks) {
    bag::Bytes packed(1 << 20);
    packed.resize(
        ZSTD_compress(packed.data(), packed.size(), whole.bytes().data(), whole.bytes().size(), 1));
    records.raw(chunk(packed, whole.size(), "zstd", static_cast<std::uint64_t>(kStart)).bytes());
  }
  EXPECT_THAT(error(records, "image_topics: [/cam0]"),
              HasSubstr("a.mcap  has images whose chunks alternate"));
}

TEST_F(McapBroken, RefusesMoreTopicsThanARecordingHas) {
  Buffer channels;
  for (int i = 0; i < 10'001; ++i) {
    Buffer fields;
    fields.number(static_cast<std::uint16_t>(i)).number(std::uint16_t{1});
    fields.text("/t" + std::to_string(i)).text("cdr").number(std::uint32_t{0});
    channels.record(kChannel, fields);
  }
  EXPECT_THAT(error(all({schema(), channels})), HasSubstr("  has more than 10000 topics"));
  EXPECT_THAT(error(all({schema(), channel(1, "cdr", std::string(2000, 'x'))})),
              HasSubstr("a name of 2000 bytes"));
}

TEST_F(McapBroken, RefusesChannelsThatContradictEachOther) {
  EXPECT_THAT(error(all({schema(), schema(1, "uint8 x"), channel(), message()})),
              HasSubstr("schema 1 is described in two ways"));
  EXPECT_THAT(error(all({schema(), channel(), channel(1, "cdr", "/imu1"), message()})),
              HasSubstr("channel 7 is described in two ways"));
  EXPECT_THAT(error(all({channel(0), message()})),
              HasSubstr("topic '/imu0' in " + file("a.mcap") +
                        " is of type (a channel without a schema), needed is sensor_msgs/Imu"));
  EXPECT_THAT(error(all({channel(5), message()})),
              HasSubstr("(a channel whose schema is missing)"));
  EXPECT_THAT(error(all({schema(), channel(1, "ros1"), message()})),
              HasSubstr("topic '/imu0' is serialised as 'ros1', what is read is cdr"));
  EXPECT_EQ(error(all({schema(), schema(0), channel(), message()})), "") << "0 is passed over";
}

TEST_F(McapBroken, RefusesChunksThatItCannotRead) {
  const Buffer whole = all({schema(), channel(), message()});
  EXPECT_THAT(error(chunk(whole.bytes(), whole.size(), "bz2")),
              HasSubstr("a chunk is compressed by 'bz2', what is read is lz4 and zstd"));
  EXPECT_THAT(error(chunk(whole.bytes(), whole.size(), "", kStart + 1)),
              HasSubstr("in the chunk at byte 29, a message was received at " +
                        std::to_string(kStart) + " ns: before the chunk begins, or never"));
}

TEST_F(McapBroken, CountsMessagesOfAChannelThatIsDescribedNowhere) {
  write(all({schema(), channel(), message(), message(kStart + 1, 8), message(kStart + 2)}));
  const auto sensor = make_sensor(section("imu_topic: /imu0", "a.mcap"));
  EXPECT_EQ(play(*sensor).size(), 2U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(StartsWith("message of a channel that is described nowhere | ")));
}

TEST_F(McapBroken, SurvivesAByteThatIsWrongAnywhere) {
  for (const char* name : {"plain.mcap", "lz4.mcap", "zstd.mcap", "unchunked.mcap"}) {
    const std::string whole = testing::text_of(std::string(VIWO_TEST_SOURCE_DIR) +
                                               "/plugins/sensors/ros2_bag/test_data/" + name);
    std::mt19937_64 random(5);
    int refused = 0;
    for (int k = 0; k < 300; ++k) {
      std::string content = whole.substr(0, k % 2 == 0 ? whole.size() : random() % whole.size());
      for (int i = 0; i < 3 && !content.empty(); ++i) {
        content[random() % content.size()] = static_cast<char>(random());
      }
      std::ofstream(file("a.mcap"), std::ios::binary) << content;
      try {
        Image pixels;
        for (const ImageSample& sample : only<ImageSample>(play(
                 *make_sensor(section("imu_topic: /imu0, image_topics: [/cam0]", "a.mcap"))))) {
          sample.source->read(pixels);
        }
      } catch (const InputError&) {
        ++refused;  // anything else, or a crash, ends the test
      }
    }
    EXPECT_GT(refused, 10) << name;
    EXPECT_LT(refused, 299) << name;
  }
}

}  // namespace
}  // namespace viwo
