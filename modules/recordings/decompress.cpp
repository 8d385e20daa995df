#include "modules/recordings/decompress.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Packed = std::span<const std::uint8_t>;
using Unpacked = std::span<std::uint8_t>;

// Bytes that a library has used.
struct Used {
  std::size_t read = 0, written = 0;
  bool is_whole = false;  // the end of the compressed bytes was found
};

Used unpack_lz4(Packed in, Unpacked out) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return {};
  Used used{.read = in.size(), .written = out.size()};
  used.is_whole =
      LZ4F_decompress(context, out.data(), &used.written, in.data(), &used.read, nullptr) == 0;
  LZ4F_freeDecompressionContext(context);
  return used;
}

Used unpack_zstd(Packed in, Unpacked out) {
  const std::size_t written = ZSTD_decompress(out.data(), out.size(), in.data(), in.size());
  return {in.size(), written, !in.empty() && ZSTD_isError(written) == 0};
}

Used unpack_bzip2(Packed in, Unpacked out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return {};
  // The library reads from next_in only; its type has no const.
  stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(in.data()));
  stream.avail_in = static_cast<unsigned>(in.size());
  stream.next_out = reinterpret_cast<char*>(out.data());
  stream.avail_out = static_cast<unsigned>(out.size());
  const bool is_whole = BZ2_bzDecompress(&stream) == BZ_STREAM_END;
  BZ2_bzDecompressEnd(&stream);
  return {in.size() - stream.avail_in, out.size() - stream.avail_out, is_whole};
}

}  // namespace

Decoded<Bytes> decompress(std::string_view compression, Packed bytes, std::uint64_t size) {
  using Output = Decoded<Bytes>;
  if (size > kMaxDecompressed_bytes) return Output::refuse("more than 512 MiB in one piece");
  if (compression.empty() || compression == "none") {
    if (bytes.size() != size)
      return Output::refuse("another number of bytes than their chunk states");
    return Output::accept(Bytes(bytes.begin(), bytes.end()));
  }
  const auto unpack = compression == "lz4"    ? unpack_lz4
                      : compression == "zstd" ? unpack_zstd
                      : compression == "bz2"  ? unpack_bzip2
                                              : nullptr;
  if (unpack == nullptr) return Output::refuse("an unknown compression");
  Bytes result(size + 1);  // shows a longer result
  const Used used = unpack(bytes, result);
  if (!used.is_whole)
    return Output::refuse("compressed bytes that are damaged, or longer than their chunk states");
  if (used.written != size)
    return Output::refuse("another number of bytes than their chunk states");
  if (used.read != bytes.size()) return Output::refuse("bytes after the compressed ones");
  result.pop_back();
  return Output::accept(std::move(result));
}

}  // namespace km
