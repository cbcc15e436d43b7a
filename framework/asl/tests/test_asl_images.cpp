// The images of log folders: what is written is read back, and what is missing is named.
#include <random>
#include <vector>

#include <gmock/gmock.h>

#include "log_files.hpp"
#include "rejections.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_images.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::log {
namespace {

namespace fs = std::filesystem;

class AslImagesTest : public InFolder {
 protected:
  /// A camera folder with images of one grey level each, but for those in `missing`.
  fs::path camera(const std::string& name, const std::vector<std::int64_t>& stamps,
                  const std::vector<std::size_t>& missing = {}) const {
    std::string table = "#timestamp [ns],filename\n";
    fs::create_directories(folder_ / name / "data");
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      const std::string file = "image" + std::to_string(i) + ".png";
      table += std::to_string(stamps[i]) + "," + file + "\n";
      if (std::find(missing.begin(), missing.end(), i) != missing.end()) continue;
      write_png(folder_ / name / "data" / file,
                {2, 2, std::vector<std::uint8_t>(4, static_cast<std::uint8_t>(i))});
    }
    write(name + "/data.csv", table);
    return folder_ / name;
  }

  static std::string refusal(const std::vector<fs::path>& folders, const LogLimits& limits = {}) {
    return error_of([&] { read_asl_images(folders, limits); });
  }
};

TEST_F(AslImagesTest, WhatTheWriterWroteIsReadBackToTheBit) {
  std::mt19937_64 random(11);
  std::vector<ImageSample> written;
  std::vector<Image> images;
  AslWriter writer(folder_);
  for (std::int64_t k = 0; k < 5; ++k) {
    for (const int cam : {0, 1}) {
      Image image{17 + cam, 9, {}};
      for (int i = 0; i < image.width_px * image.height_px; ++i) {
        image.pixels.push_back(static_cast<std::uint8_t>(random()));
      }
      images.push_back(image);
      written.push_back({1'403'636'579'763'555'584 + k * 50'000'000 + cam * 7, cam,
                         std::make_shared<ImageInMemory>(image)});
      EXPECT_TRUE(writer.write(written.back()));
    }
  }
  writer.close();
  const std::vector<fs::path> folders{folder_ / "cam0", folder_ / "cam1"};
  const ImageRecording read = read_asl_images(folders, {});
  EXPECT_TRUE(read.rejections.empty());
  ASSERT_EQ(read.samples.size(), written.size());
  Image pixels;
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ(read.samples[i].t_ns, written[i].t_ns);
    EXPECT_EQ(read.samples[i].camera, written[i].camera);
    read.samples[i].source->read(pixels);
    EXPECT_EQ(pixels.width_px, images[i].width_px);
    EXPECT_EQ(pixels.height_px, images[i].height_px);
    EXPECT_EQ(pixels.pixels, images[i].pixels);
  }
}

TEST_F(AslImagesTest, TheTableOfACameraMayBeGzipped) {
  const fs::path folder = camera("cam0", {10, 20});
  write_gz("cam0/data.csv.gz", text_of(folder / "data.csv"));
  EXPECT_THAT(refusal({folder}), ::testing::HasSubstr("holds both data.csv and data.csv.gz"));
  fs::remove(folder / "data.csv");
  EXPECT_EQ(read_asl_images(std::vector<fs::path>{folder}, {}).samples.size(), 2U);
}

TEST_F(AslImagesTest, CamerasAreMergedByStampThenByTheirPlaceInTheList) {
  const std::vector<fs::path> folders{camera("right", {20, 30, 40}), camera("left", {10, 20, 50})};
  const ImageRecording read = read_asl_images(folders, {});
  std::vector<std::pair<std::int64_t, int>> order;
  for (const ImageSample& sample : read.samples) order.emplace_back(sample.t_ns, sample.camera);
  using Pair = std::pair<std::int64_t, int>;
  EXPECT_THAT(order, ::testing::ElementsAre(Pair{10, 1}, Pair{20, 0}, Pair{20, 1}, Pair{30, 0},
                                            Pair{40, 0}, Pair{50, 1}));
  Image pixels;
  read.samples[4].source->read(pixels);
  EXPECT_EQ(pixels.pixels[0], 2);  // the third of the right camera
}

TEST_F(AslImagesTest, MissingImagesStampsThatGoBackAndGapsAreCountedWithTheirPlace) {
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 30; ++i) stamps.push_back(i * 50'000'000);
  stamps[12] = 5;
  stamps[29] = 5'000'000'000;
  const std::vector<fs::path> folders{camera("cam0", stamps, {7, 9}), camera("cam1", {1, 2})};
  const ImageRecording read = read_asl_images(folders, {});
  EXPECT_EQ(read.samples.size(), 27U + 2U);
  EXPECT_THAT(
      testing::rejections_of(read.rejections),
      ::testing::ElementsAre("image file that is missing | 2 | cam0/data.csv:9 (image7.png)",
                             "stamp not after the previous one | 1 | cam0/data.csv:14",
                             "gap longer than 0.2 s | 1 | cam0/data.csv:31"));
}

TEST_F(AslImagesTest, AnImageThatBreaksLaterIsAnErrorOfItsReading) {
  const std::vector<fs::path> folders{camera("cam0", {1, 2})};
  const ImageRecording read = read_asl_images(folders, {});
  const fs::path file = folders[0] / "data" / "image1.png";
  Image pixels;
  fs::resize_file(file, 30);
  EXPECT_EQ(error_of([&] { read.samples[1].source->read(pixels); }),
            file.string() + ": the image is cut short");
  fs::remove(file);
  EXPECT_EQ(error_of([&] { read.samples[1].source->read(pixels); }),
            file.string() + ": the image is missing or cannot be read");
}

TEST_F(AslImagesTest, FoldersAndFilesThatAreMissingAreNamed) {
  camera("cam0", {1, 2});
  camera("cam2", {1, 2});
  const std::string root = folder_.string();
  EXPECT_EQ(refusal({folder_ / "cam0", folder_ / "cam1"}),
            root + "/cam1  there is no such folder of images - there are: cam0, cam2");
  EXPECT_EQ(refusal({folder_ / "images"}),
            root + "/images  there is no such folder of images - there are: cam0, cam2");
  fs::remove(folder_ / "cam2" / "data.csv");
  EXPECT_THAT(refusal({folder_ / "cam2"}), ::testing::HasSubstr(root + "/cam2/data.csv"));
  EXPECT_EQ(refusal({camera("cam3", {1, 2, 3}, {0, 2})}),
            root + "/cam3/data.csv:2  the image " + root +
                "/cam3/data/image0.png is missing (2 of 3 images of this camera are)");
  EXPECT_EQ(refusal({camera("cam4", {1, 2, 3, 4}, {2})}),
            root + "/cam4/data.csv:4  the image " + root +
                "/cam4/data/image2.png is missing (1 of 4 images of this camera are)");
}

TEST_F(AslImagesTest, WrongTablesAreRefusedWithTheirLine) {
  const auto message = [&](const std::string& text) {
    const std::string file = write("cam0/data.csv", text).string();
    const std::string what = refusal({folder_ / "cam0"});
    return what.substr(std::min(what.size(), file.size()));
  };
  EXPECT_EQ(message("#timestamp [ns],filename\n"), "  holds no data after its header");
  EXPECT_EQ(message("#timestamp [ns],file\n"),
            ":1  no column 'filename' - there are: timestamp [ns], file");
  EXPECT_EQ(message("#stamp,filename\n"),
            ":1  no column 'timestamp [ns]' - there are: stamp, filename");
  EXPECT_EQ(message("#timestamp [ns],filename\n1,a.png,2\n"),
            ":2  3 fields where the header has 2");
  EXPECT_EQ(message("#timestamp [ns],filename\nx,a.png\n"),
            ":2  column 'timestamp [ns]': 'x' is not an integer");
  EXPECT_EQ(message("#timestamp [ns],filename\n1,\n"), ":2  column 'filename': is empty");
  EXPECT_EQ(message(std::string("#timestamp [ns],filename\n1,a") + '\0' + "b.png\n"),
            ":2  column 'filename': 'a?b.png' has a zero byte");
}

}  // namespace
}  // namespace viwo::log
