#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/journal/journal_entry.hpp"

namespace km {

/// What a journal holds, as far as it is whole.
struct JournalExtent {
  std::uintmax_t whole_bytes = 0;  ///< From here on it goes on.
  std::uintmax_t cut_bytes = 0;    ///< Of the torn end that follows.
  std::size_t entries = 0;
  std::uint64_t check_sum = 0;  ///< After the last whole entry.
};

/// Where the bytes of an entry lie in a journal.
struct JournalPlace {
  std::uint64_t offset = 0;
  std::uint32_t bytes = 0;
};

/// Calls `take` for every whole entry in order. Throws InputFileError where the file cannot be read
/// or is no journal; one shorter than its first eight bytes is empty.
[[nodiscard]] JournalExtent read_journal(
    const std::filesystem::path& file, const std::function<void(JournalEntry, JournalPlace)>& take);

/// The entry at `place`. Throws InputFileError where there is none that can be read.
[[nodiscard]] JournalEntry read_journal_entry(const std::filesystem::path& file,
                                              const JournalPlace& place);

/// A journal is a file that only grows: eight bytes that name the format, then entries, each as its
/// length (u32), its bytes, and a check sum (u64, FNV-1a) over them and all before. What a process
/// that was killed, or a machine without power, has left of the last entries fails the check.
/// Not thread-safe.
class JournalFile {
 public:
  /// What may wait for a disk that is full [bytes].
  static constexpr std::size_t kMaxWaiting_bytes = std::size_t{64} << 20U;

  /// Begins a new journal in place of what is there. Nothing is written before sync().
  explicit JournalFile(std::filesystem::path file);
  /// Goes on with one that was read, and cuts its torn end off with the first sync().
  JournalFile(std::filesystem::path file, const JournalExtent& read);

  /// Takes an entry for the next sync(), and says where it will be. A journal has no holes: where
  /// one would not fit any more, it and all that follow are left out, nullopt.
  std::optional<JournalPlace> add(const JournalEntry& entry);

  /// Everything added is on the disk afterwards, whatever happens to this machine, and the file
  /// closed: nothing keeps the disk from being taken away in between. Throws
  /// std::system_error, one line that names the file and why; what is not written yet waits for the
  /// next call.
  void sync();

  /// False once an entry has been left out.
  [[nodiscard]] bool is_whole() const { return !full_; }

 private:
  const std::filesystem::path file_;
  std::optional<std::uintmax_t> keep_bytes_;  // of what was there, until the rest is cut off
  std::uint64_t check_sum_;
  std::uint64_t end_bytes_;  // of the file, once all that waits is written
  std::string waiting_;
  bool full_ = false;
};

}  // namespace km
