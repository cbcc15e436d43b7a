// A few bytes that ask for a great deal of memory.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <zlib.h>

#include "image_header.hpp"
#include "message_of.hpp"
#include "peak_memory.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// `bytes` with a number of four bytes put in, most significant byte first.
Bytes with_number(Bytes bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  return bytes;
}

// A decoder of another format would take what OpenCV's own does not: DICOM by its mark at 128.
TEST(ImageHeader, IsNoneOfAPgmWithoutTheSpaceBehindItsMark) {
  std::string bytes = "P5\x89 4 4 255 ";
  bytes.resize(128, ' ');
  bytes += "DICM";
  bytes.resize(256, '\0');
  EXPECT_FALSE(image_size(Bytes(bytes.begin(), bytes.end())).has_value());
}

TEST(ImageHeader, TheSizeIsReadBeforeThePixels) {
  Image image;
  const auto refusal = [&image](const Bytes& bytes) {
    return testing::error_of([&] { decode_image(bytes, "a", image); });
  };
  const std::string most = " pixels, at most 32 Mi are read";
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  Bytes bytes;
  cv::imencode(".png", grey, bytes);
  // A wrong check sum of the header: who looks further says something else.
  EXPECT_EQ(refusal(with_number(with_number(bytes, 16, 32767), 20, 32767)),
            "a: an image of 32767 x 32767" + most);
  EXPECT_EQ(refusal(with_number(bytes, 16, 0xffffffff)), "a: an image of 4294967295 x 20" + most);
  EXPECT_EQ(refusal(with_number(bytes, 20, 0)), "a: an image of 30 x 0" + most);
  cv::imencode(".jpg", grey, bytes);
  const Bytes begin_of_frame{0xff, 0xc0};
  const auto frame =
      std::search(bytes.begin(), bytes.end(), begin_of_frame.begin(), begin_of_frame.end());
  ASSERT_NE(frame, bytes.end());
  EXPECT_EQ(
      refusal(with_number(bytes, static_cast<std::size_t>(frame - bytes.begin()) + 5, 0xff00ff01)),
      "a: an image of 65281 x 65280" + most);
  cv::imencode(".bmp", grey, bytes);
  EXPECT_EQ(refusal(with_number(bytes, 18, 0x000000ff)), "a: an image of 4278190080 x 20" + most);
  cv::imencode(".pgm", grey, bytes);
  const std::string pgm = "P5\n# 1 2\n 30000\n30000 255\n";
  EXPECT_EQ(refusal({pgm.begin(), pgm.end()}), "a: an image of 30000 x 30000" + most);
}

TEST(ImageHeader, PixelsOfAnImageOfAnotherSizeAreNotDecoded) {
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  for (const char* const format : {".png", ".jpg", ".bmp", ".pgm"}) {
    Bytes bytes;
    cv::imencode(format, grey, bytes);
    Image image;
    decode_image_of_size(bytes, "a", 30, 20, image);
    EXPECT_EQ(image.pixels.size(), 600U) << format;
    for (const int height_px : {20, 21}) {
      decode_image_of_size(bytes, "a", 31, height_px, image);
      EXPECT_EQ(image.width_px, 30) << format;
      EXPECT_EQ(image.height_px, 20) << format;
      EXPECT_TRUE(image.pixels.empty()) << format;
    }
  }
  // GIVEN one whose pixels are damaged
  Bytes png;
  cv::imencode(".png", grey, png);
  const std::string_view data = "IDAT";
  const auto pixels = std::search(png.begin(), png.end(), data.begin(), data.end());
  ASSERT_LT(pixels, png.end() - 8);
  std::fill(pixels + 4, pixels + 8, std::uint8_t{0xff});
  // THEN that shows where they are asked for, and nowhere else
  Image image;
  EXPECT_NE(testing::error_of([&] { decode_image_of_size(png, "a", 30, 20, image); }), "");
  decode_image_of_size(png, "a", 30, 21, image);
  EXPECT_EQ(image.height_px, 20);
}

/// libjpeg skips the bytes FF 00 and goes on with what is behind them; who takes them for a segment
/// skips that.
TEST(ImageHeader, AJpegHasTheSizeThatLibjpegFinds) {
  const cv::Mat grey(20, 30, CV_8UC1, cv::Scalar(90));
  Bytes small;
  cv::imencode(".jpg", grey, small);
  const Bytes begin_of_frame{0xff, 0xc0};
  const auto frame =
      std::search(small.begin(), small.end(), begin_of_frame.begin(), begin_of_frame.end());
  ASSERT_NE(frame, small.end());
  const Bytes large =
      with_number(small, static_cast<std::size_t>(frame - small.begin()) + 5, 0xff00ff00);
  const std::size_t hidden = large.size();
  ASSERT_LT(hidden, 0xffffU);
  Bytes bytes{0xff,
              0xd8,
              0xff,
              0x00,
              static_cast<std::uint8_t>(hidden >> 8U),
              static_cast<std::uint8_t>(hidden)};
  bytes.insert(bytes.end(), large.begin() + 2, large.end());
  bytes.insert(bytes.end(), small.begin() + 2, small.end());
  Image image;
  EXPECT_EQ(testing::error_of([&] { decode_image(bytes, "a", image); }), "a: has a damaged header");
}

/// A chunk of a PNG that begins with its type.
Bytes chunk_of(std::string_view begin, const Bytes& rest = {}) {
  Bytes chunk(4);
  chunk.insert(chunk.end(), begin.begin(), begin.end());
  chunk.insert(chunk.end(), rest.begin(), rest.end());
  const std::size_t typed = chunk.size() - 4;
  const auto sum = static_cast<std::uint32_t>(crc32(0, chunk.data() + 4, static_cast<uInt>(typed)));
  chunk = with_number(chunk, 0, static_cast<std::uint32_t>(typed - 4));
  chunk.resize(chunk.size() + 4);
  return with_number(chunk, chunk.size() - 4, sum);
}

Bytes compressed_zeros(std::size_t count) {
  const Bytes zeros(count);
  Bytes out(compressBound(count));
  uLongf size = out.size();
  compress(out.data(), &size, zeros.data(), zeros.size());
  out.resize(size);
  return out;
}

/// In colours, with these chunks behind its header.
Bytes png_with(const Bytes& chunk, int times = 1) {
  const cv::Mat colours(20, 30, CV_8UC3, cv::Scalar(10, 200, 90));
  Bytes png;
  cv::imencode(".png", colours, png);
  constexpr std::ptrdiff_t kHead = 8 + 25;  // the magic, IHDR
  for (int i = 0; i < times; ++i) png.insert(png.begin() + kHead, chunk.begin(), chunk.end());
  return png;
}

/// Eight megabytes each.
TEST(ImageHeader, TextsOfAPngAreNotRead) {
  const Bytes text = chunk_of({"zTXta\0\0", 7}, compressed_zeros(8'000'000));
  Image expected, image;
  decode_image(png_with({}), "a", expected);
  const Bytes png = png_with(text, 60);
  const long before_mb = testing::peak_mb();
  decode_image(png, "a", image);
  EXPECT_EQ(image.pixels, expected.pixels);
  EXPECT_LT(testing::peak_mb() - before_mb, 50);
}

/// Of a profile that is none libpng would print the name.
TEST(ImageHeader, NoNameOfAPngReachesTheTerminal) {
  Image expected, image;
  decode_image(png_with({}), "a", expected);
  const Bytes profile = chunk_of({"iCCP\x1b[31mred\0\0", 14}, compressed_zeros(200));
  ::testing::internal::CaptureStderr();
  decode_image(png_with(profile), "a", image);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(image.pixels, expected.pixels);
}

/// Colours are added as libpng adds them, by the powers that the file says.
TEST(ImageHeader, APngWithAGammaHasThePixelsThatOpenCvReads) {
  for (const std::string_view gamma :
       {std::string_view("gAMA\0\0\xb1\x8f", 8), std::string_view("gAMA\0\0\x20\0", 8),
        std::string_view("sRGB\0", 5)}) {
    const Bytes png = png_with(chunk_of(gamma));
    Image image;
    decode_image(png, "a", image);
    const cv::Mat expected = cv::imdecode(png, cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(image.pixels.size(), expected.total());
    EXPECT_TRUE(std::equal(image.pixels.begin(), image.pixels.end(), expected.datastart));
  }
}

/// libpng would ask for its memory before it looks for it.
TEST(ImageHeader, AChunkOfAPngThatIsNotThereIsNotAskedFor) {
  const cv::Mat colours(20, 30, CV_8UC3, cv::Scalar(10, 200, 90));
  Bytes png;
  cv::imencode(".png", colours, png);
  constexpr std::size_t kHead = 8 + 25;  // the magic, IHDR
  const Bytes head(png.begin(), png.begin() + kHead);
  for (const std::string_view type : {"zTXt", "eXIf", "abcd"}) {
    Bytes claims = with_number(png, kHead, 0x6f67000f);
    std::copy(type.begin(), type.end(), claims.begin() + kHead + 4);
    EXPECT_EQ(needed_for_pixels(claims), head) << type;
    Image image;
    EXPECT_NE(testing::error_of([&] { decode_image(claims, "a", image); }), "") << type;
  }
}

}  // namespace
}  // namespace viwo
