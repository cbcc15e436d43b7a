#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <zlib.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

class ImageFileTest : public testing::InFolder {
 protected:
  static Image pattern() {
    Image image{7, 5, {}};
    for (int i = 0; i < 35; ++i) image.pixels.push_back(static_cast<std::uint8_t>(7 * i));
    return image;
  }
};

std::string failure(const fs::path& file) {
  Image image;
  return testing::error_of([&] { read_image(file, image); });
}

TEST_F(ImageFileTest, PngComesBackToTheBit) {
  const fs::path file = folder_ / "a.png";
  write_png(file, pattern());
  Image back;
  ImageFile(file).read(back);
  EXPECT_EQ(back.width_px, 7);
  EXPECT_EQ(back.height_px, 5);
  EXPECT_EQ(back.pixels, pattern().pixels);
}

TEST_F(ImageFileTest, EveryCutOfAFileIsRefusedByName) {
  const std::vector<std::uint8_t> png = encode_png(pattern());
  cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", grey, jpeg);
  Image image;
  for (const auto& bytes : {png, jpeg}) {
    EXPECT_NO_THROW(decode_image(bytes, "whole", image));
    // The very last bytes of a PNG are a checksum that nobody needs.
    for (std::size_t size = 0; size + 8 < bytes.size(); size += 3) {
      EXPECT_THROW(decode_image(std::span(bytes).first(size), "cut", image), InputError) << size;
    }
  }
  for (auto bytes : {png, jpeg}) {  // zeros are no end
    bytes.resize(bytes.size() / 2);
    bytes.resize(bytes.size() + 1000, 0);
    EXPECT_THROW(decode_image(bytes, "cut and padded", image), InputError);
  }
  const fs::path file = folder_ / "cut.png";
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()),
             static_cast<std::streamsize>(png.size() / 2));
  EXPECT_EQ(failure(file), file.string() + ": the image is cut short");
}

TEST_F(ImageFileTest, SaysWhatIsNoImage) {
  EXPECT_EQ(failure(folder_ / "none.png"),
            (folder_ / "none.png").string() + ": the image is missing or cannot be read");
  std::ofstream(folder_ / "text.png") << "no image";
  EXPECT_EQ(failure(folder_ / "text.png"),
            (folder_ / "text.png").string() +
                ": is no PNG, JPEG, BMP, PGM or PPM, or its header is damaged");
  std::ofstream(folder_ / "empty.png").flush();
  EXPECT_EQ(failure(folder_ / "empty.png"),
            (folder_ / "empty.png").string() + ": the image is empty");
}

TEST_F(ImageFileTest, AWholeFileMayBePadded) {
  std::vector<std::uint8_t> png = encode_png(pattern()), jpeg;
  cv::imencode(".jpg", cv::Mat(20, 30, CV_8UC1, cv::Scalar(90)), jpeg);
  Image image;
  for (auto bytes : {png, jpeg}) {
    for (const auto& [size, value] : {std::pair{40U, 0xffU}, {4096U, 0U}, {0U, 0U}}) {
      auto padded = bytes;
      padded.resize(bytes.size() + size, static_cast<std::uint8_t>(value));
      EXPECT_NO_THROW(decode_image(padded, "padded", image)) << size << " x " << value;
    }
  }
  decode_image(png, "png", image);
  EXPECT_EQ(image.pixels, pattern().pixels);
}

TEST_F(ImageFileTest, AFolderIsNoImage) {
  EXPECT_EQ(failure(folder_), folder_.string() + "  is a folder, not a file");
}

TEST_F(ImageFileTest, IsNotTurnedByWhatExifSays) {
  // GIVEN a JPEG, white on the left, whose EXIF says that it is upside down
  cv::Mat grey(8, 16, CV_8UC1, cv::Scalar(0));
  grey.colRange(0, 8).setTo(255);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", grey, jpeg);
  // A segment with a TIFF of one entry: 0x112, the orientation, is 3.
  const std::string_view exif(
      "\xff\xe1\0\x22"
      "Exif\0\0"
      "II\x2a\0\x08\0\0\0"
      "\1\0\x12\1\3\0\1\0\0\0\3\0\0\0"
      "\0\0\0\0",
      36);
  jpeg.insert(jpeg.begin() + 2, exif.begin(), exif.end());
  Image image;
  decode_image(jpeg, "a.jpg", image);
  ASSERT_EQ(image.pixels.size(), 128U);
  EXPECT_GT(image.pixels[1], 200);
  EXPECT_LT(image.pixels[14], 50);
}

TEST_F(ImageFileTest, ColoursAndSixteenBitsBecomeGrey) {
  cv::Mat deep(2, 2, CV_16UC1, cv::Scalar(0x4321));
  cv::imwrite((folder_ / "deep.png").string(), deep);
  Image image;
  read_image(folder_ / "deep.png", image);
  EXPECT_TRUE(std::all_of(image.pixels.begin(), image.pixels.end(),
                          [](std::uint8_t p) { return p == 0x43; }));
  cv::Mat white(2, 3, CV_8UC3, cv::Scalar(255, 255, 255));
  cv::imwrite((folder_ / "white.png").string(), white);
  read_image(folder_ / "white.png", image);
  EXPECT_EQ(image.width_px, 3);
  EXPECT_EQ(image.pixels, std::vector<std::uint8_t>(6, 255));
}

/// A grey PNG whose rows hold random differences, `filter(y)` says by which filter.
template <class Filter>
std::vector<std::uint8_t> filtered_png(std::uint32_t width, std::uint32_t height, Filter filter) {
  std::vector<std::uint8_t> png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const auto add_number = [](std::vector<std::uint8_t>& to, std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) to.push_back(static_cast<std::uint8_t>(number >> shift));
  };
  const auto add_chunk = [&](std::string_view type, const std::vector<std::uint8_t>& data) {
    add_number(png, static_cast<std::uint32_t>(data.size()));
    const std::size_t begin = png.size();
    png.insert(png.end(), type.begin(), type.end());
    png.insert(png.end(), data.begin(), data.end());
    add_number(png, static_cast<std::uint32_t>(
                        crc32(0, png.data() + begin, static_cast<uInt>(png.size() - begin))));
  };
  std::vector<std::uint8_t> header;
  add_number(header, width);
  add_number(header, height);
  header.insert(header.end(), {8, 0, 0, 0, 0});
  std::mt19937 random(1);
  std::vector<std::uint8_t> rows;
  for (std::uint32_t y = 0; y < height; ++y) {
    rows.push_back(filter(y));
    for (std::uint32_t x = 0; x < width; ++x) rows.push_back(static_cast<std::uint8_t>(random()));
  }
  uLongf size = compressBound(rows.size());
  std::vector<std::uint8_t> compressed(size);
  compress(compressed.data(), &size, rows.data(), rows.size());
  compressed.resize(size);
  add_chunk("IHDR", header);
  // In two pieces, with something else before them.
  add_chunk("tEXt", {'a', 0, 'b'});
  const auto middle = compressed.begin() + static_cast<std::ptrdiff_t>(size / 2);
  add_chunk("IDAT", {compressed.begin(), middle});
  add_chunk("IDAT", {middle, compressed.end()});
  add_chunk("IEND", {});
  return png;
}

TEST_F(ImageFileTest, EveryFilterOfAPngGivesThePixelsThatOpenCvReads) {
  for (const std::uint32_t width : {1U, 2U, 37U, 848U}) {
    const auto png =
        filtered_png(width, 45, [](auto y) { return static_cast<std::uint8_t>(y % 5); });
    Image image;
    decode_image(png, "filters", image);
    const cv::Mat expected = cv::imdecode(png, cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(image.width_px, expected.cols);
    ASSERT_EQ(image.height_px, expected.rows);
    EXPECT_TRUE(
        std::equal(image.pixels.begin(), image.pixels.end(), expected.datastart, expected.dataend));
  }
}

TEST_F(ImageFileTest, ABrokenPngGivesWhatOpenCvMakesOfIt) {
  // GIVEN a PNG in which one byte after the other is wrong
  const auto png = filtered_png(5, 4, [](auto y) { return static_cast<std::uint8_t>(y + 1); });
  for (std::size_t i = 8; i < png.size(); ++i) {
    auto broken = png;
    broken[i] = static_cast<std::uint8_t>(broken[i] ^ 0x10);
    cv::Mat expected;
    try {
      expected = cv::imdecode(broken, cv::IMREAD_GRAYSCALE);
    } catch (const cv::Exception&) {  // a size that cannot be: no image
    }
    Image image;
    try {
      decode_image(broken, "broken", image);
    } catch (const InputError&) {
      // Without its end it is cut short, whatever OpenCV makes of it.
      EXPECT_TRUE(expected.empty() || i + 12 >= png.size()) << i;
      continue;
    }
    ASSERT_EQ(image.pixels.size(), expected.total()) << i;
    EXPECT_TRUE(std::equal(image.pixels.begin(), image.pixels.end(), expected.datastart)) << i;
  }
}

TEST_F(ImageFileTest, EveryFormatThatIsReadIsRead) {
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  const cv::Mat colours(20, 30, CV_8UC3, cv::Scalar(90, 90, 90));
  Image image;
  for (const char* const format : {".png", ".jpg", ".bmp", ".pgm", ".ppm"}) {
    for (const std::vector<int>& how : {std::vector<int>{}, {cv::IMWRITE_PXM_BINARY, 0}}) {
      std::vector<std::uint8_t> bytes;
      cv::imencode(format, std::string(format) == ".ppm" ? colours : grey, bytes, how);
      EXPECT_NO_THROW(decode_image(bytes, format, image)) << format;
      EXPECT_EQ(image.width_px, 30) << format;
      EXPECT_EQ(image.height_px, 20) << format;
    }
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", grey, bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_NO_THROW(decode_image(bytes, "progressive", image));
  cv::imencode(".tiff", grey, bytes);
  EXPECT_THROW(decode_image(bytes, "tiff", image), InputError);
}

using Bytes = std::vector<std::uint8_t>;

/// Has something to be wrong in every block.
cv::Mat waves() {
  cv::Mat colours(64, 80, CV_8UC3);
  for (int row = 0; row < colours.rows; ++row) {
    for (int column = 0; column < colours.cols; ++column) {
      colours.at<cv::Vec3b>(row, column) =
          cv::Vec3b(static_cast<std::uint8_t>(3 * row), static_cast<std::uint8_t>(row * column),
                    static_cast<std::uint8_t>(127 + 100 * std::sin(0.7 * column)));
    }
  }
  return colours;
}

Bytes jpeg_of(const cv::Mat& pixels, const std::vector<int>& how = {}) {
  Bytes jpeg;
  cv::imencode(".jpg", pixels, jpeg, how);
  return jpeg;
}

/// Where the last segment with this mark begins.
std::ptrdiff_t last_mark(const Bytes& jpeg, std::uint8_t mark) {
  const Bytes marks{0xff, mark};
  return std::find_end(jpeg.begin(), jpeg.end(), marks.begin(), marks.end()) - jpeg.begin();
}

TEST_F(ImageFileTest, AJpegHasThePixelsThatOpenCvFinds) {
  for (const cv::Mat& pixels : {waves(), cv::Mat(waves().reshape(1))}) {
    for (const std::vector<int>& how : {std::vector<int>{},
                                        {cv::IMWRITE_JPEG_PROGRESSIVE, 1},
                                        {cv::IMWRITE_JPEG_RST_INTERVAL, 3}}) {
      const Bytes jpeg = jpeg_of(pixels, how);
      Image image;
      decode_image(jpeg, "a.jpg", image);
      const cv::Mat expected = cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE);
      EXPECT_EQ(image.pixels, Bytes(expected.datastart, expected.dataend));
    }
  }
}

TEST_F(ImageFileTest, AFrameOfAWebcamIsRead) {
  // GIVEN a frame of motion JPEG, which leaves out the usual code tables
  const Bytes whole = jpeg_of(waves());
  Bytes frame = whole;
  for (auto at = last_mark(frame, 0xc4); at < std::ssize(frame); at = last_mark(frame, 0xc4)) {
    const auto length =
        frame[static_cast<std::size_t>(at) + 2] << 8 | frame[static_cast<std::size_t>(at) + 3];
    frame.erase(frame.begin() + at, frame.begin() + at + 2 + length);
  }
  ASSERT_LT(frame.size(), whole.size());
  // WHEN there are a few bytes too many before its end, too
  frame.insert(frame.end() - 2, {1, 2, 3});
  // THEN its pixels are those of the whole file
  Image expected, image;
  decode_image(whole, "whole", expected);
  decode_image(frame, "frame", image);
  EXPECT_EQ(image.pixels, expected.pixels);
}

TEST_F(ImageFileTest, AJpegWhosePixelsAreGuessedIsRefused) {
  Image image;
  const auto refusal = [&image](const Bytes& bytes) {
    return testing::error_of([&] { decode_image(bytes, "a", image); });
  };
  // GIVEN a JPEG of which the second half was lost, but for the mark of the end
  Bytes bytes = jpeg_of(waves());
  bytes.erase(bytes.begin() + std::ssize(bytes) * 2 / 3, bytes.end() - 2);
  // THEN it is no image, and nothing is said but this
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(refusal(bytes), "a: Corrupt JPEG data: premature end of data segment");
  // AND so it is without the mark
  bytes.resize(bytes.size() - 2);
  EXPECT_EQ(refusal(bytes), "a: Premature end of JPEG file");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  // AND when the restart marks say that a part is missing
  bytes = jpeg_of(waves(), {cv::IMWRITE_JPEG_RST_INTERVAL, 3});
  const auto lost = last_mark(bytes, 0xd2);
  bytes.erase(bytes.begin() + lost, bytes.begin() + lost + 40);
  EXPECT_EQ(refusal(bytes).substr(0, 20), "a: Corrupt JPEG data");
  // AND an image of a thousand scans takes no time
  bytes = jpeg_of(waves(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  const Bytes begin_of_scan{0xff, 0xda}, tables_of_next{0xff, 0xc4};
  const auto scan =
      std::search(bytes.begin(), bytes.end(), begin_of_scan.begin(), begin_of_scan.end());
  const auto next = std::search(scan, bytes.end(), tables_of_next.begin(), tables_of_next.end());
  ASSERT_LT(next, bytes.end());
  const Bytes first_scan(scan, next);
  const auto place = scan - bytes.begin();
  for (int i = 0; i < 1000; ++i) {
    bytes.insert(bytes.begin() + place, first_scan.begin(), first_scan.end());
  }
  EXPECT_EQ(refusal(bytes), "a: has more than 64 scans");
  // AND a few kilobytes do not ask for hundreds of megabytes
  const cv::Mat one_colour(5000, 5000, CV_8UC3, cv::Scalar(90, 91, 92));
  cv::imencode(".jpg", one_colour, bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_EQ(refusal(bytes), "a: is progressive and needs more than 64 MiB");
  cv::imencode(".jpg", one_colour, bytes);
  EXPECT_NO_THROW(decode_image(bytes, "a", image));
}

TEST_F(ImageFileTest, AFullDiskIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(write_png("/dev/full", pattern()), std::runtime_error);
}

}  // namespace
}  // namespace viwo
