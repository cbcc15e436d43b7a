#include "mcap_chunk.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

namespace viwo::bag::mcap {
namespace {

struct Step {
  std::size_t taken = 0;
  std::size_t given = 0;
  bool has_failed = false;
};

/// Piece by piece: how much there will be is known when it is there, whatever a file claims.
class Decoder {
 public:
  virtual ~Decoder() = default;
  virtual Step step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) = 0;
};

class Plain final : public Decoder {
 public:
  Step step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) override {
    const std::size_t n = std::min(in.size(), out.size());
    std::copy_n(in.begin(), n, out.begin());
    return {n, n};
  }
};

class Lz4 final : public Decoder {
 public:
  Lz4() { is_ready_ = LZ4F_isError(LZ4F_createDecompressionContext(&context_, LZ4F_VERSION)) == 0; }
  ~Lz4() override { LZ4F_freeDecompressionContext(context_); }
  Lz4(const Lz4&) = delete;
  Lz4& operator=(const Lz4&) = delete;

  Step step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) override {
    Step done{in.size(), out.size()};
    done.has_failed = !is_ready_ || LZ4F_isError(LZ4F_decompress(context_, out.data(), &done.given,
                                                                 in.data(), &done.taken, nullptr));
    return done;
  }

 private:
  LZ4F_dctx* context_ = nullptr;
  bool is_ready_ = false;
};

class Zstd final : public Decoder {
 public:
  Step step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) override {
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{out.data(), out.size(), 0};
    const std::size_t left =
        context_ ? ZSTD_decompressStream(context_.get(), &to, &from) : std::size_t(-1);
    return {from.pos, to.pos, ZSTD_isError(left) != 0};
  }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> context_{ZSTD_createDCtx()};
};

std::unique_ptr<Decoder> make_decoder(Compression compression) {
  switch (compression) {
    case Compression::kLz4:
      return std::make_unique<Lz4>();
    case Compression::kZstd:
      return std::make_unique<Zstd>();
    case Compression::kNone:
      break;
  }
  return std::make_unique<Plain>();
}

/// The compressed bytes of a chunk, a block at a time.
class Blocks {
 public:
  Blocks(const FileBytes& file, const Chunk& chunk)
      : file_(file), at_(chunk.at), end_(chunk.at + chunk.bytes) {}

  /// What has not been taken; empty at the end.
  std::span<const std::uint8_t> rest() {
    if (rest_.empty() && at_ < end_) {
      block_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, end_ - at_)));
      file_.read(at_, block_);
      at_ += block_.size();
      rest_ = block_;
    }
    return rest_;
  }
  void take(std::size_t n) { rest_ = rest_.subspan(n); }

 private:
  static constexpr std::uint64_t kBlock = 256 << 10;

  const FileBytes& file_;
  std::uint64_t at_, end_;
  Bytes block_;
  std::span<const std::uint8_t> rest_;
};

/// Room for more, but not for more than one byte too many, which tells that there are too many.
void make_room(const Chunk& chunk, Bytes& records, std::size_t used) {
  constexpr std::size_t kLeast = 64 << 10;
  if (used < records.size()) return;
  records.resize(static_cast<std::size_t>(
      std::min<std::uint64_t>(chunk.whole_bytes + 1, std::max(kLeast, 2 * used))));
}

}  // namespace

Content read_chunk(const FileBytes& file, const Chunk& chunk) {
  Content out;
  Blocks in(file, chunk);
  const std::unique_ptr<Decoder> decoder = make_decoder(chunk.compression);
  std::size_t used = 0;
  for (bool is_done = false; !is_done && used <= chunk.whole_bytes;) {
    make_room(chunk, out.records, used);
    const auto block = in.rest();
    const Step step = decoder->step(block, std::span(out.records).subspan(used));
    if (step.has_failed) {
      out.fault = "cannot be decompressed";
      break;
    }
    in.take(step.taken);
    used += step.given;
    is_done = step.taken + step.given == 0;
  }
  out.records.resize(used);
  if (chunk.is_cut) {
    out.fault.clear();
  } else if (out.fault.empty() && used != chunk.whole_bytes) {
    out.fault = "is of another size than it says";
  } else if (out.fault.empty() && chunk.crc != 0 &&
             chunk.crc != crc32_z(0, out.records.data(), used)) {
    out.fault = "has another check sum than it says";
  }
  return out;
}

}  // namespace viwo::bag::mcap
