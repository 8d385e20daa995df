#include "modules/journal/journal_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "modules/core/bytes.hpp"
#include "modules/core/input_file.hpp"

namespace km {
namespace {

constexpr std::string_view kMagic = "KMJRNL1\n";
constexpr std::uint64_t kFirstCheckSum = 0xcbf29ce484222325ULL;

std::uint64_t number_at(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) value |= std::uint64_t{bytes[k]} << (8U * k);
  return value;
}

void append_number(std::string& text, std::uint64_t value, std::size_t bytes) {
  for (std::size_t k = 0; k < bytes; ++k) text += static_cast<char>(value >> (8U * k));
}

// Eight bytes at a time; the length tells how many of the last are zeros of its own.
std::uint64_t mixed(std::uint64_t check_sum, std::span<const std::uint8_t> bytes) {
  mix_fnv1a(check_sum, bytes.size());
  for (std::size_t k = 0; k < bytes.size(); k += 8)
    mix_fnv1a(check_sum, number_at(bytes.subspan(k, std::min<std::size_t>(8, bytes.size() - k))));
  return check_sum;
}

}  // namespace

JournalExtent read_journal(const std::filesystem::path& file,
                           const std::function<void(JournalEntry)>& take) {
  const std::string text = read_input_file(file);
  JournalExtent read{.check_sum = kFirstCheckSum};
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
    take(*std::move(entry.value));
  }
  return read;
}

JournalFile::JournalFile(std::filesystem::path file) : JournalFile(std::move(file), {}) {}

JournalFile::JournalFile(std::filesystem::path file, const JournalExtent& read)
    : file_(std::move(file)), keep_bytes_(read.whole_bytes), check_sum_(read.check_sum) {
  if (read.whole_bytes > 0) return;
  check_sum_ = kFirstCheckSum;
  waiting_ = kMagic;
}

void JournalFile::add(const JournalEntry& entry) {
  const std::vector<std::uint8_t> bytes = encode_journal_entry(entry);
  full_ |=
      waiting_.size() + bytes.size() > kMaxWaiting_bytes || bytes.size() > kMaxJournalEntry_bytes;
  if (full_) return;
  check_sum_ = mixed(check_sum_, bytes);
  append_number(waiting_, bytes.size(), sizeof(std::uint32_t));
  waiting_.append(bytes.begin(), bytes.end());
  append_number(waiting_, check_sum_, sizeof(std::uint64_t));
}

void JournalFile::sync() {
  if (waiting_.empty()) return;
  constexpr mode_t kMode = 0666;  // less the umask
  const int descriptor = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_APPEND, kMode);
  int error = descriptor < 0 ? errno : write_waiting(descriptor);
  if (descriptor >= 0 && close(descriptor) != 0 && error == 0) error = errno;
  if (error != 0)
    throw std::system_error(error, std::generic_category(), file_.string() + ": cannot be written");
}

// The error, or 0. What is left after one may be the rest of an entry: the next call goes on with
// it.
int JournalFile::write_waiting(int descriptor) {
  if (keep_bytes_ && ftruncate(descriptor, static_cast<off_t>(*keep_bytes_)) != 0) return errno;
  keep_bytes_.reset();
  std::size_t written = 0;
  int error = 0;
  while (written < waiting_.size() && error == 0) {
    const ssize_t n = ::write(descriptor, waiting_.data() + written, waiting_.size() - written);
    if (n > 0)
      written += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      error = n == 0 ? ENOSPC : errno;
  }
  waiting_.erase(0, written);
  return error == 0 && fdatasync(descriptor) != 0 ? errno : error;
}

}  // namespace km
