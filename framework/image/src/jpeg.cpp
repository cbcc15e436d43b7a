#include "jpeg.hpp"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdio>

#include <jpeglib.h>
// After jpeglib.h.
#include <jerror.h>

#include "viwo/api/status.hpp"

namespace viwo {
namespace {

/// A progressive image has about ten; each takes as long as the whole image, however few bytes.
constexpr int kMostScans = 64;

/// Bytes of what libjpeg keeps of one that is progressive: up to 6 a pixel, and 3 of most.
constexpr long kMostKept = 64L << 20;

/// libjpeg goes on behind these with grey or with what it has already. Others it mends: bytes too
/// many between two marks, as cheap cameras write them, change no pixel.
constexpr std::array kPixelsAreGuessed{JWRN_HIT_MARKER, JWRN_JPEG_EOF, JWRN_HUFF_BAD_CODE,
                                       JWRN_MUST_RESYNC, JWRN_ARITH_BAD_CODE};

/// libjpeg calls back with its `err`, whose owner this is.
class JpegDecoder {
 public:
  JpegDecoder() {
    info_.err = jpeg_std_error(&errors_);
    info_.client_data = this;
    errors_.error_exit = [](j_common_ptr info) { fail(info); };
    errors_.emit_message = [](j_common_ptr info, int level) {
      const auto code = info->err->msg_code;
      if (level < 0 && std::find(kPixelsAreGuessed.begin(), kPixelsAreGuessed.end(), code) !=
                           kPixelsAreGuessed.end()) {
        fail(info);
      }
    };
    errors_.output_message = [](j_common_ptr) {};
    progress_.progress_monitor = [](j_common_ptr info) {
      if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number > kMostScans) {
        std::snprintf(of(info).message_.data(), of(info).message_.size(), "has more than %d scans",
                      kMostScans);
        std::longjmp(of(info).failed_, 1);
      }
    };
  }
  ~JpegDecoder() { jpeg_destroy_decompress(&info_); }
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  /// False with `message()`. Has no objects of C++ but what the caller owns: libjpeg is C and
  /// leaves by longjmp.
  bool decode(std::span<const std::uint8_t> bytes, ImageSize size, Image& out) {
    if (setjmp(failed_) != 0) return false;  // NOLINT(cert-err52-cpp): as libjpeg is made for
    jpeg_create_decompress(&info_);
    info_.progress = &progress_;
    info_.mem->max_memory_to_use = kMostKept;
    jpeg_mem_src(&info_, bytes.data(), static_cast<unsigned long>(bytes.size()));
    jpeg_read_header(&info_, TRUE);
    if (info_.image_width != size.width_px || info_.image_height != size.height_px) {
      std::snprintf(message_.data(), message_.size(), "has a damaged header");
      return false;
    }
    info_.out_color_space = JCS_GRAYSCALE;
    jpeg_start_decompress(&info_);
    const std::size_t width = info_.output_width;
    out.width_px = static_cast<int>(info_.output_width);
    out.height_px = static_cast<int>(info_.output_height);
    out.pixels.resize(width * info_.output_height);
    while (info_.output_scanline < info_.output_height) {
      JSAMPROW row = out.pixels.data() + width * info_.output_scanline;
      jpeg_read_scanlines(&info_, &row, 1);
    }
    jpeg_finish_decompress(&info_);
    return true;
  }
  [[nodiscard]] const char* message() const { return message_.data(); }

 private:
  static JpegDecoder& of(j_common_ptr info) {
    return *static_cast<JpegDecoder*>(info->client_data);
  }
  [[noreturn]] static void fail(j_common_ptr info) {
    auto& message = of(info).message_;
    info->err->format_message(info, message.data());
    if (info->err->msg_code == JERR_NO_BACKING_STORE) {
      std::snprintf(message.data(), message.size(), "is progressive and needs more than %ld MiB",
                    kMostKept >> 20);
    }
    std::longjmp(of(info).failed_, 1);  // NOLINT(cert-err52-cpp)
  }

  jpeg_decompress_struct info_{};
  jpeg_error_mgr errors_{};
  jpeg_progress_mgr progress_{};
  std::jmp_buf failed_{};
  std::array<char, JMSG_LENGTH_MAX> message_{};
};

}  // namespace

void decode_jpeg(std::span<const std::uint8_t> bytes, ImageSize size, const std::string& name,
                 Image& out) {
  JpegDecoder decoder;
  if (!decoder.decode(bytes, size, out)) throw InputError(name + ": " + decoder.message());
}

}  // namespace viwo
