#include "modules/journal/journal_file.hpp"

#include <fstream>
#include <span>
#include <string_view>
#include <utility>

#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"

namespace km {
namespace {

constexpr std::string_view kMark = "\x7FKMJRNL5";
constexpr std::size_t kHead_bytes = kMark.size() + 4 + 8;
constexpr std::size_t kLeast_bytes = kHead_bytes + 8;
// Limit on the total length of entries that fail their check. Beyond it nothing more is read: a
// hostile file could have a mark in every few bytes, and each length would be checked.
constexpr std::size_t kMostFalse_bytes = std::size_t{64} << 20U;

std::uint64_t check_sum(Stamp time, std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = kFnv1aBasis;
  mix_fnv1a(sum, bytes.size());
  mix_fnv1a(sum, static_cast<std::uint64_t>(time));
  mix_fnv1a(sum, bytes);
  return sum;
}

struct Frame {
  std::span<const std::uint8_t> bytes;  // empty if the text ends before them
  Stamp time = 0;
  bool is_whole = false;
};

// The entry whose mark is at `offset`.
Frame frame_at(std::string_view text, std::size_t offset) {
  ByteReader in({reinterpret_cast<const std::uint8_t*>(text.data()) + offset + kMark.size(),
                 text.size() - offset - kMark.size()});
  const std::uint32_t size = in.u32();
  const auto time = static_cast<Stamp>(in.u64());
  if (size > kMaxJournalEntry_bytes) return {};
  const auto bytes = in.bytes(size);
  const std::uint64_t sum = in.u64();
  return {bytes, time, !in.failed() && sum == check_sum(time, bytes)};
}

}  // namespace

std::string to_string(const JournalDamage& damage, const std::filesystem::path& file) {
  return file.string() + ": " + std::to_string(damage.bytes) + " bytes from byte " +
         std::to_string(damage.offset) + " on are damaged and left out";
}

JournalExtent read_journal(const std::filesystem::path& file,
                           const std::function<void(StoredEntry)>& take) {
  const std::string text = read_input_file(file);
  JournalExtent read;
  std::size_t false_bytes = 0;
  for (std::size_t at = 0; (at = text.find(kMark, at)) != std::string::npos;) {
    const Frame frame = frame_at(text, at);
    if (!frame.is_whole) {
      if ((false_bytes += frame.bytes.size()) > kMostFalse_bytes) break;
      ++at;
      continue;
    }
    auto entry = decode_journal_entry(frame.bytes);
    if (!entry.value)
      throw InputFileError(file.string() + ": entry " + std::to_string(read.entries + 1) + ": " +
                           entry.refusal + ": written by another version of this program");
    const bool after_damage = at > read.whole_bytes;
    if (after_damage) read.damages.push_back({read.whole_bytes, at - read.whole_bytes});
    const JournalPlace place{at + kHead_bytes, static_cast<std::uint32_t>(frame.bytes.size())};
    read.whole_bytes = at = at + kLeast_bytes + frame.bytes.size();
    ++read.entries;
    take({*std::move(entry.value), place, frame.time, after_damage});
  }
  read.cut_bytes = text.size() - read.whole_bytes;
  if (read.entries == 0 && !kMark.starts_with(std::string_view(text).substr(0, kMark.size())))
    throw InputFileError(file.string() + ": is no journal of a robot's run");
  return read;
}

JournalEntry read_journal_entry(const std::filesystem::path& file, const JournalPlace& place) {
  std::vector<std::uint8_t> bytes(place.bytes);
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(place.offset));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw InputFileError(file.string() + ": cannot be read where an entry was written");
  auto entry = decode_journal_entry(bytes);
  if (entry.value) return *std::move(entry.value);
  throw InputFileError(file.string() + ": is not what was written: " + entry.refusal);
}

JournalFile::JournalFile(std::filesystem::path file) : JournalFile(std::move(file), {}) {}

JournalFile::JournalFile(std::filesystem::path file, const JournalExtent& read)
    : file_(std::move(file)), keep_bytes_(read.whole_bytes), end_bytes_(read.whole_bytes) {}

std::optional<JournalPlace> JournalFile::add(const JournalEntry& entry, Stamp time) {
  const std::vector<std::uint8_t> bytes = encode_journal_entry(entry);
  full_ |=
      waiting_.size() + bytes.size() > kMaxWaiting_bytes || bytes.size() > kMaxJournalEntry_bytes;
  if (full_) return std::nullopt;
  ByteWriter head, sum;
  head.u32(static_cast<std::uint32_t>(bytes.size()));
  head.u64(static_cast<std::uint64_t>(time));
  sum.u64(check_sum(time, bytes));
  const JournalPlace place{end_bytes_ + kHead_bytes, static_cast<std::uint32_t>(bytes.size())};
  const std::size_t before = waiting_.size();
  const auto append = [this](const auto& part) { waiting_.append(part.begin(), part.end()); };
  append(kMark);
  append(head.release());
  append(bytes);
  append(sum.release());
  end_bytes_ += waiting_.size() - before;
  return place;
}

bool JournalFile::collect() {
  if (collected_.empty()) collected_.swap(waiting_);
  return !collected_.empty();
}

void JournalFile::write() {
  if (keep_bytes_ && is_there(file_)) std::filesystem::resize_file(file_, *keep_bytes_);
  keep_bytes_.reset();
  if (is_begun_ && !is_there(file_))
    throw std::runtime_error(file_.string() + ": cannot be written: it was deleted or moved");
  append_to_file(file_, collected_, {.durable = true});
  is_begun_ = true;
}

}  // namespace km
