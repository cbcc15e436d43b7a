// Build record: how a binary was compiled, as text that a host can find in a plugin's file without
// loading it. Two binaries may exchange the C++ types of this API only if their records agree.
//
// In the record: what changes the layout or the allocation of types that cross the boundary, or the
// state of the floating-point unit. Not in it: optimisation level, debug information, language
// standard, NDEBUG. Its last field has room for a digest of the file, which viwo_seal writes after
// the link: a file that is damaged is refused before any of it is loaded.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include <Eigen/Core>

#include "viwo/api/export.hpp"

namespace viwo {

/// Bump when any header in viwo/api changes the layout of a type, the order of virtual functions or
/// the meaning of a value. Plugins built for another number are refused.
inline constexpr int kApiVersion = 11;

inline constexpr std::string_view kBuildRecordBegin = "viwo-build-record{";
inline constexpr char kBuildRecordEnd = '}';
inline constexpr std::string_view kDigestField = "digest";

namespace detail {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr int kAddressSanitizer = 1;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr int kAddressSanitizer = 1;
#else
inline constexpr int kAddressSanitizer = 0;
#endif
#else
inline constexpr int kAddressSanitizer = 0;
#endif

#if defined(__SANITIZE_THREAD__)
inline constexpr int kThreadSanitizer = 1;
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
inline constexpr int kThreadSanitizer = 1;
#else
inline constexpr int kThreadSanitizer = 0;
#endif
#else
inline constexpr int kThreadSanitizer = 0;
#endif

#if defined(__clang__)
inline constexpr std::string_view kCompiler = "clang";
inline constexpr int kCompilerMajor = __clang_major__;
#else
inline constexpr std::string_view kCompiler = "gcc";
inline constexpr int kCompilerMajor = __GNUC__;
#endif

#if defined(_GLIBCXX_USE_CXX11_ABI)
inline constexpr int kCxx11Abi = _GLIBCXX_USE_CXX11_ABI;
#else
inline constexpr int kCxx11Abi = -1;
#endif

#if defined(_GLIBCXX_DEBUG)
inline constexpr int kGlibcxxDebug = 1;
#else
inline constexpr int kGlibcxxDebug = 0;
#endif

#if defined(__FAST_MATH__)
inline constexpr int kFastMath = 1;
#else
inline constexpr int kFastMath = 0;
#endif

#if defined(EIGEN_DEFAULT_TO_ROW_MAJOR)
inline constexpr int kEigenRowMajor = 1;
#else
inline constexpr int kEigenRowMajor = 0;
#endif

/// Text of fixed capacity that can be put together at compile time.
struct RecordText {
  std::array<char, 640> text{};
  std::size_t size = 0;

  constexpr void add(std::string_view part) {
    for (const char c : part) text[size++] = c;
  }
  constexpr void add(long value) {
    if (value < 0) {
      text[size++] = '-';
      value = -value;
    }
    std::array<char, 24> digits{};
    std::size_t n = 0;
    do {
      digits[n++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value > 0);
    while (n > 0) text[size++] = digits[--n];
  }
  constexpr void field(std::string_view key, long value) {
    add(key);
    add("=");
    add(value);
    add(";");
  }
};

constexpr RecordText make_build_record() {
  RecordText record;
  record.add(kBuildRecordBegin);
  record.field("api", kApiVersion);
  record.add("compiler=");
  record.add(kCompiler);
  record.add("-");
  record.add(kCompilerMajor);
  record.add(";");
  record.field("gxx_abi", __GXX_ABI_VERSION);
  record.field("cxx11_abi", kCxx11Abi);
  record.field("glibcxx_debug", kGlibcxxDebug);
  record.field("address_sanitizer", kAddressSanitizer);
  record.field("thread_sanitizer", kThreadSanitizer);
  record.field("eigen_world", EIGEN_WORLD_VERSION);
  record.field("eigen_major", EIGEN_MAJOR_VERSION);
  record.field("eigen_minor", EIGEN_MINOR_VERSION);
  record.field("eigen_max_align", EIGEN_MAX_ALIGN_BYTES);
  record.field("eigen_max_static_align", EIGEN_MAX_STATIC_ALIGN_BYTES);
  record.field("eigen_malloc_aligned", EIGEN_MALLOC_ALREADY_ALIGNED);
  record.field("eigen_row_major", kEigenRowMajor);
  record.field("eigen_index_size", sizeof(Eigen::Index));
  record.field("eigen_vector4d_align", alignof(Eigen::Vector4d));
  record.field("fast_math", kFastMath);
  record.add(kDigestField);
  record.add("=--------;");
  record.text[record.size++] = kBuildRecordEnd;
  return record;
}

}  // namespace detail

/// The record of the translation unit that includes this header: NUL-terminated, from
/// kBuildRecordBegin to kBuildRecordEnd, "key=value;" in between.
inline constexpr detail::RecordText kBuildRecord = detail::make_build_record();

/// The record of libviwo_api.so itself: what plugins are compared with, and the host too.
VIWO_API std::string_view api_build_record();

}  // namespace viwo
