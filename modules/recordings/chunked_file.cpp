#include "modules/recordings/chunked_file.hpp"

#include <bzlib.h>
#include <fcntl.h>
#include <lz4frame.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>
#include <algorithm>
#include <cerrno>
#include <system_error>
#include <tuple>

#include "modules/core/io/input_file.hpp"

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

ChunkMerge::ChunkMerge(std::vector<ChunkRange> places, Load load, Lost lost,
                       std::uint64_t held_bytes)
    : load_(std::move(load)), lost_(std::move(lost)), max_held_bytes_(held_bytes) {
  std::sort(places.begin(), places.end(), [](const ChunkRange& a, const ChunkRange& b) {
    return std::tie(a.first, a.begin) < std::tie(b.first, b.begin);
  });
  waiting_.assign(places.begin(), places.end());
}

std::vector<ChunkMerge::Open>::iterator ChunkMerge::earliest() {
  return std::min_element(open_.begin(), open_.end(), [](const Open& a, const Open& b) {
    return std::tie(a.chunk.entries[a.next].log_time, a.place.begin) <
           std::tie(b.chunk.entries[b.next].log_time, b.place.begin);
  });
}

void ChunkMerge::open_due() {
  while (!waiting_.empty()) {
    if (!open_.empty()) {
      const auto top = earliest();
      if (waiting_.front().first > top->chunk.entries[top->next].log_time) return;
    }
    const ChunkRange place = waiting_.front();
    waiting_.pop_front();
    open(place);
  }
}

void ChunkMerge::open(const ChunkRange& place) {
  make_room();
  Open opened{.place = place, .chunk = load_(place)};
  auto& entries = opened.chunk.entries;
  if (entries.empty()) return;
  std::stable_sort(
      entries.begin(), entries.end(),
      [](const Chunk::Entry& a, const Chunk::Entry& b) { return a.log_time < b.log_time; });
  held_bytes_ += opened.chunk.bytes.size();
  open_.push_back(std::move(opened));
}

void ChunkMerge::make_room() {
  if (held_bytes_ <= max_held_bytes_) return;
  for (Open& open : open_) open.chunk.bytes = {};
  held_bytes_ = 0;
}

std::optional<std::vector<std::uint8_t>> ChunkMerge::bytes_of(Open& open,
                                                              const Chunk::Entry& entry) {
  std::vector<std::uint8_t>& bytes = open.chunk.bytes;
  if (bytes.empty() && entry.size > 0) {
    make_room();
    bytes = load_(open.place).bytes;
    held_bytes_ += bytes.size();
  }
  if (bytes.size() < entry.begin + entry.size) return std::nullopt;
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(entry.begin);
  return std::vector<std::uint8_t>(begin, begin + entry.size);
}

std::optional<BagMessage> ChunkMerge::next() {
  for (open_due(); !open_.empty(); open_due()) {
    const auto open = earliest();
    const Chunk::Entry entry = open->chunk.entries[open->next++];
    std::optional<std::vector<std::uint8_t>> bytes;
    if (!last_ || entry.log_time >= *last_) bytes = bytes_of(*open, entry);
    if (!bytes) lost_(open->place, entry);
    if (open->next == open->chunk.entries.size()) {
      held_bytes_ -= open->chunk.bytes.size();
      open_.erase(open);
    }
    if (!bytes) continue;
    last_ = entry.log_time;
    return BagMessage{
        .channel = entry.channel, .log_time = entry.log_time, .bytes = std::move(*bytes)};
  }
  return std::nullopt;
}

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

Decoded<Bytes> decompress_message(Packed bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  const bool is_known = size != ZSTD_CONTENTSIZE_UNKNOWN && size != ZSTD_CONTENTSIZE_ERROR;
  if (!is_known || size > kExpected_bytes + kExpectedRatio * bytes.size())
    return Decoded<Bytes>::refuse("compressed bytes of an unknown or impossible size");
  return decompress("zstd", bytes, size);
}

RandomAccessFile::RandomAccessFile(const std::filesystem::path& path) : path_(path) {
  if (const std::string problem = problem_of_file(path); !problem.empty())
    throw InputFileError(path.string() + ": " + problem);
  descriptor_ = Descriptor(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (descriptor_.get() < 0)
    throw InputFileError(path.string() +
                         ": cannot be opened: " + std::generic_category().message(errno));
  struct stat status {};
  if (fstat(descriptor_.get(), &status) != 0 || !S_ISREG(status.st_mode))
    throw InputFileError(path.string() + ": not a regular file");
  size_ = static_cast<std::uint64_t>(status.st_size);
}

std::vector<std::uint8_t> RandomAccessFile::read(std::uint64_t offset, std::uint64_t size) const {
  const auto fail = [&] { throw InputFileError(place(offset) + ": cannot be read"); };
  if (!has(offset, size)) fail();
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = pread(descriptor_.get(), bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(offset + done));
    if (count == 0 || (count < 0 && errno != EINTR)) fail();
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return bytes;
}

std::string RandomAccessFile::beginning(std::uint64_t size) const {
  const auto bytes = read(0, std::min(size_, size));
  return {bytes.begin(), bytes.end()};
}

std::string RandomAccessFile::place(std::uint64_t offset) const {
  return path_.string() + " byte " + std::to_string(offset);
}

std::vector<std::uint8_t> ChunkedFile::unpack(std::uint64_t begin, const std::string& compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size) {
  const std::string chunk = "a chunk (" + std::to_string(size) + " bytes, compression '" +
                            compression + "'): ";  // decompressed
  const bool is_new = !unpacked_.contains(begin);
  if (is_new && size > left_bytes_) {
    fault(BagFault::kCompression, begin,
          chunk + "with those before it, more than 64 MiB and 250 times the file");
    return {};
  }
  if (is_new) left_bytes_ -= size;
  unpacked_.insert(begin);
  auto records = decompress(compression, bytes, size);
  if (!records.value) fault(BagFault::kCompression, begin, chunk + records.refusal);
  return std::move(records.value).value_or(std::vector<std::uint8_t>());
}

Chunk ChunkedFile::load(const ChunkRange& place) {
  is_known_ = !read_.insert(place.begin).second;
  Chunk chunk = parse_(place);
  is_known_ = false;
  return chunk;
}

void ChunkedFile::scan(std::uint64_t begin, std::uint64_t end, bool counts) {
  ChunkRange place{.begin = begin, .end = end};
  const Chunk chunk = load(place);
  if (chunk.entries.empty()) return;
  place.first = std::ranges::min(chunk.entries, {}, &Chunk::Entry::log_time).log_time;
  places.push_back(place);
  if (!counts) return;
  for (const Chunk::Entry& entry : chunk.entries) ++channels.at(entry.channel).message_count;
}

std::optional<BagMessage> ChunkedFile::next() {
  if (!merge_)
    merge_.emplace(
        std::move(places), [this](const ChunkRange& place) { return load(place); },
        [this](const ChunkRange& place, const Chunk::Entry& entry) {
          fault(BagFault::kUnordered, place.begin, channels.at(entry.channel).topic);
        });
  return merge_->next();
}

}  // namespace km
