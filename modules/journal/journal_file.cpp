#include "modules/journal/journal_file.hpp"

#include <fstream>
#include <span>
#include <string_view>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/write_file.hpp"

namespace km {
namespace {

constexpr std::string_view kMagic = "KMJRNL1\n";

// Updates the check sum by an entry.
std::uint64_t mixed(std::uint64_t check_sum, std::span<const std::uint8_t> bytes) {
  mix_fnv1a(check_sum, bytes.size());
  mix_fnv1a(check_sum, bytes);
  return check_sum;
}

}  // namespace

JournalExtent read_journal(const std::filesystem::path& file,
                           const std::function<void(JournalEntry, JournalPlace)>& take) {
  const std::string text = read_input_file(file);
  JournalExtent read{.check_sum = kFnv1aBasis};
  const std::string_view begin = std::string_view(text).substr(0, kMagic.size());
  if (!kMagic.starts_with(begin))
    throw InputFileError(file.string() + ": is no journal of a robot's run");
  read.cut_bytes = text.size();
  if (begin.size() < kMagic.size()) return read;
  ByteReader in({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  (void)in.bytes(kMagic.size());
  const auto advance = [&] {
    read.whole_bytes = text.size() - in.left();
    read.cut_bytes = in.left();
  };
  advance();
  while (in.left() > 0) {
    const std::uint32_t size = in.u32();
    if (size > kMaxJournalEntry_bytes) break;
    const JournalPlace place{text.size() - in.left(), size};
    const auto bytes = in.bytes(size);
    const std::uint64_t check_sum = in.u64();
    if (in.failed() || mixed(read.check_sum, bytes) != check_sum) break;
    auto entry = decode_journal_entry(bytes);
    if (!entry.value)
      throw InputFileError(file.string() + ": entry " + std::to_string(read.entries + 1) + ": " +
                           entry.refusal + ": written by another version of this program");
    read.check_sum = check_sum;
    ++read.entries;
    advance();
    take(*std::move(entry.value), place);
  }
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
    : file_(std::move(file)),
      keep_bytes_(read.whole_bytes),
      check_sum_(read.check_sum),
      end_bytes_(read.whole_bytes) {
  if (read.whole_bytes > 0) return;
  check_sum_ = kFnv1aBasis;
  waiting_ = kMagic;
  end_bytes_ = waiting_.size();
}

std::optional<JournalPlace> JournalFile::add(const JournalEntry& entry) {
  const std::vector<std::uint8_t> bytes = encode_journal_entry(entry);
  full_ |=
      waiting_.size() + bytes.size() > kMaxWaiting_bytes || bytes.size() > kMaxJournalEntry_bytes;
  if (full_) return std::nullopt;
  check_sum_ = mixed(check_sum_, bytes);
  ByteWriter size, sum;
  size.u32(static_cast<std::uint32_t>(bytes.size()));
  sum.u64(check_sum_);
  const std::size_t before = waiting_.size();
  const auto append = [this](const auto& part) { waiting_.append(part.begin(), part.end()); };
  append(size.release());
  const JournalPlace place{end_bytes_ + (waiting_.size() - before),
                           static_cast<std::uint32_t>(bytes.size())};
  append(bytes);
  append(sum.release());
  end_bytes_ += waiting_.size() - before;
  return place;
}

void JournalFile::sync() {
  if (waiting_.empty()) return;
  if (keep_bytes_ && is_there(file_)) std::filesystem::resize_file(file_, *keep_bytes_);
  keep_bytes_.reset();
  append_to_file(file_, waiting_, {.durable = true});
}

}  // namespace km
