// Sensor asl_images as the host loads it; the reader has its own tests.
#include <gmock/gmock.h>

#include "support.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

class AslImages : public testing::InFolder {
 protected:
  void SetUp() override {
    log::AslWriter writer(folder_);
    for (int i = 0; i < 20; ++i) {
      for (const int camera : {0, 1}) {
        const Image image{3, 2, std::vector<std::uint8_t>(6, grey(i, camera))};
        EXPECT_TRUE(writer.write(ImageSample{i * std::int64_t{100'000'000}, camera,
                                             std::make_shared<ImageInMemory>(image)}));
      }
    }
    writer.close();
  }

  static std::uint8_t grey(int i, int camera) { return static_cast<std::uint8_t>(10 * i + camera); }
  std::string config(const std::string& rest) const {
    return "{type: asl_images, path: " + folder_.string() + rest + "}";
  }
};

TEST_F(AslImages, GivesTheImagesOfItsCamerasInTimeOrder) {
  const auto sensor = make_sensor(config(", cameras: [cam1, cam0]"));
  EXPECT_FALSE(sensor->takes_input());
  const auto images = only<ImageSample>(play(*sensor));
  ASSERT_EQ(images.size(), 40U);
  Image pixels;
  for (int k = 0; k < 40; ++k) {
    const ImageSample& image = images[static_cast<std::size_t>(k)];
    EXPECT_EQ(image.t_ns, k / 2 * std::int64_t{100'000'000});
    EXPECT_EQ(image.camera, k % 2);
    image.source->read(pixels);
    EXPECT_EQ(pixels.pixels, std::vector<std::uint8_t>(6, grey(k / 2, 1 - k % 2)));  // swapped
  }
  EXPECT_EQ(play_only<ImageSample>(config("")).size(), 20U);  // cam0
}

TEST_F(AslImages, ReportsFilesThatAreMissing) {
  std::filesystem::remove(folder_ / "cam1" / "data" / "500000000.png");
  const auto sensor = make_sensor(config(", cameras: [cam0, cam1]"));
  EXPECT_EQ(play(*sensor).size(), 39U);
  EXPECT_THAT(
      rejections_of(*sensor),
      ::testing::ElementsAre("image file that is missing | 1 | cam1/data.csv:7 (500000000.png)"));
}

TEST_F(AslImages, SaysWhatItDoesNotFind) {
  EXPECT_NE(error_of(config(", cameras: [cam0, cam7]"))
                .find("cam7  there is no such folder of images - there are: cam0, cam1"),
            std::string::npos);
  EXPECT_NE(error_of(config(", cameras: []")).find("cameras: at least one camera is needed"),
            std::string::npos);
}

}  // namespace
}  // namespace viwo
