#include "modules/recordings/decompress.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <limits>
#include <memory>

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Output = Decoded<Bytes>;

constexpr const char* kDamaged = "compressed bytes that are damaged";

enum class Step { kMore, kEnd, kFailed };

// Advances `in` and `out` by the bytes that a call of the library has used.
struct Buffers {
  std::span<const std::uint8_t> in;
  std::span<std::uint8_t> out;

  void advance(std::size_t read, std::size_t written) {
    in = in.subspan(read);
    out = out.subspan(written);
  }
};

class Lz4 {
 public:
  Lz4() {
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) == 0)
      context_.reset(made);
  }
  Step operator()(Buffers& buffers) {
    std::size_t read = buffers.in.size();
    std::size_t written = buffers.out.size();
    const std::size_t left = LZ4F_decompress(context_.get(), buffers.out.data(), &written,
                                             buffers.in.data(), &read, nullptr);
    if (LZ4F_isError(left) != 0) return Step::kFailed;
    buffers.advance(read, written);
    return left == 0 ? Step::kEnd : Step::kMore;
  }

 private:
  struct Free {
    void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
  };
  std::unique_ptr<LZ4F_dctx, Free> context_;
};

class Zstd {
 public:
  Step operator()(Buffers& buffers) {
    ZSTD_inBuffer in{buffers.in.data(), buffers.in.size(), 0};
    ZSTD_outBuffer out{buffers.out.data(), buffers.out.size(), 0};
    const std::size_t left = ZSTD_decompressStream(context_.get(), &out, &in);
    if (ZSTD_isError(left) != 0) return Step::kFailed;
    buffers.advance(in.pos, out.pos);
    return left == 0 ? Step::kEnd : Step::kMore;
  }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  std::unique_ptr<ZSTD_DCtx, Free> context_{ZSTD_createDCtx()};
};

class Bzip2 {
 public:
  Bzip2() { opened_ = BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK; }
  ~Bzip2() {
    if (opened_) BZ2_bzDecompressEnd(&stream_);
  }
  Bzip2(const Bzip2&) = delete;
  Bzip2& operator=(const Bzip2&) = delete;

  Step operator()(Buffers& buffers) {
    const auto in = static_cast<unsigned>(std::min(buffers.in.size(), kMost));
    const auto out = static_cast<unsigned>(std::min(buffers.out.size(), kMost));
    // The library reads from next_in only; its type has no const.
    stream_.next_in = const_cast<char*>(reinterpret_cast<const char*>(buffers.in.data()));
    stream_.avail_in = in;
    stream_.next_out = reinterpret_cast<char*>(buffers.out.data());
    stream_.avail_out = out;
    const int result = opened_ ? BZ2_bzDecompress(&stream_) : BZ_PARAM_ERROR;
    if (result != BZ_OK && result != BZ_STREAM_END) return Step::kFailed;
    buffers.advance(in - stream_.avail_in, out - stream_.avail_out);
    return result == BZ_STREAM_END ? Step::kEnd : Step::kMore;
  }

 private:
  static constexpr std::size_t kMost = std::numeric_limits<unsigned>::max();
  bz_stream stream_{};
  bool opened_ = false;
};

template <typename Codec>
Output run(Codec codec, std::span<const std::uint8_t> bytes, std::uint64_t size) {
  constexpr std::size_t kFirst_bytes = std::size_t{1} << 20U;
  Bytes result(std::min<std::uint64_t>(size, kFirst_bytes));
  Buffers buffers{.in = bytes, .out = result};
  while (true) {
    const std::size_t in_before = buffers.in.size();
    const std::size_t out_before = buffers.out.size();
    const Step step = codec(buffers);
    if (step == Step::kFailed) return Output::refuse(kDamaged);
    if (step == Step::kEnd) break;
    if (!buffers.out.empty()) {
      const bool stands = buffers.in.size() == in_before && buffers.out.size() == out_before;
      if (stands || buffers.in.empty()) return Output::refuse("compressed bytes without an end");
    } else if (result.size() < size) {
      const std::size_t full = result.size();
      result.resize(std::min<std::uint64_t>(size, 2 * full));
      buffers.out = std::span(result).subspan(full);
    } else if (buffers.in.size() == in_before && out_before == 0) {
      return Output::refuse("more bytes than their chunk states");
    }
  }
  if (!buffers.out.empty() || result.size() != size)
    return Output::refuse("fewer bytes than their chunk states");
  if (!buffers.in.empty()) return Output::refuse("bytes after the compressed ones");
  return Output::accept(std::move(result));
}

}  // namespace

Output decompress(std::string_view compression, std::span<const std::uint8_t> bytes,
                  std::uint64_t size) {
  if (size > kMaxDecompressed_bytes) return Output::refuse("more than 512 MiB in one piece");
  if (compression.empty() || compression == "none") {
    if (bytes.size() != size)
      return Output::refuse("another number of bytes than their chunk states");
    return Output::accept(Bytes(bytes.begin(), bytes.end()));
  }
  if (compression == "lz4") return run(Lz4(), bytes, size);
  if (compression == "zstd") return run(Zstd(), bytes, size);
  if (compression == "bz2") return run(Bzip2(), bytes, size);
  return Output::refuse("an unknown compression");
}

bool UnpackLimit::accept(std::uint64_t begin, std::uint64_t size) {
  if (accepted_.contains(begin)) return true;
  if (size > left_bytes_) return false;
  left_bytes_ -= size;
  accepted_.insert(begin);
  return true;
}

}  // namespace km
